"""Gather depth of field along rays through the depth buffer, as the twin of render/lens_gather.py and shaders/dof.

`gather` traces rays (Lee, Eisemann and Seidel 2010, "Real-Time Lens Blur Effects and Focus Control"), in reduced
pictures where circles are wide; `reference.dof_tiles` says where that is. `reference.dof_paper` has the other method.

Pictures are (H, W, 4) linear, premultiplied. Circles of confusion are (H, W) radii in pixels, negative before the
focus. Row 0 is at the bottom, as the shaders have it.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from depthwalk.reference.dof_tiles import Reduced, ranges, reduced, tile_classes
from depthwalk.render.view.lens import (
    ALL_EVEN,
    EVEN_RAYS,
    GOLDEN_ANGLE,
    HIDDEN_WEIGHT,
    HIGHEST_MIP,
    LARGEST_BLOCK,
    LEAST_HALF,
    LINEAR_BLUR,
    MIN_RAYS,
    MIP_RADIUS,
    NEARLY,
    RAY_DENSITY,
    RAY_STRIDE,
    REDUCED_RAYS,
    SHARP_RADIUS,
    TILE,
    TileClass,
)
from depthwalk.types import Array

_Pixels = NDArray[np.intp]


def gather(
    lit: Array,
    circles: Array,
    samples: int,
    tile: int = TILE,
    passed_on: Callable[[Array], Array] = np.asarray,
) -> Array:
    """Return the picture taken by a lens: each pixel is the mean of what rays from all over the lens hit.

    Where circles are wide, rays are traced in a picture of half or a quarter of the size, which is then magnified.

    Parameters
    ----------
    lit
        (H, W, 4) linear, premultiplied picture in which everything is sharp.
    circles
        (H, W) radii, pixels, negative before the focus.
    samples
        Most rays per pixel.
    tile
        Edge of a tile whose circles are found together, pixels.
    passed_on
        Applies the later passes to colours (…, 4), before reduced pictures are magnified; by default the identity.

    Returns
    -------
    Array
        (H, W, 4) linear, premultiplied, passed on; pixels whose surroundings are sharp are those of `lit`.
    """
    whole = Reduced(block=1, lit=np.asarray(lit, float), circles=circles, least=circles, greatest=circles)
    half = reduced(whole)
    quarter = reduced(half)
    classes, spread = tile_classes(quarter, tile), ranges(circles, tile)
    height, width = circles.shape

    def where(*wanted: TileClass) -> NDArray[np.bool_]:
        chosen = np.isin(classes, wanted).repeat(tile, 0).repeat(tile, 1)
        return np.asarray(chosen[:height, :width])

    out = np.array(passed_on(whole.lit))
    shown = [
        (quarter, TileClass.QUARTER_EVEN, TileClass.QUARTER),
        (half, TileClass.HALF_EVEN, TileClass.HALF),
    ]
    all_even = where(*(tile_class for tile_class in TileClass if tile_class & ALL_EVEN))
    for picture, even, traced in shown:
        seen, large = _gathered(picture, all_even, spread, samples)
        seen = passed_on(seen)
        magnified = where(even, traced)
        out[magnified] = _magnified(seen, np.ones(large.shape, bool), picture.block, (height, width))[0][magnified]
    mixed = where(TileClass.MIXED)
    near = np.maximum(-spread[0], circles) >= SHARP_RADIUS
    value, covered = _magnified(seen, large, half.block, (height, width))
    from_half = mixed & near & (np.abs(circles) >= LEAST_HALF) & covered
    out[from_half] = value[from_half]
    rays = mixed & near & ~from_half
    radius = np.maximum(-spread[0], circles)
    out[rays] = passed_on(_traced(whole, rays, spread, _counts(radius, samples)[rays]))
    level = where(TileClass.EVEN) & (np.abs(circles) >= SHARP_RADIUS)
    reach = np.sqrt(np.maximum(circles**2 - LINEAR_BLUR, 0.25 * circles**2))
    out[level] = passed_on(_averaged(whole.lit, level, reach[level], _counts(circles, samples)[level]))
    return out


def _counts(radius: Array, samples: int) -> NDArray[np.intp]:
    """Return how many rays a pixel of the whole picture sends, given the `radius` that they reach, pixels."""
    return np.asarray(np.clip((RAY_DENSITY * radius**2).astype(int), min(MIN_RAYS, samples), samples), np.intp)


def _gathered(
    picture: Reduced, even: NDArray[np.bool_], spread: Array, samples: int
) -> tuple[Array, NDArray[np.bool_]]:
    """Return what reduced.frag draws (h, w, 4), and which of its pixels have wide circles (h, w); others are 0.

    `even` (H, W): pixels of the whole picture in tiles where no ray is traced. `spread`: the result of `ranges`.
    """
    block = picture.block
    own = picture.circles / block
    wide = np.abs(picture.circles) >= NEARLY * LEAST_HALF
    flat = even[::block, ::block] & wide
    out = np.zeros_like(picture.lit)
    traced = wide & ~flat
    counts = np.full(int(traced.sum()), min(REDUCED_RAYS, samples))
    out[traced] = _traced(picture, traced, spread[:, ::block, ::block] / block, counts)
    highest = HIGHEST_MIP if block == LARGEST_BLOCK else 0
    level = np.clip(np.floor(np.log2(np.maximum(np.abs(own), 1e-9) / MIP_RADIUS) + 1), 0, highest)
    reach = np.sqrt(np.maximum(own**2 - LINEAR_BLUR - 4**level, 0.25 * own**2))
    mip = picture.lit
    for number in range(highest + 1):
        chosen = flat & (level == number)
        counts = np.full(int(chosen.sum()), min(EVEN_RAYS, samples))
        out[chosen] = _averaged(mip, chosen, reach[chosen], counts)
        rows, columns = (max(size // 2, 1) * 2 for size in mip.shape[:2])
        mip = np.pad(mip, [(0, 1), (0, 1), (0, 0)], mode="edge")[:rows, :columns]
        mip = mip.reshape(rows // 2, 2, columns // 2, 2, 4).mean((1, 3))
    return out, wide


def _averaged(lit: Array, where: NDArray[np.bool_], reach: Array, count: NDArray[np.intp]) -> Array:
    """Return the means (n, 4) over discs about the pixels selected by `where` (h, w), with `count` (n,) points each.

    `reach` (n,) are the radii, pixels of `where`. `lit` (h', w', 4) may be smaller.
    """
    y, x = (at + 0.5 for at in np.nonzero(where))
    scale = [small / whole for small, whole in zip(lit.shape, where.shape, strict=False)]
    out = np.zeros((len(y), 4))
    for ray in range(int(count.max(initial=0))):
        rows = np.flatnonzero(ray < count)
        offset = (reach[rows] * np.sqrt((ray + 0.5) / count[rows]))[:, None] * _direction(ray)
        at = [(y[rows] + offset[:, 1]) * scale[0] - 0.5, (x[rows] + offset[:, 0]) * scale[1] - 0.5]
        out[rows] += _interpolated(lit, np.stack(at)) / count[rows, None]
    return out


def _traced(picture: Reduced, where: NDArray[np.bool_], spread: Array, count: NDArray[np.intp]) -> Array:
    """Return the mean (n, 4) of what `count` (n,) rays from each of the pixels `where` (h, w) hit.

    `spread` (2, h, w) is the range of circles that they are traced through, pixels of `picture`.
    """
    y, x = np.nonzero(where)
    circles = picture.circles / picture.block
    own, (low, high) = circles[y, x], spread[:, y, x]
    out, total = np.zeros((len(y), 4)), np.zeros(len(y))
    for ray in range(int(count.max(initial=0))):
        rows = np.flatnonzero(ray < count)
        lens = np.sqrt((ray + 0.5) / count[rows])[:, None] * _direction(ray)
        ends, weight = _ray_ends(circles, (x[rows], y[rows]), lens, own[rows], low[rows], high[rows])
        out[rows] += weight[:, None] * _interpolated(picture.lit, ends)
        total[rows] += weight
    return out / np.maximum(total, 1e-12)[:, None]


def _direction(ray: int) -> list[float]:
    return [float(np.cos(ray * GOLDEN_ANGLE)), float(np.sin(ray * GOLDEN_ANGLE))]


def _interpolated(lit: Array, at: Array) -> Array:
    """Return `lit` (h, w, 4) between its pixels, at y and x of `at` (2, n), as (n, 4)."""
    return np.stack([map_coordinates(channel, at, order=1, mode="nearest") for channel in np.moveaxis(lit, 2, 0)], -1)


def _magnified(
    lit: Array, usable: NDArray[np.bool_], block: int, size: tuple[int, int]
) -> tuple[Array, NDArray[np.bool_]]:
    """Return a reduced picture magnified to `size` (H, W) from its `usable` pixels (h, w), and where there are any."""
    y, x = ((np.arange(length) + 0.5) / block - 0.5 for length in size)
    at = np.stack(np.meshgrid(y, x, indexing="ij")).reshape(2, -1)
    masked = np.concatenate([np.where(usable[..., None], lit, 0), usable[..., None].astype(float)], -1)
    value = _interpolated(masked, at).reshape(*size, 5)
    covered = value[..., 4] > 0.01
    return value[..., :4] / np.where(covered, value[..., 4], 1)[..., None], covered


def _ray_ends(
    circles: Array, pixel: tuple[_Pixels, _Pixels], lens: Array, own: Array, low: Array, high: Array
) -> tuple[Array, Array]:
    """Trace one ray per pixel through the depth buffer and return where it ends.

    Parameters
    ----------
    circles
        (H, W) radii, pixels.
    pixel
        x (n,) and y (n,) of the pixels.
    lens
        (n, 2) points of the unit disc that the rays go to.
    own
        (n,) circles at the pixels.
    low, high
        (n,) results of `ranges` at the pixels.

    Returns
    -------
    tuple[Array, Array]
        (2, n) y and x, in which whole numbers are the pixels' centres, and (n,) the weight of each ray.
    """
    last_pixel = circles.shape[1] - 1, circles.shape[0] - 1

    def beside(circle: Array) -> tuple[_Pixels, _Pixels]:
        moved = [at + np.floor(circle * lens[:, k] + 0.5).astype(int) for k, at in enumerate(pixel)]
        x, y = (np.clip(at, 0, end) for at, end in zip(moved, last_pixel, strict=True))
        return x, y

    stride = RAY_STRIDE / np.maximum(np.linalg.norm(lens, axis=1), 0.05)
    before, after = np.ceil((own - low) / stride), np.ceil((high - own) / stride)
    end = np.stack(pixel[::-1]).astype(float)
    last, deepest = np.full(len(own), -np.inf), own + 2 * SHARP_RADIUS
    weight = np.full(len(own), HIDDEN_WEIGHT)
    done = np.zeros(len(own), bool)
    for step in range(int((before + after).max(initial=0)) + 1):
        k = step - before
        part = np.where(k < 0, (own - low) * k / np.maximum(before, 1), (high - own) * k / np.maximum(after, 1))
        running = ~done & (k <= after)
        x, y = beside(own + part)
        found = circles[y, x]
        met_x, met_y = beside(found)
        met = running & (found <= own + part + SHARP_RADIUS) & (found >= last - SHARP_RADIUS)
        met &= np.abs(circles[met_y, met_x] - found) <= 2 * SHARP_RADIUS
        deeper = running & ~met & (found > deepest)
        moved = np.stack(pixel[::-1]) + found * lens[:, ::-1].T
        met_at = np.stack([met_y, met_x]) * 1.0
        met_at += np.clip(np.abs(found) / SHARP_RADIUS - 1, 0, 1) * (moved - met_at)
        end = np.select([met, deeper], [met_at, np.stack([y, x])], end)
        weight[met | deeper] = 1
        deepest = np.where(deeper, found, deepest)
        last = np.where(running, own + part, last)
        done |= met
    return end, weight
