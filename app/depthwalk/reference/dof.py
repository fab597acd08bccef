"""Compute depth of field, as the twin of shaders/dof.

`gather` mirrors gather.frag, which traces rays through the depth buffer (Lee, Eisemann and Seidel 2010, "Real-Time Lens
Blur Effects and Focus Control"); `ranges` mirrors tiles.frag and spread.frag, which bound the circles of confusion near
a pixel (McGuire et al. 2012, "A Reconstruction Filter for Plausible Motion Blur"); `paper` mirrors blur.frag and
paper.frag (Huang et al. 2008, §2.2 and §2.3).

Pictures are (H, W, 4) linear, premultiplied. Circles of confusion are (H, W) radii in pixels, negative before the
focus. Row 0 is at the bottom, as the shaders have it.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from depthwalk.render.view.lens import GAUSSIAN_RADIUS, GOLDEN_ANGLE, MIN_RAYS, RAY_DENSITY, RAY_STRIDE, SHARP_RADIUS
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


def gather(lit: Array, circles: Array, spread: Array, samples: int) -> Array:
    """Return the picture that a lens takes: each pixel is the mean of what rays from all over the lens meet.

    Parameters
    ----------
    lit
        (H, W, 4) linear, premultiplied picture in which everything is sharp.
    circles
        (H, W) radii, pixels, negative before the focus.
    spread
        (2, H, W) what `ranges` returns.
    samples
        Most rays per pixel.

    Returns
    -------
    Array
        (H, W, 4) linear, premultiplied; pixels whose surroundings are sharp are those of `lit`.
    """
    height, width = circles.shape
    y, x = (grid.ravel() for grid in np.mgrid[:height, :width])
    own, (low, high) = circles[y, x], spread[:, y, x]
    radius = np.maximum(-low, own)
    count = np.clip((RAY_DENSITY * radius**2).astype(int), min(MIN_RAYS, samples), samples)
    picture, out = np.asarray(lit, float), np.array(lit, float)
    blurred = radius >= SHARP_RADIUS
    out[y[blurred], x[blurred]] = 0
    for ray in range(int(count[blurred].max(initial=0))):
        rows = np.flatnonzero(blurred & (ray < count))
        lens = np.sqrt((ray + 0.5) / count[rows])[:, None] * [np.cos(ray * GOLDEN_ANGLE), np.sin(ray * GOLDEN_ANGLE)]
        ends = _ray_ends(circles, (x[rows], y[rows]), lens, own[rows], low[rows], high[rows])
        seen = [map_coordinates(channel, ends, order=1, mode="nearest") for channel in np.moveaxis(picture, 2, 0)]
        out[y[rows], x[rows]] += np.stack(seen, -1) / count[rows, None]
    return out


def _ray_ends(
    circles: Array, pixel: tuple[_Pixels, _Pixels], lens: Array, own: Array, low: Array, high: Array
) -> Array:
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
    Array
        (2, n) y and x, in which whole numbers are the pixels' middles.
    """
    last_pixel = circles.shape[1] - 1, circles.shape[0] - 1

    def beside(circle: Array) -> tuple[_Pixels, _Pixels]:
        moved = [at + np.floor(circle * lens[:, k] + 0.5).astype(int) for k, at in enumerate(pixel)]
        x, y = (np.clip(at, 0, end) for at, end in zip(moved, last_pixel, strict=True))
        return x, y

    stride = RAY_STRIDE / np.maximum(np.linalg.norm(lens, axis=1), 0.05)
    before, after = np.ceil((own - low) / stride), np.ceil((high - own) / stride)
    end = np.stack(pixel[::-1]).astype(float)
    last, deepest = np.full(len(own), -np.inf), np.full(len(own), -np.inf)
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
        deepest = np.where(deeper, found, deepest)
        last = np.where(running, own + part, last)
        done |= met
    return end


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
