"""Loading a scene file: read, override, check, find its files, flatten."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from depthwalk.errors import InputError
from depthwalk.scene.arrays import Camera
from depthwalk.scene.document import Loc, read_document
from depthwalk.scene.environment import CameraParams, Environment
from depthwalk.scene.files import FileFinder, make_finder
from depthwalk.scene.flatten import flatten, list_rows, reference_errors
from depthwalk.scene.lone_mesh import is_mesh_file, mesh_document
from depthwalk.scene.places import read_places
from depthwalk.scene.scene import Asset, DepthImageAsset, MeshAsset, Scene
from depthwalk.scene.schema import AssetParams, DpciParams, MeshAssetParams, PlacesParams, SceneFile
from depthwalk.scene.validate import check_model, raise_all


def load_scene(
    path: Path | str, asset_roots: Sequence[Path | str] = (), overrides: Mapping[str, str] | None = None
) -> Scene:
    """Load a scene file, or a mesh as a scene of its own (`lone_mesh`).

    Opens no asset, only files of places, but makes sure that each is there.

    path:        the file; errors cite it as given.
    asset_roots: folders besides the scene's own in which its files may lie; the program's own assets come last.
    overrides:   dotted path in the file → YAML text of the value, as `--set` gives them.
    Raises InputError with one located line per mistake.
    """
    path = Path(path)
    lone = is_mesh_file(path)
    document = mesh_document(path) if lone else read_document(path)
    if document.holds(("keyframes",)):
        raise InputError(f"{path}: is a camera path, not a scene; --path takes it")
    file, source = check_model(document, SceneFile, overrides)
    rows = list_rows(file.objects, source)
    finder = make_finder(path.resolve() if lone else path, asset_roots, source)
    assets = tuple(_asset(name, spec, finder) for name, spec in file.assets.items())
    environment = _environment(file.environment, finder)
    named = {
        row.loc: finder.find((*row.loc, "file"), row.spec.file) for row in rows if isinstance(row.spec, PlacesParams)
    }
    raise_all(reference_errors(rows, file.assets, source) + finder.errors)
    places = {loc: read_places(found) for loc, found in named.items()}
    flat = flatten(rows, file.assets, places, source)
    return Scene(
        path=path,
        assets=assets,
        objects=flat.objects,
        nodes=flat.nodes,
        instances=flat.instances,
        owner=flat.owner,
        environment=environment,
        camera=camera_from(file.camera) if file.camera else None,
        render=file.render,
        walk=file.walk,
    )


def camera_from(params: CameraParams) -> Camera:
    """The camera of a file, its angle in radians."""
    return Camera(params.position, params.target, math.radians(params.fov))


def _asset(name: str, spec: AssetParams, finder: FileFinder) -> Asset:
    loc = ("assets", name)
    if isinstance(spec, MeshAssetParams):
        return MeshAsset(
            name=name,
            mesh=finder.find((*loc, "mesh"), spec.mesh),
            texture=finder.find_optional((*loc, "texture"), spec.texture),
            up=spec.up,
            height=spec.height,
            dpci=_dpci((*loc, "dpci"), spec.dpci, finder),
        )
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
    )


def _dpci(loc: Loc, dpci: DpciParams | None, finder: FileFinder) -> DpciParams | None:
    if dpci is None or dpci.meso is None:
        return dpci
    depth = finder.find((*loc, "meso", "depth"), dpci.meso.depth)
    normal = finder.find_optional((*loc, "meso", "normal"), dpci.meso.normal)
    return dpci.model_copy(update={"meso": dpci.meso.model_copy(update={"depth": depth, "normal": normal})})


def _environment(environment: Environment, finder: FileFinder) -> Environment:
    ground = environment.ground
    if ground is None or ground.texture is None:
        return environment
    texture = finder.find(("environment", "ground", "texture"), ground.texture)
    return environment.model_copy(update={"ground": ground.model_copy(update={"texture": texture})})
