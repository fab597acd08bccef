"""Twin of shaders/dof. Pictures (H, W, 4), linear, premultiplied; circles (H, W), their radius in pixels, negative
before the focus; row 0 wherever the shaders have it."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from depthwalk.render.view.lens import DENSITY, FEWEST, GOLDEN_ANGLE, SHARP, STRIDE
from depthwalk.types import Array

Rows = NDArray[np.intp]


def ranges(circles: Array, tile: int) -> Array:
    """The least and the greatest circle (2, H, W) that may reach into each pixel's tile of `tile` × `tile` pixels."""
    height, width = circles.shape
    rows, columns = np.arange(0, height, tile), np.arange(0, width, tile)
    extremes = np.stack([cut.reduceat(cut.reduceat(circles, rows, 0), columns, 1) for cut in (np.minimum, np.maximum)])
    y, x = (grid.ravel() for grid in np.mgrid[: len(rows), : len(columns)])
    apart = np.maximum(np.abs(np.stack([y[:, None] - y, x[:, None] - x])) - 1, 0) * tile
    gap = np.hypot(*apart)  # (tiles, tiles)
    low, high = extremes.reshape(2, -1)
    own = np.eye(len(y), dtype=bool)
    least = np.where(own | (-low > gap), low, np.inf).min(1)
    most = np.where(own | (high > gap), high, -np.inf).max(1)
    spread = np.stack([least, most]).reshape(extremes.shape)
    return spread.repeat(tile, 1).repeat(tile, 2)[:, :height, :width]


def gather(lit: Array, circles: Array, spread: Array, samples: int) -> Array:
    """What gather.frag makes of a picture. spread: what `ranges` gives; samples: most rays of a pixel."""
    height, width = circles.shape
    y, x = (grid.ravel() for grid in np.mgrid[:height, :width])
    own, (low, high) = circles[y, x], spread[:, y, x]
    radius = np.maximum(-low, own)
    count = np.clip((DENSITY * radius**2).astype(int), min(FEWEST, samples), samples)
    picture, out = np.asarray(lit, float), np.array(lit, float)
    pending = radius >= SHARP
    out[y[pending], x[pending]] = 0
    for ray in range(int(count[pending].max(initial=0))):
        some = np.flatnonzero(pending & (ray < count))
        lens = np.sqrt((ray + 0.5) / count[some])[:, None] * [np.cos(ray * GOLDEN_ANGLE), np.sin(ray * GOLDEN_ANGLE)]
        ends = _traced(circles, (x[some], y[some]), lens, own[some], low[some], high[some])
        seen = [map_coordinates(channel, ends, order=1, mode="nearest") for channel in np.moveaxis(picture, 2, 0)]
        out[y[some], x[some]] += np.stack(seen, -1) / count[some, None]
    return out


def _traced(circles: Array, pixel: tuple[Rows, Rows], lens: Array, own: Array, low: Array, high: Array) -> Array:
    """Where (2, n), y and x of pixels' middles, rays end that go to points `lens` (n, 2) of the unit disc."""
    last_pixel = circles.shape[1] - 1, circles.shape[0] - 1

    def beside(circle: Array) -> tuple[Rows, Rows]:
        moved = [at + np.floor(circle * lens[:, k] + 0.5).astype(int) for k, at in enumerate(pixel)]
        x, y = (np.clip(at, 0, end) for at, end in zip(moved, last_pixel, strict=True))
        return x, y

    stride = STRIDE / np.maximum(np.linalg.norm(lens, axis=1), 0.05)
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
        met = running & (found <= own + part + SHARP) & (found >= last - SHARP)
        met &= np.abs(circles[met_y, met_x] - found) <= 2 * SHARP
        deeper = running & ~met & (found > deepest)
        moved = np.stack(pixel[::-1]) + found * lens[:, ::-1].T
        met_at = np.stack([met_y, met_x]) * 1.0
        met_at += np.clip(np.abs(found) / SHARP - 1, 0, 1) * (moved - met_at)
        end = np.select([met, deeper], [met_at, np.stack([y, x])], end)
        deepest = np.where(deeper, found, deepest)
        last = np.where(running, own + part, last)
        done |= met
    return end


def paper(lit: Array, circles: Array, weights: Array, disc: Array, most: float) -> Array:
    """Huang et al. 2008, §2.2 and §2.3: what blur.frag and paper.frag make of a picture.

    weights: (7,), by the distance in pixels; disc: (13, 2); most: radius where the blur factor is 1, pixels.
    """
    height, width = circles.shape
    kernel = np.concatenate([weights[:0:-1], weights])
    blurred = np.asarray(lit, float)
    for axis in (1, 0):
        padded = np.pad(blurred, [(6, 6) if axis == k else (0, 0) for k in range(3)], mode="edge")
        blurred = np.lib.stride_tricks.sliding_window_view(padded, 13, axis) @ kernel
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
