"""How an intermediate image is laid out: the map from its plane to the texels of its tile.

`plane` is the paper's: texels are squares on the plane. `screen` composes that with the perspective in which the
camera sees the plane, so that each texel is the pixel it will fill and pass 2 resamples nothing. Both are homographies.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.soa import Takes
from depthwalk.render.impostors.warp_planes import Planes, Seen, tile_sizes
from depthwalk.render.view.view import View
from depthwalk.types import Array


@dataclass(frozen=True, kw_only=True)
class Tiles(Takes):
    """n tiles. texel: (n, 3, 3) homography: texel · (s, v, 1) = (x·w, y·w, w), x and y from the tile's corner;
    nearest: (n,), the least w / λ of the object; size: (n, 2) texels; pixel: (n, 2), of the picture, where the tile's
    corner lies if its texels are the picture's pixels, else NaN.

    Pass 1 stores 1 − nearest · λ / w, which is affine over the tile for a flat triangle, and 1 where nothing is.
    """

    texel: Array
    nearest: Array
    size: NDArray[np.integer]
    pixel: Array

    def resized(self, size: NDArray[np.integer]) -> "Tiles":
        """The same with other numbers (n, 2) of texels."""
        scale = np.concatenate([size / self.size, np.ones((len(size), 1))], -1)
        same = (size == self.size).all(1, keepdims=True)
        return Tiles(
            texel=self.texel * scale[..., None],
            nearest=self.nearest,
            size=size,
            pixel=np.where(same, self.pixel, np.nan),
        )


def plane_tiles(planes: Planes, focal_pixels: float, limit: int) -> tuple[Planes, Tiles]:
    """Square texels on the plane, and the planes with one more texel on every side, so that the silhouette's last
    texel has a neighbour."""
    size = tile_sizes(planes, focal_pixels, limit - 2)
    texel = (planes.high - planes.low) / size
    planes = planes.widened(texel)
    return planes, Tiles(
        texel=_scaling(1 / texel, -planes.low / texel),
        nearest=np.ones(len(size)),
        size=size + 2,
        pixel=np.full(size.shape, np.nan),
    )


def screen_tiles(planes: Planes, seen: Seen, view: View, depth: Array, scale: float, limit: int) -> Tiles:
    """Texels that are the screen's pixels, `scale` of them per pixel. depth: (n,), the least distance of each object
    along the view axis, in its own frame's metres."""
    low, high = np.floor(seen.pixel_low), np.ceil(seen.pixel_high)
    to_camera = seen.camera * np.stack([np.ones(len(low)), np.ones(len(low)), -planes.distance], -1)[:, None]
    x, y, forward = np.moveaxis(to_camera, 1, 0)  # each (n, 3): times (s, v, 1) gives a camera coordinate
    width, height = view.size
    tan_x, tan_y = view.half_extent
    pixel = np.stack([(x / tan_x + forward) * width / 2, (y / tan_y + forward) * height / 2], 1)  # (n, 2, 3)
    factor = np.minimum(scale, limit / np.maximum(high - low, 1))
    texel = (pixel - low[..., None] * forward[:, None]) * factor[..., None]
    size = np.clip(np.ceil((high - low) * factor), 1, limit).astype(np.int64)
    pixel = np.where(factor == 1, low, np.nan)
    return Tiles(texel=np.concatenate([texel, forward[:, None]], 1), nearest=depth, size=size, pixel=pixel)


def _scaling(scale: Array, offset: Array) -> Array:
    """Homographies (n, 3, 3) of x ↦ scale · x + offset, both (n, 2)."""
    matrix = np.zeros((len(scale), 3, 3))
    matrix[:, (0, 1), (0, 1)], matrix[:, :2, 2], matrix[:, 2, 2] = scale, offset, 1
    return matrix
