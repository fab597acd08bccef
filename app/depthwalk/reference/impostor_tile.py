"""Resample impostor tiles, as the twin of the shaders in shaders/composite that do so where texels are not pixels.

A tile stores 1 − nearest·λ/w of each texel, which grows with the distance, and 1 where it is empty. It is found at a
point between texels (partial_coverage.glsl) which of them make up one surface; cracks in that are closed (cracks.glsl).
Where the viewer has moved since the tile was warped, that point is searched for along the ray (parallax.glsl).
"""

from dataclasses import dataclass

import numpy as np

from depthwalk.types import Array, Ints, Mask

MAX_SLOPE = 8.0  # pixels that one surface may recede by from a texel to the next
_STEEP = 0.3  # of the depths that one surface may span from texel to texel
_TIE = 1e-3  # between weights that are the same but for rounding
_CORNERS = np.array([(0, 1), (1, 1), (1, 0), (0, 0)])  # right and up from the low texel, in the order of textureGather


@dataclass(frozen=True, kw_only=True)
class Tile:
    """Hold what one impostor tile stores, and how it is resampled.

    Attributes
    ----------
    depth
        (H, W) stored depths, 0 at the nearest point and 1 where the tile is empty; row 0 at the bottom.
    pixel_angle
        Of a pixel of the picture, radians.
    single
        Whether the tile shows one object only. Empty texels between two objects are no crack.
    partial
        Whether texels are half a pixel wide, and the uncovered part of pixels is found.
    """

    depth: Array
    pixel_angle: float
    single: bool = True
    partial: bool = False

    def tolerance(self, stored: Array) -> Array:
        """Return by how much a stored depth may differ from `stored`, of any shape, if it continues the surface."""
        return MAX_SLOPE * self.pixel_angle * (1 - stored)

    def stored(self, texel: Ints) -> Array:
        """Return the stored depths (…,) of texels (…, 2), column and row; of those outside, of the nearest ones."""
        height, width = self.depth.shape
        return np.asarray(self.depth[texel[..., 1].clip(0, height - 1), texel[..., 0].clip(0, width - 1)])


@dataclass(frozen=True, kw_only=True)
class TileSurface:
    """Hold what n points of a tile show.

    Attributes
    ----------
    stored
        (n,) stored depth of the surface; 1 where there is none.
    owner
        (n, 2) column and row of the texel that says which object and image is seen; meaningless where `stored` is 1.
    uncovered
        (n,) part of the pixel that shows what is behind the surface, 0 to 1; 0 unless the tile is `partial`.
    aside
        (n, 2) right and up from the pixel's middle to where the surface has that depth, pixels.
    """

    stored: Array
    owner: Ints
    uncovered: Array
    aside: Array


def surface_at(tile: Tile, texel: Array) -> TileSurface:
    """Return what `tile` shows at points (n, 2), columns and rows; the middle of the first texel is at (½, ½)."""
    height, width = tile.depth.shape
    position = texel.clip(0.5, np.array([width, height]) - 0.5) - 0.5
    low = np.floor(position).astype(int)
    part = position - low
    weight = np.prod(np.where(_CORNERS == 1, part[:, None], 1 - part[:, None]), -1)  # (n, 4)
    depth = np.where(weight == 0, 1.0, tile.stored(low[:, None] + _CORNERS))
    weight = weight * (depth < 1)
    if tile.partial:
        front = depth.min(1)
        covered, high = front < 1, np.minimum(low + 1, np.array([width, height]) - 1)
        weight = weight * (depth - front[:, None] <= tile.tolerance(front)[:, None])
    else:
        covered, high = weight.sum(1) >= 0.5, np.floor(position + 0.5).astype(int)
    owner, own = _owners(depth, weight)
    with np.errstate(invalid="ignore", divide="ignore"):  # where nothing covers
        stored, uncovered, aside = _between(tile, depth, weight, own, part, owner)
    closed, beyond = across_cracks(tile, low if tile.partial else high, high)
    if not (tile.partial or tile.single):
        closed = np.ones_like(closed)
    return TileSurface(
        stored=np.where(covered, stored, closed),
        owner=np.where(covered[:, None], low + owner, beyond),
        uncovered=np.where(covered, uncovered, 0.0),
        aside=np.where(covered[:, None], aside, 0.0),
    )


def across_cracks(tile: Tile, low: Ints, high: Ints) -> tuple[Array, Ints]:
    """Look across empty texels for the two ends of one surface, of which they are a crack.

    Parameters
    ----------
    tile
        The tile.
    low, high
        (n, 2) columns and rows of the first and last empty texels, which are the same or, each in its row and column,
        beside each other.

    Returns
    -------
    stored : Array
        (n,) the farther of the stored depths beyond them, across or along, whichever is nearer; 1 where there is no
        crack.
    owner : Ints
        (n, 2) the texel that has this depth.
    """
    ends, depths = [], []
    for axis in (0, 1):
        step = np.eye(2, dtype=int)[axis]
        before, after = tile.stored(low - step), tile.stored(high + step)
        farther = np.maximum(before, after)
        inside = (low[:, axis] >= 1) & (high[:, axis] + 2 <= tile.depth.shape[1 - axis])
        one = inside & (np.abs(before - after) <= tile.tolerance(farther))
        depths.append(np.where(one, farther, 1.0))
        ends.append(np.where((before > after)[:, None], low - step, high + step))
    first = depths[0] <= depths[1]
    return np.where(first, *depths), np.where(first[:, None], *ends)


def surface_texels(
    tile: Tile, near: Array, far: Array, *, nearest: float, middle: float, moved: Mask, steps: int
) -> Array:
    """Search along present rays for the texels of a tile that was warped for a viewer elsewhere.

    Of the points on a ray, the one with λ was seen at the texel far + λ (near − far), homogeneous. A step takes λ from
    the texel where the last one led.

    Parameters
    ----------
    tile
        The tile.
    near, far
        (n, 3) homogeneous texels from the tile's corner: of the ray's point on the plane (λ = 1), and at infinity.
    nearest
        The least w / λ of the tile.
    middle
        λ in the middle of the object, where the search begins.
    moved
        (n,) whether the viewer is no longer where the tile was warped for; else the first texel is the one.
    steps
        Of the search.

    Returns
    -------
    Array
        (n, 3) homogeneous texels.
    """
    at = far + middle * (near - far)
    for _ in range(steps):
        last = np.array(tile.depth.shape[::-1]) - 1.0
        stored = tile.stored((at[:, :2] / at[:, 2:]).clip(0, last).astype(int))
        lam = (1 - stored) * at[:, 2] / nearest
        at = np.where((moved & (stored < 1))[:, None], far + lam[:, None] * (near - far), at)
    return at


def _owners(depth: Array, weight: Array) -> tuple[Ints, Array]:
    """Return the place (n, 2) of the heaviest of four texels, right and up from the low one, and its stored depth."""
    left, along = np.maximum(weight[:, 0], weight[:, 3]), np.maximum(weight[:, 1], weight[:, 2])
    right = (along > left - _TIE) & (along > 0)
    top, bottom = np.where(right, weight[:, 1], weight[:, 0]), np.where(right, weight[:, 2], weight[:, 3])
    upper = (top > bottom - _TIE) & (top > 0)
    corner = np.where(right, np.where(upper, 1, 2), np.where(upper, 0, 3))
    return _CORNERS[corner], np.take_along_axis(depth, corner[:, None], 1)[:, 0]


def _between(
    tile: Tile, depth: Array, weight: Array, own: Array, part: Array, owner: Ints
) -> tuple[Array, Array, Array]:
    """Return what four texels show of the surface of the one at `owner`: stored depth, uncovered part, place aside.

    The mean of depths lies on a surface that is flat between them. Of a steep one it may be far off: one texel counts.
    """
    weight = weight * (np.abs(depth - own[:, None]) <= tile.tolerance(own)[:, None])
    total = weight.sum(1)
    mean = (weight * depth).sum(1) / total
    if not tile.partial:
        return mean, np.zeros_like(total), np.zeros_like(part)
    uncovered, centre = 1 - total, weight @ _CORNERS / total[:, None]
    steep = (np.abs(depth - own[:, None]) * (weight > 0)).max(1) > _STEEP * tile.tolerance(own)
    centre = np.where(steep[:, None], owner, np.where((uncovered > 0)[:, None], centre, part))
    return np.where(steep, own, mean), uncovered, 0.5 * (centre - part)  # texels are half a pixel wide
