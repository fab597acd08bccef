"""Read meso-structure from image files."""

from pathlib import Path

import numpy as np

from depthwalk.bake.meso import Meso, tiling_slopes
from depthwalk.errors import InputError
from depthwalk.ingest.range_image import load_depth_image


def load_meso(depth: Path, *, height: float, tile: tuple[float, float], normal: Path | None = None) -> Meso:
    """Read a tile of relief from image files.

    Parameters
    ----------
    depth
        Grey image of 8 or 16 bits without empty pixels: white is on the object's surface, black `height` below it.
    height
        Depth of black below the surface, metres.
    tile
        Width and height of the tile on the object, metres.
    normal
        File of a normal map in RGB, x right, y up, z outward; None computes the slopes from the depth.

    Returns
    -------
    Meso
        The tile.

    Raises
    ------
    InputError
        If a file cannot be used.
    """
    image = load_depth_image(depth, size=tile, depth_range=height, normal=normal)
    if not np.isfinite(image.depth).all():
        raise InputError(f"{depth}: {np.count_nonzero(~np.isfinite(image.depth))} pixels of the tile hold no depth")
    slopes = tiling_slopes(image.depth, tile) if normal is None else image.normal[..., :2] / image.normal[..., 2:]
    relief = np.concatenate([np.clip(image.depth, 0, height)[..., None], slopes], -1)
    return Meso(relief=relief.astype(np.float32), tile=tile, height=height)
