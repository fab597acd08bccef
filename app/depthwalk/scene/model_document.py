"""Write the scene file that a user would write to look at a model that has none, in a light of its own.

The light is that of a studio, since the albedo of models and scans is often close to white (docs/light.md).
"""

import json
from collections.abc import Sequence
from pathlib import Path

from depthwalk.errors import missing_file
from depthwalk.ingest.formats import is_baked_file
from depthwalk.scene.document import Document, parse_document

_LIGHT = (
    "{sun: {colour: [1, 0.98, 0.95], intensity: 0.7}, "
    "ambient: {colour: [0.96, 0.98, 1], intensity: 0.5, direction: [0.65, -0.6, 0.5], contrast: 0.85}}"
)
"""The `environment` of models: white surfaces come out just below white, and those turned from the sun have shape."""


def model_document(path: Path) -> Document:
    """Return the scene file that a user would write to look at a single mesh or a file of depth images.

    Its asset is called `model`, so that `--set assets.model.…` works. Links are followed, so that the file lies in the
    scene's folder. Raises InputError if there is no such file.
    """
    if not path.is_file():
        raise missing_file(path)
    file = path.resolve()  # as the asset is read: the command line prints equal warnings once
    return document_of([f"model: {asset_text(file, file.name)}"], ["{asset: model}"], path)


def document_of(assets: Sequence[str], objects: Sequence[str], path: Path) -> Document:
    """Return the scene file of the texts of assets and objects, in the light of models; errors cite `path`."""
    lists = f"assets: {{{', '.join(assets)}}}, objects: [{', '.join(objects)}]"
    return parse_document(f"{{version: 1, {lists}, environment: {_LIGHT}}}", str(path))


def asset_text(file: Path, name: str) -> str:
    """Return the text of an asset that shows a model: its `file`, and the `name` by which the scene finds it."""
    from depthwalk.ingest.mesh_head import is_all_translucent  # here, since scenes need none of it

    if is_baked_file(file):
        return f"{{baked: {name_text(name)}}}"
    images = "" if is_all_translucent(file) else ", dpci: {}"  # depth images would show nothing of a translucent mesh
    return f"{{mesh: {name_text(name)}{images}}}"


def name_text(value: str) -> str:
    """Return a name as YAML text, in quotes."""
    return json.dumps(value, ensure_ascii=False)
