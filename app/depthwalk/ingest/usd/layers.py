"""Open the layers of a USD file, after checking that none of them lies outside its folder.

usd-core opens whatever a layer names: sublayers, references and payloads, in other folders too. So the layers are
walked through before they are composed, and what they name is resolved here as usd-core resolves it.
"""

import os
import re
from pathlib import Path
from typing import Any

from pxr import Ar, Sdf, Usd

from depthwalk.ingest.formats import USD_SUFFIXES
from depthwalk.ingest.usd.problems import Unread, UsdError, one_line
from depthwalk.limits import MAX_LOOKUPS


def open_stage(path: str, root: str, unread: Unread) -> Any:
    """Open a USD file with all that it names.

    Parameters
    ----------
    path
        The file, without symbolic links.
    root
        The folder outside which no layer may lie, without symbolic links.
    unread
        Counts what is named and not read, since it is of another format.

    Returns
    -------
    Usd.Stage
        The stage, with all payloads.

    Raises
    ------
    UsdError
        For a layer that is missing or outside the folder, or if they name each other in a circle.
    Tf.ErrorException
        For a damaged layer.
    """
    layer = Sdf.Layer.FindOrOpen(path)
    if layer is None:
        raise UsdError("damaged, truncated or an unsupported kind of USD")
    _check_layers(layer, root, unread)
    stage = Usd.Stage.Open(layer, None, Usd.Stage.LoadAll)
    for error in stage.GetCompositionErrors():
        raise UsdError(_composition_error(error, root))
    return stage


def file_in(resolved: str) -> str:
    """Return the file of a resolved path such as `scene.usdz[tree.usdc]`, without symbolic links."""
    outer = Ar.SplitPackageRelativePathOuter(resolved)[0] if Ar.IsPackageRelativePath(resolved) else resolved
    return os.path.realpath(outer)


def is_inside(resolved: str, root: str) -> bool:
    """Return whether a resolved path lies in a folder, which has no symbolic links."""
    return Path(file_in(resolved)).is_relative_to(root)


def _check_layers(first: Any, root: str, unread: Unread) -> None:
    """Open all layers that a layer names, directly or not, and check where they are."""
    known, waiting = {first.identifier}, [first]
    while waiting:
        layer = waiting.pop()
        _remove_clips(layer)
        for name in layer.GetCompositionAssetDependencies():
            if not name:
                continue
            if name.startswith("`"):
                raise UsdError(f"{_whence(layer, name, first, root)} an expression, {name[:80]}, which is not read")
            resolved = Sdf.ComputeAssetPathRelativeToLayer(layer, name)
            resolved = Sdf.Layer.SplitIdentifier(resolved)[0]
            if not is_inside(resolved, root):
                raise UsdError(f"{_whence(layer, name, first, root)} @{name[:200]}@, outside the folder of the file")
            suffix = os.path.splitext(resolved.rstrip("]"))[1].lower()
            if suffix not in USD_SUFFIXES:
                layer.UpdateCompositionAssetDependency(name, "")
                unread.count(f"reference to a {suffix or 'nameless'} file", f"references to {suffix} files")
                continue
            if not os.path.isfile(file_in(resolved)):
                continue  # told by the composition, unless it is in a variant that is not selected
            opened = Sdf.Layer.FindOrOpenRelativeToLayer(layer, name)
            if opened is not None and opened.identifier not in known:
                known.add(opened.identifier)
                waiting.append(opened)
            if len(known) > MAX_LOOKUPS:
                raise UsdError(f"it names more than {MAX_LOOKUPS} layers")


def _remove_clips(layer: Any) -> None:
    """Take the value clips out of a layer: they name files, too, which are opened when values are read."""

    def visit(path: Any) -> None:
        spec = layer.GetObjectAtPath(path) if _is_prim(path) else None
        if spec is not None and spec.HasInfo("clips"):
            spec.ClearInfo("clips")

    layer.Traverse(Sdf.Path.absoluteRootPath, visit)


def _is_prim(path: Any) -> bool:
    """Return whether a path of a layer is that of a prim, or of what a variant says of one."""
    return bool(path.IsPrimPath() or path.IsPrimVariantSelectionPath())


def _whence(layer: Any, name: str, first: Any, root: str) -> str:
    """Return which prim of a layer names a file, for a message, and of which layer unless it is the first one."""
    found: list[str] = []

    def visit(path: Any) -> None:
        spec: Any = layer.GetObjectAtPath(path) if _is_prim(path) and not found else None
        for key in ("references", "payload"):
            if spec is not None and spec.HasInfo(key):
                listed = spec.GetInfo(key)
                items = (*listed.explicitItems, *listed.prependedItems, *listed.appendedItems, *listed.addedItems)
                if any(item.assetPath == name for item in items):
                    found.append(str(path))

    layer.Traverse(Sdf.Path.absoluteRootPath, visit)
    own = "" if layer == first else f"{os.path.relpath(layer.identifier, root)}: "
    return f"{own}{found[0] if found else 'its list of layers'} refers to"


def _composition_error(error: Any, root: str) -> str:
    """Return a message about an error of the composition: a file that is missing, or a circle."""
    text = one_line(str(error)).replace(root.rstrip("/") + "/", "")
    place = getattr(getattr(error, "rootSite", None), "path", None)
    if (missing := re.match(r"Could not open asset (@.*?@) for", text)) is not None:
        text = f"refers to {missing[1]}, which is missing"
    elif text.startswith("Cycle detected"):
        text = "refers to itself, in a circle"
    return f"{place}: {text}" if place else text
