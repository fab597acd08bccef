"""Load models that are shown without a scene file: one at the origin, or several together, in a light of their own.

Several are shown at the coordinates of their files, as other viewers do it: parts of an assembly and tiles of a scan
fit together only so. Models that have nothing to do with each other can stand side by side instead.
"""

import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from depthwalk.errors import InputError, missing_file
from depthwalk.ingest.formats import SCENE_SUFFIXES, check_suffix, is_baked_file, is_mesh_file, is_model_file
from depthwalk.limits import MAX_COORDINATE
from depthwalk.scene.document import Document
from depthwalk.scene.loader import load_scene, scene_from
from depthwalk.scene.model_document import asset_text, document_of, name_text
from depthwalk.scene.scene import MeshAsset, Scene
from depthwalk.types import Array

_GAP = 0.2  # of the widest model's width: between models that stand side by side


def load_files(
    files: Sequence[Path],
    asset_roots: Sequence[Path | str] = (),
    overrides: Mapping[str, str] | None = None,
    sky: Path | None = None,
    *,
    side_by_side: bool = False,
    texture: Path | None = None,
) -> Scene:
    """Load a scene file, or one or several models as a scene that holds nothing else.

    Of several models, the meshes are read for their bounding boxes. Each is an asset with the name of its file, and all
    of them together stand on the origin.

    Parameters
    ----------
    files
        A scene file, or models; errors cite them as given.
    asset_roots, overrides, sky
        As for `load_scene`.
    side_by_side
        Whether several models stand in a row along x, instead of at the coordinates of their files.
    texture
        A picture that replaces the textures of the meshes; it may lie anywhere. None keeps them.

    Returns
    -------
    Scene
        The scene, whose `path` is the first of the files.

    Raises
    ------
    InputError
        With one located line per mistake; also for several files that are not all meshes.
    """
    first, *others = files
    if texture is not None:
        return _textured(load_files(files, asset_roots, overrides, sky, side_by_side=side_by_side), texture)
    if not others:
        if side_by_side:
            raise InputError("--side-by-side: needs several models")
        return load_scene(first, asset_roots, overrides, sky)
    boxes = _boxes(files)
    names = _asset_names(files)
    ups = [(overrides or {}).get(f"assets.{name}.up", "y") for name in names]
    upright = np.array([_turned(box) if up == "z" else box for box, up in zip(boxes, ups, strict=True)])
    places = _in_a_row(upright) if side_by_side else _at_their_coordinates(upright)
    folder = _common_folder(files)
    roots = [*asset_roots, *(file.parent for file in files)]  # where --set may name a texture
    _check_distances(files, places)
    scene = scene_from(_document(files, names, places, folder), first, folder, roots, overrides, sky)
    return replace(scene, beside=tuple(others), side_by_side=side_by_side)


def _textured(scene: Scene, texture: Path) -> Scene:
    """Return a scene of meshes without a scene file, with another texture. Raises InputError for other scenes."""
    if not texture.is_file():
        raise missing_file(texture)
    if not is_mesh_file(scene.path):
        raise InputError("--texture: needs a mesh; in a scene file, an asset has the key 'texture'")
    picture = texture.resolve()
    meshes = tuple(replace(asset, texture=picture) for asset in scene.assets if isinstance(asset, MeshAsset))
    return replace(scene, assets=meshes)


def _document(files: Sequence[Path], names: Sequence[str], places: Array, folder: Path) -> Document:
    """Return the scene file that a user would write in `folder` to look at models at `places` (n, 3), metres."""
    assets, objects = [], []
    for file, name, place in zip(files, names, places.tolist(), strict=True):
        found = file.resolve()
        assets.append(f"{name_text(name)}: {asset_text(found, found.relative_to(folder).as_posix())}")
        objects.append(f"{{asset: {name_text(name)}, position: {json.dumps(place)}}}")
    return document_of(assets, objects, files[0])


def _boxes(files: Sequence[Path]) -> Array:
    """Return the bounding boxes (n, 2, 3) of meshes, in the frames of their files. Raises InputError for all others."""
    from depthwalk.ingest.loader import measure_mesh  # here: a single model is not read

    boxes: list[tuple[Array, Array]] = []
    complaints: list[str] = []
    for file in files:
        try:
            _check_mesh(file)
            extent = measure_mesh(file)
            boxes.append((extent.low, extent.high))
        except InputError as error:
            complaints += error.lines
    if complaints:
        raise InputError(*complaints)
    return np.array(boxes)


def _check_mesh(file: Path) -> None:
    if not file.is_file():
        raise missing_file(file)
    if not is_model_file(file):
        if file.suffix.lower() not in SCENE_SUFFIXES:
            check_suffix(file)
        raise InputError(f"{file}: is no mesh; a scene is shown by itself, a camera path is given as --path")
    if is_baked_file(file):
        raise InputError(f"{file}: depth images do not say where their mesh was; give the mesh, or write a scene file")


def _asset_names(files: Sequence[Path]) -> list[str]:
    """Return a name for each file, made of its own, that can be a part of a dotted key and that no other has."""
    names: list[str] = []
    for file in files:
        stem = re.sub(r"[^\w-]+", "_", file.stem)
        number = 1
        while (name := stem if number == 1 else f"{stem}-{number}") in names:
            number += 1
        names.append(name)
    return names


def _common_folder(files: Sequence[Path]) -> Path:
    """Return the innermost folder that holds all files, without links. Raises InputError if there is none."""
    try:
        return Path(os.path.commonpath([file.resolve().parent for file in files]))
    except ValueError:
        raise InputError(f"{files[0]}: lies on another drive than some of the other files") from None


def _turned(box: Array) -> Array:
    """Return the bounds (2, 3) of a box after its z axis was turned upward: (x, y, z) becomes (x, z, −y)."""
    (x, y, z), (x1, y1, z1) = box
    return np.array([[x, z, -y1], [x1, z1, -y]])


def _bases(boxes: Array) -> Array:
    """Return the centres (…, 3) of the bases of boxes (…, 2, 3), on which the objects of a scene stand."""
    centre = boxes.mean(axis=-2)
    centre[..., 1] = boxes[..., 0, 1]
    return np.asarray(centre)


def _at_their_coordinates(boxes: Array) -> Array:
    """Return where models stand so that they have the places of their files, with the common base on the origin."""
    common = np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
    return np.asarray(_bases(boxes) - _bases(common))


def _check_distances(files: Sequence[Path], places: Array) -> None:
    """Raise InputError if models at `places` (n, 3), metres, are farther apart than a scene can be wide."""
    far = np.abs(places).max(axis=1) > MAX_COORDINATE
    if far.any():
        apart = np.linalg.norm(places - places[0], axis=1)
        farthest = int(apart.argmax())
        kilometres = f"{apart[farthest] / 1000:,.0f} km apart by their coordinates"
        raise InputError(f"{files[0]} and {files[farthest]}: {kilometres}; --side-by-side shows them in a row")


def _in_a_row(boxes: Array) -> Array:
    """Return where models (n, 2, 3) stand beside one another along x, the middle of the row at the origin."""
    width = np.ptp(boxes[:, :, 0], axis=1)
    ends = np.cumsum(width + _GAP * width.max())
    middles = ends - _GAP * width.max() - width / 2
    places = np.zeros((len(boxes), 3))
    places[:, 0] = middles - (ends[-1] - _GAP * width.max()) / 2
    return places
