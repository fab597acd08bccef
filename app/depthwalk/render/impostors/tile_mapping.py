"""Map the plane of an impostor to the texels of its tile.

There are two layouts, both homographies. `plane_tiles` is the paper's, with texels of one size on the plane.
`screen_tiles` composes that with the camera's perspective view of the plane, so that each texel is the pixel that it
will fill, and pass 2 need not resample.
"""

from dataclasses import dataclass

import numpy as np

from depthwalk.geometry.soa import StructOfArrays
from depthwalk.render.impostors.frustum_crop import PlaneVisibility
from depthwalk.render.impostors.warp_planes import Planes, tile_sizes
from depthwalk.render.view.view import View
from depthwalk.types import Array, Rows


@dataclass(frozen=True, kw_only=True)
class Tiles(StructOfArrays):
    """Hold the mappings of n tiles from the plane of an impostor to texels.

    Pass 1 stores 1 − nearest · λ / w, which is affine over the tile for a flat triangle, and 1 in empty texels.

    Attributes
    ----------
    texel : (n, 3, 3) homography: texel · (s, v, 1) = (x·w, y·w, w), with plane coordinates s, v in metres, and x and y
        in texels from the tile's corner.
    nearest : (n,) the least w / λ of each object.
    size : (n, 2) width and height of each tile, texels.
    pixel : (n, 2) where the tile's corner lies in the picture, pixels, if its texels are the picture's pixels; NaN
        otherwise.
    """

    texel: Array
    nearest: Array
    size: Rows
    pixel: Array

    def resized(self, size: Rows) -> "Tiles":
        """Return tiles of the same planes with new numbers of texels.

        Parameters
        ----------
        size : (n, 2) width and height of the new tiles, texels.

        Returns
        -------
        The n tiles; those whose size changes no longer lie on the picture's pixels.
        """
        scale = np.concatenate([size / self.size, np.ones((len(size), 1))], -1)
        same = (size == self.size).all(1, keepdims=True)
        return Tiles(
            texel=self.texel * scale[..., None],
            nearest=self.nearest,
            size=size,
            pixel=np.where(same, self.pixel, np.nan),
        )


def plane_tiles(planes: Planes, focal_pixels: float, limit: int) -> tuple[Planes, Tiles]:
    """Return tiles whose texels are rectangles of one size on the plane.

    The planes are returned one texel wider on every side, so that the last texel of the silhouette has a neighbour.

    Parameters
    ----------
    planes : the planes of n objects, with the rectangles that the tiles cover.
    focal_pixels : texels per unit of x/z in the middle of the picture: `View.focal_pixels` times texels per pixel.
    limit : the largest width and height of a tile, texels.

    Returns
    -------
    The widened planes and their tiles.
    """
    size = tile_sizes(planes, focal_pixels, limit - 2)
    texel = (planes.high - planes.low) / size
    planes = planes.widened(texel)
    return planes, Tiles(
        texel=_scaling(1 / texel, -planes.low / texel),
        nearest=np.ones(len(size)),
        size=size + 2,
        pixel=np.full(size.shape, np.nan),
    )


def screen_tiles(planes: Planes, seen: PlaneVisibility, view: View, depth: Array, scale: float, limit: int) -> Tiles:
    """Return tiles whose texels are the screen's pixels.

    Parameters
    ----------
    planes : the planes of n objects, cropped to the picture.
    seen : what the camera sees of the planes.
    view : the view of the picture.
    depth : (n,) the least distance of each object along the view axis, in metres of its frame.
    scale : texels per pixel.
    limit : the largest width and height of a tile, texels.

    Returns
    -------
    The tiles of the n planes.
    """
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
    """Return the homographies (n, 3, 3) of x ↦ scale · x + offset, both (n, 2)."""
    matrix = np.zeros((len(scale), 3, 3))
    matrix[:, (0, 1), (0, 1)], matrix[:, :2, 2], matrix[:, 2, 2] = scale, offset, 1
    return matrix
