"""Level of detail and case per object: Liu et al. 2007, §3.3 (cases) and §3.5 (Iter_step)."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import Case
from depthwalk.render.view.view import View
from depthwalk.scene.render_settings import LodParams
from depthwalk.types import Array


def paper_cases(viewer: Array, bottom: Array, top: Array) -> NDArray[np.intp]:
    """The paper's Case (n,) of viewers (n, 3) beside, above or below cylinders from `bottom` to `top` (n,)."""
    above, below = viewer[:, 1] > top, viewer[:, 1] < bottom
    return np.where(above, Case.SIDE_AND_TOP, np.where(below, Case.SIDE_AND_BOTTOM, Case.SIDE))


def iter_step(distance: Array, texel: Array, tan_half_fov: float, screen_height: int) -> Array:
    """Source texels per target pixel along one axis (n,), at least 1.

    A = (2·D·tan(fov/2) / (H·texel))² source texels lie under a pixel at distance D; Iter_step = max(1, √A).
    distance, texel: (n,) metres, world.
    """
    return np.maximum(1.0, 2 * distance * tan_half_fov / (screen_height * texel))


def grid_level(step: Array, bias: float, max_level: NDArray[np.integer]) -> NDArray[np.int64]:
    """The grid (n,) to draw: the coarsest whose step 2^level does not exceed Iter_step, moved by `bias` levels."""
    level = np.floor(np.log2(step) + bias + 1e-9)
    return np.clip(level, 0, max_level).astype(np.int64)


def error_at_a_metre(view: View, lod: LodParams) -> float:
    """By how much the geometry that is chosen for it may be off at one metre from the viewer, metres."""
    return lod.error * 2**lod.bias / view.focal_pixels


def error_level(error: Array, allowed: Array) -> NDArray[np.int64]:
    """The coarsest level (n,) whose error, metres (n, levels), rising, is at most `allowed` (n,); else the finest."""
    return (error[:, 1:] <= allowed[:, None]).sum(1)


def affordable_level(triangles: NDArray[np.integer], pixels: Array, per_pixel: float) -> NDArray[np.int64]:
    """The finest grid (n,) with at most `per_pixel` triangles for each of the object's `pixels` (n,).

    Iter_step knows texels, not what is in them: the borders of foliage make many triangles in one texel.
    triangles: (n, levels), falling.
    """
    return (triangles > per_pixel * pixels[:, None]).sum(1)
