"""Make seamless textures for grounds and for relief; files have a palette to stay small."""

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import gaussian_filter
from tools.make_models.paint import mix, smoothstep

from depthwalk.files import write_bytes

SIDE = 512
_FINE = 2 * SIDE  # painted at twice the size, then averaged
Picture = NDArray[np.float32]


def tiling_noise(side: int, sigma: float, seed: int) -> Picture:
    """Return noise without a seam, (side, side) float32, of mean 0 and deviation 1.

    Features are about `sigma` pixels large; `seed` chooses them.
    """
    white = np.random.default_rng(seed).normal(size=(side, side))
    smooth = gaussian_filter(white, sigma, mode="wrap")
    return ((smooth - smooth.mean()) / smooth.std()).astype(np.float32)


def halved(picture: Picture) -> Picture:
    """Return `picture` (H, W, 3) averaged over 2 × 2 pixels: (H/2, W/2, 3)."""
    h, w, c = picture.shape
    return picture.reshape(h // 2, 2, w // 2, 2, c).mean(axis=(1, 3))


def grass() -> Picture:
    """Return a lawn from above, drawn blade by blade: (512, 512, 3), sRGB, 0 to 1; meant for about 1.5 m."""
    rng = np.random.default_rng(101)
    picture = np.full((_FINE, _FINE, 3), [0.17, 0.21, 0.08], np.float32)
    count, steps = 16000, 26
    root = rng.uniform(0, _FINE, (count, 2))
    heading = rng.uniform(0, 2 * np.pi, count)
    bend = rng.normal(0, 0.6, count)
    length = rng.uniform(18, 44, count)
    tone = np.sort(0.5 + 0.25 * rng.normal(size=count))  # darker blades lie below
    colour = mix((0.24, 0.33, 0.12), (0.52, 0.60, 0.27), tone)
    dry = rng.random(count) < 0.04
    colour[dry] = mix((0.55, 0.52, 0.30), (0.66, 0.62, 0.38), tone[dry])
    for t in np.linspace(0, 1, steps):  # a step of all blades at once
        angle = heading + bend * t
        at = root + (t * length)[:, None] * np.stack([np.sin(angle), np.cos(angle)], axis=1)
        pixel = (at % _FINE).astype(int)
        lit = np.clip(colour * (0.78 + 0.3 * t), 0, 1)
        for offset in (0, 1, 2) if t < 0.7 else (0, 1):
            picture[pixel[:, 0], (pixel[:, 1] + offset) % _FINE] = lit
    return np.clip(halved(picture), 0, 1)


def paving() -> Picture:
    """Return four courses of flagstones with sandy joints: (512, 512, 3), sRGB, 0 to 1; meant for about 2 m."""
    rng = np.random.default_rng(111)
    wobble = [2.5 * tiling_noise(SIDE, 9, 112 + k) for k in range(2)]
    y, x = np.mgrid[0:SIDE, 0:SIDE] + np.stack(wobble)
    course = np.floor(y / 128).astype(int) % 4
    starts = np.array([[0, 150, 330], [70, 260, 420], [20, 200, 370], [110, 290, 450]])[course]
    from_start = (x[..., None] - starts) % SIDE
    stone = from_start.argmin(axis=-1)
    ends = np.roll(starts, -1, axis=-1)
    to_end = (np.take_along_axis(ends, stone[..., None], -1)[..., 0] - x) % SIDE
    edge = np.minimum(np.minimum(from_start.min(axis=-1), to_end), np.minimum(y % 128, 128 - y % 128))
    tone = rng.uniform(0.15, 0.85, (4, 3))[course, stone]
    grain = 0.10 * tiling_noise(SIDE, 1.2, 120) + 0.16 * tiling_noise(SIDE, 14, 121)
    top = mix((0.50, 0.47, 0.42), (0.70, 0.66, 0.58), (tone + grain).ravel())
    bevel = 0.62 + 0.38 * smoothstep(3, 11, edge.ravel())
    sand = mix((0.34, 0.30, 0.24), (0.46, 0.42, 0.33), (0.5 + 0.3 * tiling_noise(SIDE, 1.5, 122)).ravel())
    joint = smoothstep(5.0, 3.0, edge.ravel())
    return mix(top * bevel[:, None], sand, joint).reshape(SIDE, SIDE, 3)


def bark() -> Picture:
    """Return a depth image of oak bark, (256, 256, 3), grey 0 to 1: ridges that part and meet; white is outermost.

    It covers about 0.3 m across and 0.4 m up.
    """
    side = 256
    rng = np.random.default_rng(131)
    y, x = np.mgrid[0:side, 0:side] / side
    wander = gaussian_filter(rng.normal(size=(side, side)), (34, 12), mode="wrap")
    wander *= 0.016 / wander.std()
    # Plates: cells of scattered points, stretched upward, whose borders are the furrows.
    seeds = rng.uniform(0, 1, (46, 2))
    offset = np.stack([x + wander, y], -1)[:, :, None] - seeds
    offset -= np.round(offset)
    nearest = np.sort(np.hypot(offset[..., 0] * 3.2, offset[..., 1]), axis=-1)[..., :2]
    plate = smoothstep(0.0, 0.13, (nearest[..., 1] - nearest[..., 0]).ravel()).reshape(side, side)
    grain = gaussian_filter(rng.normal(size=(side, side)), (9, 1.1), mode="wrap")
    rough = gaussian_filter(rng.normal(size=(side, side)), 2.2, mode="wrap")
    height = plate * (0.86 + 0.07 * grain / grain.std()) + 0.045 * rough / rough.std()
    height = (height - height.min()) / (height.max() - height.min())
    return np.repeat(height[..., None], 3, axis=-1).astype(np.float32)


def write_png(path: Path, picture: Picture, colours: int = 48) -> None:
    """Write `picture` (H, W, 3), sRGB, 0 to 1, to the PNG file `path`, with a palette of so many `colours`.

    Grey pictures keep 8 bits of grey instead.
    """
    pixels = np.round(np.clip(picture, 0, 1) * 255).astype(np.uint8)
    if (pixels == pixels[..., :1]).all():
        image = Image.fromarray(pixels[..., 0])
    else:
        image = Image.fromarray(pixels).quantize(colours, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    stream = io.BytesIO()
    image.save(stream, "PNG", optimize=True)
    write_bytes(path, stream.getvalue())
