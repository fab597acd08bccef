"""Load a scene file: parse it, apply overrides, check it, find the files it names, and flatten its scene graph.

No mesh or picture is opened here, so that loading does not take longer with large models. Only if a model is loaded in
place of a scene is its head read, to see whether any of it is opaque.
"""

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING

from depthwalk.errors import InputError, as_given, foreign_name, missing_file, suggest_file
from depthwalk.ingest.formats import check_baked_suffix, check_sky_suffix, check_suffix, is_model_file
from depthwalk.resources import asset_root
from depthwalk.scene.arrays import Camera
from depthwalk.scene.document import Document, Loc, read_document
from depthwalk.scene.environment import CameraParams, Environment
from depthwalk.scene.fields import FileParams
from depthwalk.scene.flatten import Flat, ListedItem, flatten, list_items, reference_errors
from depthwalk.scene.scene import Asset, BakedAsset, DepthImageAsset, MeshAsset, Scene, show_moment
from depthwalk.scene.schema import AssetParams, BakedAssetParams, DpciParams, MeshAssetParams, PlacesParams, SceneFile
from depthwalk.scene.similarity import Similarity
from depthwalk.scene.validate import Source, check_model, raise_all

if TYPE_CHECKING:
    from depthwalk.scene.advice import Advice

# What --sky sets itself, so that one of the two would be ignored.
_WHOLE_SKY = "environment", "environment.sky", "environment.sky.image"


def load_scene(
    path: Path | str,
    asset_roots: Sequence[Path | str] = (),
    overrides: Mapping[str, str] | None = None,
    sky: Path | None = None,
) -> Scene:
    """Load a scene file; a mesh or a file of depth images is loaded as a scene that holds nothing else.

    Of the files that the scene names, only its advice and the lists of positions of `places` items are opened; all
    others are only checked to exist.

    Parameters
    ----------
    path
        The scene file, mesh or depth images; errors cite it as given.
    asset_roots
        Folders, besides the scene's own, in which to look for its files; the program's own assets come last.
    overrides
        Values to replace: YAML text by dotted path in the file, as `--set` gives them; None replaces none.
    sky
        A picture that becomes the sky, instead of what the scene says, and lights the scene; it may lie anywhere. None
        leaves the scene's own.

    Returns
    -------
    Scene
        The scene, its assets not yet read.

    Raises
    ------
    InputError
        With one located line per mistake.
    """
    path = Path(path)
    if is_model_file(path):
        from depthwalk.scene.model_document import model_document  # here, since scenes need none of it

        return scene_from(model_document(path), path, path.resolve().parent, asset_roots, overrides, sky)
    return scene_from(read_document(path), path, path.parent, asset_roots, overrides, sky)


def scene_from(
    document: Document,
    path: Path,
    folder: Path,
    asset_roots: Sequence[Path | str],
    overrides: Mapping[str, str] | None,
    sky: Path | None,
) -> Scene:
    """Make a scene of a parsed scene file.

    Parameters
    ----------
    document
        The scene file.
    path
        What errors cite, and the scene has as its `path`.
    folder
        The folder in which the scene's files are looked up first.
    asset_roots, overrides, sky
        As for `load_scene`.

    Returns
    -------
    Scene
        The scene, its assets not yet read.

    Raises
    ------
    InputError
        With one located line per mistake.
    """
    if document.holds(("keyframes",)):
        raise InputError(f"{path}: is a camera path, not a scene; give it as --path")
    unversioned: list[InputError] = []
    file, source = check_model(document, SceneFile, _with_sky(overrides, sky), unversioned)
    rows = list_items(file.objects, source)
    finder = _finder(folder, asset_roots, source)
    places = {} if is_model_file(path) else _places(source)
    assets = tuple(_asset(name, spec, finder, places.get(name, "")) for name, spec in file.assets.items())
    environment = _environment(file.environment, finder, sky)
    named = {
        row.loc: finder.find((*row.loc, "file"), row.spec.file) for row in rows if isinstance(row.spec, PlacesParams)
    }
    advice = finder.find_optional(("advice",), file.advice)
    missing = {asset.name for asset in assets if isinstance(asset, BakedAsset) and asset.source is None}
    raise_all(unversioned + reference_errors(rows, file.assets, source, missing) + finder.errors)
    flat = flatten(rows, file.assets, _read_places(named, source) if named else {}, source)
    scene = Scene(
        path=path,
        assets=assets,
        objects=flat.objects,
        nodes=flat.nodes,
        instances=flat.instances,
        owner=flat.owner,
        environment=environment,
        picture_places=_picture_places(environment, source, sky),
        camera=camera_from(file.camera) if file.camera else None,
        render=file.render,
        walk=file.walk,
        advice=_advice(advice, source),
        advice_file=advice,
        places_files=tuple(dict.fromkeys(named.values())),
    )
    return _animated(scene, rows, flat, source) if any(row.spec.animation is not None for row in rows) else scene


def _animated(scene: Scene, rows: list[ListedItem], flat: Flat, source: Source) -> Scene:
    """Return the scene with the animations of its nodes, which stand as at their beginning."""
    from depthwalk.scene.animation_check import load_animations  # here: most scenes stand still

    scene = replace(scene, animations=load_animations(rows, flat, source))
    show_moment(scene, 0.0)
    return scene


def _advice(file: Path | None, source: Source) -> "dict[str, Advice]":
    """Return the advice in a file, by asset; empty if the scene names none, as most do."""
    if file is None:
        return {}
    from depthwalk.scene.advice import load_advice

    with _named_at(source, ("advice",)):
        return load_advice(file)


@contextmanager
def _named_at(source: Source, loc: Loc) -> Iterator[None]:
    """Add to InputErrors about a file that it is named at the location `loc`."""
    try:
        yield
    except InputError as error:
        raise InputError(*(line for text in error.lines for line in source.error(loc, text).lines)) from error


def _places(source: Source) -> dict[str, str]:
    """Return where the scene file describes each asset, by name, but for those that options set."""
    set_by_options = {loc[1] for loc in source.overrides if loc[0] == "assets" and len(loc) > 1}
    places = source.document.places("assets")
    return {name: place for name, place in places.items() if name not in set_by_options}


def camera_from(params: CameraParams) -> Camera:
    """Return the camera that `params` of a scene file describe, with its field of view in radians."""
    return Camera(params.position, params.target, math.radians(params.fov))


_NOT_FOUND = "not found"


@dataclass
class FileFinder:
    """Look up the files that a scene names: in its folder, in the asset roots, and among the program's own assets.

    Errors are collected instead of raised, so that all mistakes of a scene are reported at once.

    Attributes
    ----------
    source
        Origin of the scene's values, to locate errors.
    roots
        The folders to search, in this order, absolute and without symbolic links.
    errors
        The errors found so far.
    """

    source: Source
    roots: tuple[Path, ...]
    errors: list[InputError] = field(default_factory=list)

    def find(self, loc: Loc, name: Path) -> Path:
        """Return the absolute path of the file `name`, which the scene names at the location `loc`.

        If there is no such file, this adds to `errors` and returns a path that must not be used.
        """
        found = self._searched(name)
        if isinstance(found, Path):
            return found
        hints = (suggest_file(root / name) for root in (*self.roots, asset_root())) if found == _NOT_FOUND else iter(())
        return self._complain(loc, name, found + (foreign_name(name) or next(filter(None, hints), "")))

    def find_named(self, loc: Loc, name: Path, check: Callable[[Path], None]) -> Path:
        """Return the absolute path of the file `name`, as `find` does.

        If the file exists but `check` raises InputError for its name, this also adds to `errors`.
        """
        searched = self._searched(name)
        if isinstance(searched, Path):
            try:
                check(name)
            except InputError as error:
                self.errors.append(self.source.error(loc, str(error)))
        return self.find(loc, name)

    def find_optional(self, loc: Loc, name: Path | None) -> Path | None:
        """Return the absolute path of the file `name`, as `find` does; None if `name` is None."""
        return None if name is None else self.find(loc, name)

    def find_if_present(self, loc: Loc, name: Path | None, check: Callable[[Path], None]) -> Path | None:
        """Return the absolute path of the file `name`, which the scene names at the location `loc`, if it exists.

        The result is None if `name` is None or there is no such file. Names that are not allowed at all add to
        `errors`, as with `find_named`.
        """
        return None if name is None or self._searched(name) == _NOT_FOUND else self.find_named(loc, name, check)

    def _searched(self, name: Path) -> Path | str:
        """Return the absolute path of the file `name`; if there is no such file, return what is wrong with the name."""
        if PurePosixPath(name).is_absolute() or PureWindowsPath(name).anchor:
            return "is absolute; paths are relative to the scene file"
        try:
            candidates = [(root / name).resolve() for root in self.roots]
            inside = [path for path in candidates if any(path.is_relative_to(root) for root in self.roots)]
            shipped = (asset_root() / name).resolve()
            for path in [*inside, shipped] if shipped.is_relative_to(asset_root()) else inside:
                if path.is_file():
                    return path
            if not inside:
                return "leaves the scene's folder and every asset root; name its folder by --asset-root DIR"
            return "is a folder, not a file" if any(path.is_dir() for path in inside) else _NOT_FOUND
        except (OSError, ValueError, RuntimeError):  # the name is too long, has a null character or a loop of links
            return "is not a usable path"

    def _complain(self, loc: Loc, name: Path, problem: str) -> Path:
        self.errors.append(self.source.error(loc, f"file {as_given(name)!r} {problem}"))
        return name


def _finder(folder: Path, asset_roots: Sequence[Path | str], source: Source) -> FileFinder:
    """Return the finder for files of a scene in `folder`. Raises InputError for an asset root that is not a folder."""
    for root in asset_roots:
        if not Path(root).is_dir():
            raise InputError(f"--asset-root {as_given(Path(root))}: no such folder{foreign_name(Path(root))}")
    return FileFinder(source, tuple(Path(root).resolve() for root in (folder, *asset_roots)))


def _asset(name: str, spec: AssetParams, finder: FileFinder, place: str) -> Asset:
    loc = ("assets", name)
    if isinstance(spec, MeshAssetParams):
        return MeshAsset(
            name=name,
            mesh=finder.find_named((*loc, "mesh"), spec.mesh, check_suffix),
            texture=finder.find_optional((*loc, "texture"), spec.texture),
            up=spec.up,
            height=spec.height,
            dpci=_dpci((*loc, "dpci"), spec.dpci, finder),
            up_is_given="up" in spec.model_fields_set,
            place=place,
        )
    if isinstance(spec, BakedAssetParams):
        baked = finder.find_named((*loc, "baked"), spec.baked, check_baked_suffix)
        return BakedAsset(name=name, baked=baked, source=_source(name, spec, finder, place), place=place)
    image = spec.depth_image
    return DepthImageAsset(
        name=name,
        depth=finder.find((*loc, "depth_image", "depth"), image.depth),
        colour=finder.find_optional((*loc, "depth_image", "colour"), image.colour),
        normal=finder.find_optional((*loc, "depth_image", "normal"), image.normal),
        size=image.size,
        range=image.range,
        unit=image.unit,
        intrinsics=image.intrinsics,
        panorama=image.panorama,
        method=image.method,
        place=place,
    )


def _source(name: str, spec: BakedAssetParams, finder: FileFinder, place: str) -> MeshAsset | None:
    """Return the mesh that depth images were made from, if it and its texture exist."""
    mesh = finder.find_if_present(("assets", name, "mesh"), spec.mesh, check_suffix)
    if mesh is None:
        return None
    texture = finder.find_optional(("assets", name, "texture"), spec.texture)
    return MeshAsset(name=name, mesh=mesh, texture=texture, up=spec.up, height=spec.height, dpci=None, place=place)


def _dpci(loc: Loc, dpci: DpciParams | None, finder: FileFinder) -> DpciParams | None:
    if dpci is None or dpci.meso is None:
        return dpci
    depth = finder.find((*loc, "meso", "depth"), dpci.meso.depth)
    normal = finder.find_optional((*loc, "meso", "normal"), dpci.meso.normal)
    return dpci.model_copy(update={"meso": dpci.meso.model_copy(update={"depth": depth, "normal": normal})})


def _read_places(files: dict[Loc, Path], source: Source) -> dict[Loc, Similarity]:
    """Return the transforms from the files of places, by the location where the scene names each file."""
    from depthwalk.scene.places import read_places  # here: few scenes name such a file

    read: dict[Loc, Similarity] = {}
    for loc, file in files.items():
        with _named_at(source, (*loc, "file")):
            read[loc] = read_places(file)
    return read


def _with_sky(overrides: Mapping[str, str] | None, sky: Path | None) -> Mapping[str, str] | None:
    """Return `overrides` after those by which the picture `sky` becomes the sky. Raises InputError if it cannot."""
    if sky is None:
        return overrides
    if not sky.is_file():
        raise missing_file(sky)
    check_sky_suffix(sky)
    if beside := [key for key in _WHOLE_SKY if key in (overrides or {})]:
        raise InputError(*(f"--set {key}: cannot be given beside --sky" for key in beside))
    named = json.dumps(sky.name, ensure_ascii=False)
    return {"environment.sky": f"{{model: image, image: {named}, sun: true, light: true}}", **(overrides or {})}


def _environment(environment: Environment, finder: FileFinder, given_sky: Path | None) -> Environment:
    """Return `environment` with absolute paths. given_sky: the picture of its sky that the command line names."""
    ground, sky = environment.ground, environment.sky
    found: dict[str, FileParams] = {}
    if ground is not None and ground.texture is not None:
        texture = finder.find(("environment", "ground", "texture"), ground.texture)
        found["ground"] = ground.model_copy(update={"texture": texture})
    if sky is not None and sky.image is not None:
        loc = "environment", "sky", "image"
        image = given_sky.resolve() if given_sky else finder.find_named(loc, sky.image, check_sky_suffix)
        found["sky"] = sky.model_copy(update={"image": image})
    return environment.model_copy(update=found) if found else environment


def _picture_places(environment: Environment, source: Source, given_sky: Path | None) -> dict[Path, str]:
    """Return where the scene names the pictures of its ground and sky, but for a `given_sky`, see `Scene`."""
    ground, sky = environment.ground, environment.sky
    named = {} if sky is None or given_sky else {sky.image: ("environment", "sky", "image")}
    if ground is not None:
        named[ground.texture] = ("environment", "ground", "texture")
    return {file: str(source.error(loc, "")).removesuffix(": ") for file, loc in named.items() if file is not None}
