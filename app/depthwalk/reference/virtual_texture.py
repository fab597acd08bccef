"""Look texels up in the virtual texture of an object, as the twin of shaders/common/virtual_texture.glsl.

`cook/virtual_texture.py` describes how texels are stored. Points of an image are (x, y) in its texels, from the corner
of the first one; places are the same in the pages.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthwalk.cook.used_texels import SUB_TILE
from depthwalk.cook.virtual_texture import LEVELS, VirtualTexture
from depthwalk.types import Array, Rows

_FIXED = SUB_TILE**2 / (2 * (SUB_TILE - 1))  # the point that is the same in all mip tiers, counted as in `page_places`
_INSIDE = 0.01  # texels, by which points at the far edges of an image are moved into it


def page_places(
    pages: VirtualTexture, image: int, points: Array, lod: float, size: tuple[int, int]
) -> tuple[Array, Rows]:
    """Return where points of an image are stored in the pages, as `page_at` does.

    Parameters
    ----------
    pages
        The virtual texture of an object, none of whose texels are left out.
    image
        Number of the image.
    points
        (n, 2) points of the image.
    lod
        Level of detail that is wanted, 0 for the image itself.
    size
        Width and height of the image, texels.

    Returns
    -------
    places : Array
        (n, 2) their places in the pages.
    tiers : Rows
        (n,) the mip tier that each place is of: the finest that is stored there and that `lod` asks for.
    """
    points = np.clip(points, 0, np.asarray(size) - _INSIDE)
    tier = np.full(len(points), min(int(lod / LEVELS), pages.last_mip_tier))
    while True:
        # In texels of the tier, counted from half a sub-tile before it.
        place = (points + SUB_TILE / 2 - _FIXED) / 2.0 ** (LEVELS * tier[:, None]) + _FIXED
        column, row = ((place - SUB_TILE / 2) / SUB_TILE).astype(int).T
        entry = pages.table[image, row // 2 + np.array(pages.first_rows)[tier], column // 2].astype(int)
        missing = np.where(row % 2, entry[:, 1], entry[:, 0]) >> column % 2 & 1 == 0
        if not missing.any():
            return place + (entry & ~(SUB_TILE - 1)), tier
        tier = tier + missing


def page_texels(
    pages: VirtualTexture, image: int, points: Array, lod: float, size: tuple[int, int]
) -> tuple[Array, Rows]:
    """Look texels up at points of an image, trilinear, as `page_texel` and `page_colour` do.

    Parameters
    ----------
    pages, image, points, lod, size
        See `page_places`.

    Returns
    -------
    texels : Array
        (n, 8) of 255: normal, remainder of the depth, √linear RGB, specular strength.
    tiers : Rows
        (n,) the mip tier that each is of.
    """
    place, tier = page_places(pages, image, points, lod, size)
    level = np.clip(lod - LEVELS * tier, 0, LEVELS)
    normals, colours, tints = (
        _trilinear(picture, place / scale, level - (scale > 1))
        for picture, scale in ((pages.normals, 1), (pages.colours, 1), (pages.tints, 2))
    )
    if not colours.shape[1]:
        colours = np.tile(255 * pages.palette[0], (len(points), 1))
    elif tints.shape[1]:
        own = colours * (255 / 127)
        colours = 255 * pages.palette[0] + np.concatenate([own, tints], 1) @ pages.palette[1:]
    return np.concatenate([normals, colours], 1), tier


def page_normals(pages: VirtualTexture, image: int, points: Array, size: tuple[int, int]) -> Array:
    """Return the normals (n, 3), not of length 1, at points of an image, as `page_normal` does.

    They are interpolated between sixteen texels of level 0 by the cubics of Catmull and Rom 1974, "A Class of Local
    Interpolating Splines".

    Parameters
    ----------
    pages, image, points, size
        See `page_places`.
    """
    place, _ = page_places(pages, image, points, 0, size)
    low = np.floor(place - 0.5).astype(int)
    x = np.abs((place - 0.5 - low)[..., None] - np.arange(-1, 3))
    weight = np.where(x < 1, 1.5 * x**3 - 2.5 * x**2 + 1, -0.5 * x**3 + 2.5 * x**2 - 4 * x + 2)
    rows, columns = (low[:, axis, None] + np.arange(-1, 3) for axis in (1, 0))
    around = pages.normals[rows[:, :, None], columns[:, None], :3] / 127.5 - 1
    return np.asarray(np.einsum("nr,nc,nrci->ni", weight[:, 1], weight[:, 0], around))


def bilinear(texels: Array, points: Array) -> Array:
    """Interpolate texels (H, W, …) at points (n, 2), columns and rows; the middle of the first is at (½, ½)."""
    low = np.floor(points - 0.5).astype(int)
    f = (points - 0.5 - low)[:, :, None]
    parts = [
        texels[low[:, 1] + up, low[:, 0] + right] * np.abs(1 - right - f[:, 0]) * np.abs(1 - up - f[:, 1])
        for up in (0, 1)
        for right in (0, 1)
    ]
    return np.asarray(sum(parts))


def _trilinear(picture: NDArray[np.integer], place: Array, level: ArrayLike) -> Array:
    """Look up a picture (H, W, k) at places (n, 2), its texels, at levels of detail (n,) or one, up to LEVELS."""
    if not picture.size:
        return np.zeros((len(place), 0))
    mips = [picture.astype(float)]
    for _ in range(LEVELS):
        height, width = (extent // 2 for extent in mips[-1].shape[:2])
        boxes = mips[-1][: height * 2, : width * 2].reshape(height, 2, width, 2, -1)
        mips.append(np.round(boxes.mean((1, 3))))
    padded = [np.pad(mip, ((1, 1), (1, 1), (0, 0))) for mip in mips]
    values = np.stack([bilinear(mip, place / (1 << k) + 1) for k, mip in enumerate(padded)])
    clipped = np.clip(level, 0, LEVELS) + np.zeros(len(place))
    below = np.minimum(clipped.astype(int), LEVELS - 1)
    part = (clipped - below)[:, None]
    every = np.arange(len(place))
    return np.asarray((1 - part) * values[below, every] + part * values[below + 1, every])
