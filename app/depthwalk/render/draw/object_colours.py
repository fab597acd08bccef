"""Choose false colours that tell how a frame drew each of its objects, for the pass `inspection`.

All colours are sRGB, 0 to 1. `legend` explains them, and docs/walking.md shows pictures of them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import drawn_cases
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.scene.arrays import HEIGHT_FIELDS, Representation
from depthwalk.scene.effect_settings import HowDrawn
from depthwalk.types import Array, Rows

Colour = tuple[float, float, float]

COLOUR_RECORD = np.dtype([("colour", "4f4")])  # sRGB; the fourth component is not used
GROUND_COLOUR = np.array((0.33, 0.33, 0.33))
_WITHOUT: Colour = (0.62, 0.62, 0.62)  # what has neither level, case nor error
_IMPOSTOR: Colour = (0.30, 0.55, 1.00)
_STRAIGHT: Colour = (0.21, 0.77, 0.71)
_POLYGONS: Colour = (0.96, 0.60, 0.24)
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
    records : (1 + d,) COLOUR_RECORD by an object's number in the visibility buffer; number 0 stands for all polygons.
    captured : the colour of all captured views.
    """

    records: NDArray[np.void]
    captured: Colour


def object_colours(plan: FrameDrawLists, show: HowDrawn) -> ObjectColours:
    """Return the colours of all objects of a frame.

    Parameters
    ----------
    plan : the draw lists of the whole frame.
    show : what the colours tell.
    """
    records = np.zeros(1 + len(plan.object_rows), COLOUR_RECORD)
    colour = records["colour"][:, :3]
    colour[:] = _WITHOUT
    drawn_as, straight = plan.drawn_as, plan.drawn_as == Representation.DMESH
    tiles, batches = plan.tiles.of_objects(), plan.dmesh.batches
    count = np.array([batch.count for batch in batches], np.int64)
    if show == "representation":
        colour[0] = _POLYGONS
        colour[1:][plan.tiled] = _IMPOSTOR
        colour[1:][straight] = _STRAIGHT
        colour[1:][np.isin(drawn_as, HEIGHT_FIELDS)] = _HEIGHT_FIELD
        return ObjectColours(records=records, captured=_CAPTURED)
    if show == "level":
        colour[1:][plan.tiled] = _of(_LEVELS, tiles.level)
        colour[1:][straight] = _of(_LEVELS, np.repeat(np.array([batch.level for batch in batches], np.int64), count))
    elif show == "case":
        colour[1:][plan.tiled] = _of(_CASES, drawn_cases(tiles.pieces))
        pieces = np.repeat(np.array([batch.pieces for batch in batches], np.int64), count)
        colour[1:][straight] = _of(_CASES, drawn_cases(pieces))
    else:
        colour[1:][plan.tiled] = _error_colours(tiles.error)
    return ObjectColours(records=records, captured=_WITHOUT)


def legend(show: HowDrawn) -> tuple[tuple[str, Colour], ...]:
    """Return texts and colours that explain what `object_colours` shows, in a fixed order."""
    if show == "representation":
        return (
            ("impostor", _IMPOSTOR),
            ("polygons", _POLYGONS),
            ("dmesh", _STRAIGHT),
            ("height field", _HEIGHT_FIELD),
            ("captured view", _CAPTURED),
        )
    if show == "level":
        last = len(_LEVELS) - 1
        return (
            *((f"{k}+" if k == last else f"{k}", colour) for k, colour in enumerate(_LEVELS)),
            ("polygons", _WITHOUT),
        )
    if show == "case":
        texts = ("side", "side + top", "side + bottom", "all")
        return (*zip(texts, _CASES, strict=True), ("polygons", _WITHOUT))
    return (*zip(("0", "half", "all that is allowed"), _ERRORS, strict=True), ("no impostor", _WITHOUT))


def _of(palette: tuple[Colour, ...], numbers: Rows) -> Array:
    """Return the colours (n, 3) of n numbers, from 0; what is beyond the palette has its last colour."""
    return np.array(palette)[np.minimum(numbers.astype(np.int64), len(palette) - 1)]


def _error_colours(error: Array) -> Array:
    """Return the colours (n, 3) of n reprojection errors, 1 where they are as large as allowed."""
    steps = np.linspace(0, 1, len(_ERRORS))
    return np.stack([np.interp(error, steps, channel) for channel in np.array(_ERRORS).T], -1)
