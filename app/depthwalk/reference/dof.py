"""Compute depth of field, as the twin of shaders/dof.

`gather` mirrors render/lens_gather.py: rays through the depth buffer (Lee, Eisemann and Seidel 2010, "Real-Time Lens
Blur Effects and Focus Control"), in reduced pictures where circles are wide; `ranges` mirrors tiles.frag and
spread.frag, which bound the circles of confusion near a pixel (McGuire et al. 2012, "A Reconstruction Filter for
Plausible Motion Blur"); `paper` mirrors blur.frag and
paper.frag (Huang et al. 2008, §2.2 and §2.3).

Pictures are (H, W, 4) linear, premultiplied. Circles of confusion are (H, W) radii in pixels, negative before the
focus. Row 0 is at the bottom, as the shaders have it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from depthwalk.render.view.lens import (
    EVEN,
    EVEN_RAYS,
    GAUSSIAN_RADIUS,
    GOLDEN_ANGLE,
    HIDDEN_WEIGHT,
    HIGHEST_MIP,
    LEAST_HALF,
    LEAST_QUARTER,
    LEAST_STEP,
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


def ranges(circles: Array, tile: int) -> Array:
    """Return the least and the greatest circle of confusion that may reach into each pixel's tile.

    The two bound the part of the depth buffer through which `gather` traces its rays. The picture is divided into
    square tiles. A tile counts its own circles, and those of other tiles that are larger than the gap between the two.

    Parameters
    ----------
    circles
        (H, W) radii, pixels, negative before the focus.
    tile
        Edge of a tile, pixels.

    Returns
    -------
    Array
        (2, H, W) radii, pixels, with their signs: the least, and the greatest.
    """
    height, width = circles.shape
    rows, columns = np.arange(0, height, tile), np.arange(0, width, tile)
    extremes = np.stack([cut.reduceat(cut.reduceat(circles, rows, 0), columns, 1) for cut in (np.minimum, np.maximum)])
    y, x = (grid.ravel() for grid in np.mgrid[: len(rows), : len(columns)])
    apart = np.maximum(np.abs(np.stack([y[:, None] - y, x[:, None] - x])) - 1, 0) * tile
    gap = np.hypot(*apart)  # (tiles, tiles)
    low, high = extremes.reshape(2, -1)
    own = np.eye(len(y), dtype=bool)
    least = np.where(own | (-low > gap), low, np.inf).min(1)
    greatest = np.where(own | (high > gap), high, -np.inf).max(1)
    spread = np.stack([least, greatest]).reshape(extremes.shape)
    return spread.repeat(tile, 1).repeat(tile, 2)[:, :height, :width]


@dataclass(frozen=True, kw_only=True)
class Reduced:
    """Hold a picture each of whose pixels stands for a square block of the whole picture's.

    Attributes
    ----------
    block
        Pixels of the whole picture along one of its pixels.
    lit
        (h, w, 4) linear, premultiplied: the mean of the surface that covers most of a block.
    circles
        (h, w) radii of that surface, pixels of the whole picture.
    least, greatest
        (h, w) the extremes of the circles in a block, pixels of the whole picture.
    """

    block: int
    lit: Array
    circles: Array
    least: Array
    greatest: Array


def reduced(picture: Reduced) -> Reduced:
    """Return `picture` at half of its width and height, rounded up; mirrors reduce.frag."""
    height, width = picture.circles.shape
    rows = [np.minimum(np.arange(0, height, 2) + k, height - 1) for k in (0, 1)]
    columns = [np.minimum(np.arange(0, width, 2) + k, width - 1) for k in (0, 1)]

    def blocks(image: Array) -> Array:
        return np.stack([image[np.ix_(y, x)] for y in rows for x in columns])

    found = blocks(picture.circles)
    middle = 0.5 * (found.min(0) + found.max(0))
    farther = found >= middle
    weight = (farther == (farther.sum(0) > 2)).astype(float)
    weight /= weight.sum(0)
    return Reduced(
        block=2 * picture.block,
        lit=(weight[..., None] * blocks(picture.lit)).sum(0),
        circles=(weight * found).sum(0),
        least=blocks(picture.least).min(0),
        greatest=blocks(picture.greatest).max(0),
    )


def tile_classes(quarter: Reduced, tile: int) -> NDArray[np.intp]:
    """Return the `TileClass` of each tile; mirrors tiles.frag, spread.frag and tile.vert.

    Parameters
    ----------
    quarter
        The picture at a quarter of its width and height.
    tile
        Edge of a tile, pixels of the whole picture.

    Returns
    -------
    NDArray[np.intp]
        (rows, columns) bits, row 0 at the bottom.
    """
    low, high = quarter.least, quarter.greatest
    least, greatest = low.copy(), high.copy()
    for axis in (0, 1):
        count = low.shape[axis]
        beside = np.minimum(np.arange(count) + 1, count - 1)
        least = np.minimum(least, low.take(beside, axis))
        greatest = np.maximum(greatest, high.take(beside, axis))
    side = tile // quarter.block
    starts = [np.arange(0, size, side) for size in low.shape]

    def of_tiles(cut: np.ufunc, image: Array) -> Array:
        return np.asarray(cut.reduceat(cut.reduceat(image, starts[0], 0), starts[1], 1))

    step = of_tiles(np.maximum, greatest - least).ravel()
    low, high = of_tiles(np.minimum, low), of_tiles(np.maximum, high)
    shape, (y, x) = low.shape, (grid.ravel() for grid in np.mgrid[: low.shape[0], : low.shape[1]])
    low, high = low.ravel(), high.ravel()
    gap = np.hypot(*(np.maximum(np.abs(np.stack([y[:, None] - y, x[:, None] - x])) - 1, 0) * tile))
    reach = np.maximum(-low, high)
    around = np.maximum(reach, reach[:, None]) >= gap
    own = np.eye(len(y), dtype=bool)
    nearest = np.where(own | (-low > gap), low, np.inf).min(1)
    farthest = np.where(own | (high > gap), high, -np.inf).max(1)
    smallest = np.maximum(np.where(around, low, np.inf).min(1), -np.where(around, high, -np.inf).max(1))
    smallest = np.maximum(smallest, 0)
    even = np.where(around, step, -np.inf).max(1) <= np.maximum(LEAST_STEP, EVEN * smallest)
    kinds = [
        (np.maximum(-nearest, farthest) < SHARP_RADIUS, TileClass.SHARP, TileClass.SHARP),
        (smallest >= LEAST_QUARTER, TileClass.QUARTER_EVEN, TileClass.QUARTER),
        (smallest >= LEAST_HALF, TileClass.HALF_EVEN, TileClass.HALF),
        (np.ones(len(y), bool), TileClass.EVEN, TileClass.MIXED),
    ]
    chosen = np.select([where for where, _, _ in kinds], [np.where(even, a, b) for _, a, b in kinds])
    return np.asarray(chosen.reshape(shape), np.intp)


def gather(lit: Array, circles: Array, samples: int, tile: int = TILE) -> Array:
    """Return the picture that a lens takes: each pixel is the mean of what rays from all over the lens meet.

    Where circles are wide, rays are traced in a picture of half or a quarter of the size, which is magnified.

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

    Returns
    -------
    Array
        (H, W, 4) linear, premultiplied; pixels whose surroundings are sharp are those of `lit`.
    """
    whole = Reduced(block=1, lit=np.asarray(lit, float), circles=circles, least=circles, greatest=circles)
    half = reduced(whole)
    quarter = reduced(half)
    classes, spread = tile_classes(quarter, tile), ranges(circles, tile)
    height, width = circles.shape

    def where(*wanted: TileClass) -> NDArray[np.bool_]:
        chosen = np.isin(classes, wanted).repeat(tile, 0).repeat(tile, 1)
        return np.asarray(chosen[:height, :width])

    out = np.array(lit, float)
    shown = [
        (quarter, TileClass.QUARTER_EVEN, TileClass.QUARTER),
        (half, TileClass.HALF_EVEN, TileClass.HALF),
    ]
    for picture, even, traced in shown:
        seen, large = _gathered(picture, where(even), spread, samples)
        magnified = where(even, traced)
        out[magnified] = _magnified(seen, np.ones(large.shape, bool), picture.block, (height, width))[0][magnified]
    mixed = where(TileClass.MIXED)
    near = np.maximum(-spread[0], circles) >= SHARP_RADIUS
    value, covered = _magnified(seen, large, half.block, (height, width))
    from_half = mixed & near & (np.abs(circles) >= LEAST_HALF) & covered
    out[from_half] = value[from_half]
    rays = mixed & near & ~from_half
    radius = np.maximum(-spread[0], circles)
    out[rays] = _traced(whole, rays, spread, _counts(radius, samples)[rays])
    level = where(TileClass.EVEN) & (np.abs(circles) >= SHARP_RADIUS)
    reach = np.sqrt(np.maximum(circles**2 - LINEAR_BLUR, 0.25 * circles**2))
    out[level] = _averaged(whole.lit, level, reach[level], _counts(circles, samples)[level])
    return out


def _counts(radius: Array, samples: int) -> NDArray[np.intp]:
    """Return how many rays a pixel of the whole picture sends, by the `radius` that they reach, pixels."""
    return np.asarray(np.clip((RAY_DENSITY * radius**2).astype(int), min(MIN_RAYS, samples), samples), np.intp)


def _gathered(
    picture: Reduced, even: NDArray[np.bool_], spread: Array, samples: int
) -> tuple[Array, NDArray[np.bool_]]:
    """Return what reduced.frag draws (h, w, 4), and which of its pixels have wide circles (h, w); others are 0.

    `even` (H, W): pixels of the whole picture in tiles where no ray is traced. `spread`: what `ranges` returns.
    """
    block = picture.block
    own = picture.circles / block
    wide = np.abs(picture.circles) >= NEARLY * LEAST_HALF
    flat = even[::block, ::block] & wide
    out = np.zeros_like(picture.lit)
    traced = wide & ~flat
    counts = np.full(int(traced.sum()), min(REDUCED_RAYS, samples))
    out[traced] = _traced(picture, traced, spread[:, ::block, ::block] / block, counts)
    level = np.clip(np.floor(np.log2(np.maximum(np.abs(own), 1e-9) / MIP_RADIUS) + 1), 0, HIGHEST_MIP)
    reach = np.sqrt(np.maximum(own**2 - LINEAR_BLUR - 4**level, 0.25 * own**2))
    mip = picture.lit
    for number in range(HIGHEST_MIP + 1):
        chosen = flat & (level == number)
        counts = np.full(int(chosen.sum()), min(EVEN_RAYS, samples))
        out[chosen] = _averaged(mip, chosen, reach[chosen], counts)
        rows, columns = (max(size // 2, 1) * 2 for size in mip.shape[:2])
        mip = np.pad(mip, [(0, 1), (0, 1), (0, 0)], mode="edge")[:rows, :columns]
        mip = mip.reshape(rows // 2, 2, columns // 2, 2, 4).mean((1, 3))
    return out, wide


def _averaged(lit: Array, where: NDArray[np.bool_], reach: Array, count: NDArray[np.intp]) -> Array:
    """Return the means (n, 4) over discs about the pixels that `where` (h, w) has, by `count` (n,) points each.

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
    """Return what `count` (n,) rays from each of the pixels `where` (h, w) has meet on average, (n, 4).

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
    return np.stack([map_coordinates(each, at, order=1, mode="nearest") for each in np.moveaxis(lit, 2, 0)], -1)


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
        (n,) what `ranges` returns at the pixels.

    Returns
    -------
    tuple[Array, Array]
        (2, n) y and x, in which whole numbers are the pixels' middles, and (n,) what each ray counts.
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


def paper(lit: Array, circles: Array, weights: Array, disc: Array, most: float) -> Array:
    """Mix the sharp and a blurred picture by the circles of confusion (Huang et al. 2008, §2.2 and §2.3).

    Parameters
    ----------
    lit
        (H, W, 4) linear, premultiplied picture in which everything is sharp.
    circles
        (H, W) radii, pixels, negative before the focus.
    weights
        (7,) weights of the Gaussian that blurs `lit`, at distances of 0 to 6 pixels.
    disc
        (13, 2) x and y of points of the unit disc. A pixel looks up its surroundings at these points, scaled by its
        circle.
    most
        The radius from which on only the blurred picture counts, pixels.

    Returns
    -------
    Array
        (H, W, 4) linear, premultiplied picture.
    """
    height, width = circles.shape
    kernel = np.concatenate([weights[:0:-1], weights])
    blurred = np.asarray(lit, float)
    border = GAUSSIAN_RADIUS, GAUSSIAN_RADIUS
    for axis in (1, 0):
        padded = np.pad(blurred, [border if axis == k else (0, 0) for k in range(3)], mode="edge")
        blurred = np.lib.stride_tricks.sliding_window_view(padded, len(kernel), axis) @ kernel
    y, x = np.mgrid[:height, :width]
    out, total = np.zeros(lit.shape), np.zeros((height, width, 1))
    for right, up in disc:
        beside_x, beside_y = (np.floor(np.abs(circles) * offset + 0.5).astype(int) for offset in (right, up))
        at = np.clip(y + beside_y, 0, height - 1), np.clip(x + beside_x, 0, width - 1)
        blur = np.minimum(np.abs(circles[at]) / most, 1)
        weight = np.where(circles[at] >= circles, 1.0, blur)[..., None]
        out += weight * (lit[at] + blur[..., None] * (blurred[at] - lit[at]))
        total += weight
    return out / total
