"""Choose false colours that tell how a frame drew each of its objects, for the pass `inspection`.

All colours are sRGB, 0 to 1. `legend` explains them, and docs/walking.md shows pictures of them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import drawn_cases
from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.render.draw.draw_lists import DrawList, FrameDrawLists
from depthwalk.render.view.view import View
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.scene.arrays import HEIGHT_FIELDS, Representation
from depthwalk.scene.effect_settings import HowDrawn
from depthwalk.types import Array, Rows

Colour = tuple[float, float, float]

COLOUR_RECORD = np.dtype([("colour", "4f4")])  # sRGB; the fourth component is not used
GROUND_COLOUR = np.array((0.33, 0.33, 0.33))
_WITHOUT: Colour = (0.62, 0.62, 0.62)  # what has no level, no case or no error
_IMPOSTOR: Colour = (0.30, 0.55, 1.00)
_STRAIGHT: Colour = (0.21, 0.77, 0.71)
_MESH: Colour = (0.96, 0.60, 0.24)
_SIMPLIFIED: Colour = (0.95, 0.83, 0.30)
_BY_CLUSTERS: Colour = (0.55, 0.74, 0.29)
_HEIGHT_FIELD: Colour = (0.69, 0.44, 0.91)
_CAPTURED: Colour = (0.93, 0.43, 0.65)
# From the finest level to the coarsest; coarser ones have the last colour too.
_LEVELS: tuple[Colour, ...] = (
    (0.90, 0.28, 0.30),
    (0.94, 0.55, 0.18),
    (0.91, 0.81, 0.24),
    (0.39, 0.76, 0.40),
    (0.21, 0.71, 0.67),
    (0.30, 0.55, 1.00),
    (0.56, 0.44, 0.88),
    (0.80, 0.62, 0.86),
)
_CASES: tuple[Colour, ...] = (_LEVELS[3], _LEVELS[2], _LEVELS[6], _LEVELS[0])  # by the numbers of `Case`
_ERRORS: tuple[Colour, ...] = (_LEVELS[3], _LEVELS[2], _LEVELS[0])  # 0, half and all of what is allowed


@dataclass(frozen=True, kw_only=True)
class ObjectColours:
    """Hold the colours of everything that a frame draws.

    Attributes
    ----------
    records : (1 + d + p,) COLOUR_RECORD: by an object's number in the visibility buffer, of which 0 stands for what
        has no number, then those of the polygons, first meshes that are drawn whole, then those by clusters.
    first_mesh, first_clustered : the first record of either kind of polygons.
    captured : the colour of all captured views.
    """

    records: NDArray[np.void]
    first_mesh: int
    first_clustered: int
    captured: Colour


def object_colours(plan: FrameDrawLists, show: HowDrawn) -> ObjectColours:
    """Return the colours of all objects of a frame.

    Parameters
    ----------
    plan : the draw lists of the whole frame.
    show : what the colours tell.
    """
    first_mesh = 1 + len(plan.object_rows)
    first_clustered = first_mesh + len(plan.mesh.records)
    records = np.zeros(first_clustered + len(plan.clusters.objects.records), COLOUR_RECORD)
    colour = records["colour"][:, :3]
    colour[:] = _WITHOUT
    _colour_depth_images(colour[1:first_mesh], plan, show)
    meshes = plan.polygons.batches
    level = np.repeat(
        np.array([batch.level for batch in meshes], np.int64), np.array([batch.count for batch in meshes], np.int64)
    )
    if show == "representation":
        colour[first_mesh:] = np.where(level[:, None] > 0, _SIMPLIFIED, _MESH)
        colour[first_clustered:] = _BY_CLUSTERS
    elif show == "level":
        colour[first_mesh:] = _of(_LEVELS, level)
    elif show == "error" and plan.polygon_error is not None:
        colour[first_mesh:] = _error_colours(plan.polygon_error)
    return ObjectColours(
        records=records,
        first_mesh=first_mesh,
        first_clustered=first_clustered,
        captured=_CAPTURED if show == "representation" else _WITHOUT,
    )


def _colour_depth_images(colour: Array, plan: FrameDrawLists, show: HowDrawn) -> None:
    """Fill in the colours (d, 3) of the objects that depth images show; those without any keep theirs."""
    straight, tiles, batches = plan.drawn_as == Representation.DMESH, plan.tiles.of_objects(), plan.dmesh.batches
    count = np.array([batch.count for batch in batches], np.int64)
    if show == "representation":
        colour[plan.tiled] = _IMPOSTOR
        colour[straight] = _STRAIGHT
        colour[np.isin(plan.drawn_as, HEIGHT_FIELDS)] = _HEIGHT_FIELD
    elif show == "level":
        colour[plan.tiled] = _of(_LEVELS, tiles.level)
        colour[straight] = _of(_LEVELS, np.repeat(np.array([batch.level for batch in batches], np.int64), count))
    elif show == "case":
        colour[plan.tiled] = _of(_CASES, drawn_cases(tiles.pieces))
        pieces = np.repeat(np.array([batch.pieces for batch in batches], np.int64), count)
        colour[straight] = _of(_CASES, drawn_cases(pieces))
    else:
        colour[plan.tiled] = _error_colours(tiles.error)


def polygon_errors(view: View, polygons: DrawList, table: AssetTable, allowed: float) -> Array:
    """Return by how much polygons are off, in proportion to what is allowed.

    Parameters
    ----------
    view : the view of the picture.
    polygons : the meshes that a frame draws.
    table : the bounds and levels of the assets.
    allowed : the error that a level may have, pixels.

    Returns
    -------
    (p,) by record; 0 for a mesh that is drawn in full, 1 where the error of its level appears as large as allowed, and
    as large as can be where the viewer is within the cylinder around it.
    """
    records, batches = polygons.records, polygons.batches
    count = np.array([batch.count for batch in batches], np.int64)
    asset = np.repeat(np.array([batch.asset for batch in batches], np.int64), count)
    level = np.repeat(np.array([batch.level for batch in batches], np.int64), count)
    rotation, scale = records["rotation"].astype(np.float64), records["scale"].astype(np.float64)
    viewer = rotate(conjugate(rotation), -records["origin"].astype(np.float64)) / scale[:, None]
    nearest = table.nearest(asset, viewer)
    metres = np.where(level > 0, table.meshes.error[asset, level], 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        pixels = np.where(metres > 0, metres * view.detail_pixels / nearest, 0.0)
        return np.nan_to_num(np.where(pixels > 0, pixels / allowed, 0.0))


def legend(show: HowDrawn) -> tuple[tuple[str, Colour], ...]:
    """Return texts and colours that explain what `object_colours` shows, in a fixed order."""
    if show == "representation":
        return (
            ("impostor", _IMPOSTOR),
            ("mesh", _MESH),
            ("simplified", _SIMPLIFIED),
            ("clusters", _BY_CLUSTERS),
            ("dmesh", _STRAIGHT),
            ("height field", _HEIGHT_FIELD),
            ("captured view", _CAPTURED),
        )
    if show == "level":
        last = len(_LEVELS) - 1
        return (
            *((f"{k}+" if k == last else f"{k}", colour) for k, colour in enumerate(_LEVELS)),
            ("no levels", _WITHOUT),
        )
    if show == "case":
        texts = ("side", "side + top", "side + bottom", "all")
        return (*zip(texts, _CASES, strict=True), ("polygons", _WITHOUT))
    return (*zip(("0", "half", "all that is allowed"), _ERRORS, strict=True), ("not known", _WITHOUT))


def _of(palette: tuple[Colour, ...], numbers: Rows) -> Array:
    """Return the colours (n, 3) of n numbers, from 0; what is beyond the palette has its last colour."""
    return np.array(palette)[np.minimum(numbers.astype(np.int64), len(palette) - 1)]


def _error_colours(error: Array) -> Array:
    """Return the colours (n, 3) of n reprojection errors, 1 where they are as large as allowed."""
    steps = np.linspace(0, 1, len(_ERRORS))
    return np.stack([np.interp(error, steps, channel) for channel in np.array(_ERRORS).T], -1)
