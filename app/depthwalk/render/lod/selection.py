"""Choose levels of detail by their geometric error, and by how many triangles a pixel may cost.

The paper's own rule, by distance alone, is in `render.lod.paper_lod`.
"""

import numpy as np

from depthwalk.render.view.view import View
from depthwalk.scene.object_settings import LodParams
from depthwalk.types import Array, Ints, Rows

USUAL_COSINE = 0.5
"""Cosine of the angle off the view axis that usual pictures do not exceed: 60°. A picture of 16 : 9 reaches that far
with a vertical field of view of 80°. Up to there mip levels are chosen as in the middle of the picture."""

STRETCHED_COSINE = 0.71
"""Cosine of the angle off the axis, 45°, from which wider pictures have finer geometry than in the middle. From 60° on
only, columns there were visibly bent."""


def stretch(view: View, centre: Array) -> Array:
    """Return how much longer objects appear beyond `STRETCHED_COSINE` than there, toward the border of a wide picture.

    A perspective picture shows a short radial length at an angle θ off its axis 1/cos² θ times as long as in the middle
    at the same distance from the viewer. In usual pictures that is left out, since it is 2 at most corners and would
    cost detail that nobody misses; at a field of view of 150° it is 40.

    Parameters
    ----------
    view : the view of the picture.
    centre : (n, 3) the middles of objects, metres, world.

    Returns
    -------
    (n,) factors, 1 or more; at most that of the picture's corner, also for objects beside and behind the viewer.
    """
    if (corner := view.corner_cosine) >= USUAL_COSINE:
        return np.ones(len(centre))
    away = centre - view.position
    cosine = away @ view.axes[2] / np.maximum(np.linalg.norm(away, axis=1), 1e-9)
    return np.asarray((STRETCHED_COSINE / np.clip(cosine, corner, STRETCHED_COSINE)) ** 2)


def greatest_stretch(view: View) -> float:
    """Return how much longer objects appear in a picture's corner than at `USUAL_COSINE`: 1 for usual pictures."""
    return max(1.0, USUAL_COSINE / view.corner_cosine) ** 2


def error_at_a_metre(view: View, lod: LodParams) -> float:
    """Return the geometric error that is allowed at a distance of one metre from the viewer.

    Multiplied by an object's distance in metres this is the geometric error that `lod.error` pixels allow for it.

    Parameters
    ----------
    view : the view of the picture.
    lod : the settings of detail.

    Returns
    -------
    Metres.
    """
    return lod.allowed_error / view.detail_pixels


def error_level(error: Array, allowed: Array) -> Ints:
    """Return the coarsest level that is accurate enough; the finest, 0, where none is.

    Parameters
    ----------
    error : (n, levels) geometric error, metres, rising with the level; +inf where there is no such level.
    allowed : (n,) the error that each object may have, metres.

    Returns
    -------
    (n,) levels, 0 the finest.
    """
    return np.asarray((error[:, 1:] <= allowed[:, None]).sum(1))


def affordable_level(triangles: Rows, pixels: Array, per_pixel: float) -> Ints:
    """Return the finest level that has few enough triangles for the pixels that its object covers.

    A bound on the geometric error alone does not limit this: foliage has many triangles per texel at any error.

    Parameters
    ----------
    triangles : (n, levels) number of triangles, falling with the level.
    pixels : (n,) how many pixels each object covers.
    per_pixel : how many triangles there may be for each pixel.

    Returns
    -------
    (n,) levels, 0 the finest; beyond the coarsest level where even that has too many.
    """
    return np.asarray((triangles > per_pixel * pixels[:, None]).sum(1))


def levels_within(triangles: Rows, level: Rows, coarsest: Rows, most: int) -> Rows:
    """Return coarser levels, so that objects together have few enough triangles.

    Objects become coarser by one level, beginning with the last, until they fit; then by another. If they are sorted
    nearest first, those that cover most pixels keep the finer level.

    Parameters
    ----------
    triangles : (n, levels) number of triangles, falling with the level.
    level : (n,) the level that each object should have.
    coarsest : (n,) the coarsest level of each.
    most : how many triangles they may have together.

    Returns
    -------
    (n,) levels, 0 the finest; the coarsest where even these have too many.
    """
    rows, coarser = np.arange(len(level)), np.array(level)
    while (excess := triangles[rows, coarser].sum() - most) > 0 and (coarser < coarsest).any():
        following = np.minimum(coarser + 1, coarsest)
        saved = np.cumsum((triangles[rows, coarser] - triangles[rows, following])[::-1])
        changed = rows[::-1][: np.searchsorted(saved, excess) + 1]
        coarser[changed] = following[changed]
    return coarser
