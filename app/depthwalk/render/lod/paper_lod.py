"""Choose levels of detail and depth images by the paper's rules: Liu et al. 2007, §3.3 (cases) and §3.5 (Iter_step).

These are the baselines that `lod.mode: paper` and `lod.cases: paper`, `side` and `cap` choose; `iter_step` also
describes any frame in the HUD. The renderer's own rules are in `render.lod.selection`.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import BOTTOM_PIECE, PAPER_PIECES, TOP_PIECE, Case
from depthwalk.types import Array, Ints, Rows

_TOP, _BOTTOM = 1 << TOP_PIECE, 1 << BOTTOM_PIECE
# What is drawn in each `Case`, as bit masks of index ranges, by the name in `lod.cases`: the images of the paper's
# case, or its side or its cap alone, as figure 12 shows them.
CASE_PIECES = {
    "paper": PAPER_PIECES,
    "side": np.full(len(Case), PAPER_PIECES[Case.SIDE]),
    "cap": np.array([0, _TOP, _BOTTOM, _TOP | _BOTTOM]),
}


def paper_cases(viewer: Array, bottom: Array, top: Array) -> NDArray[np.intp]:
    """Return the paper's case for viewers beside, above or below cylinders.

    Parameters
    ----------
    viewer : (n, 3) the viewer in the frames of the objects, metres.
    bottom : (n,) height of the lower ends of the cylinders, metres.
    top : (n,) height of the upper ends of the cylinders, metres.

    Returns
    -------
    (n,) `Case` of each viewer.
    """
    above, below = viewer[:, 1] > top, viewer[:, 1] < bottom
    return np.where(above, Case.SIDE_AND_TOP, np.where(below, Case.SIDE_AND_BOTTOM, Case.SIDE))


def iter_step(distance: Array, texel: Array, tan_half_fov: float, screen_height: int) -> Array:
    """Return the paper's Iter_step: source texels per target pixel along one axis, at least 1.

    A = (2·D·tan(fov/2) / (H·texel))² source texels lie under a pixel at distance D; Iter_step = max(1, √A).

    Parameters
    ----------
    distance : (n,) D, distance from the viewer to the objects, metres.
    texel : (n,) edge of a source texel, metres, world.
    tan_half_fov : tangent of half the vertical angle of view.
    screen_height : H, height of the picture, pixels.

    Returns
    -------
    (n,) Iter_step.
    """
    return np.maximum(1.0, 2 * distance * tan_half_fov / (screen_height * texel))


def paper_level(step: Array, bias: float, max_level: Rows) -> Ints:
    """Return the coarsest grid level whose step 2^level does not exceed Iter_step, moved by `bias` levels.

    Parameters
    ----------
    step : (n,) Iter_step.
    bias : how many levels coarser to draw; negative numbers are finer.
    max_level : (n,) coarsest level of each object.

    Returns
    -------
    (n,) levels, 0 the finest.
    """
    level = np.floor(np.log2(step) + bias + 1e-9)
    return np.clip(level, 0, max_level).astype(np.int64)
