"""A single planar depth image (Liu et al. 2007, §2) as an object: a top cap without a cylinder around it."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.connectivity import CUT_TOLERANCE
from depthwalk.bake.images import (
    BakedObject,
    Cylinder,
    DepthImage,
    Face,
    cell_triangles,
    grid_cells,
    texel_size,
    usable_steps,
)
from depthwalk.colour import linear_from_srgb8
from depthwalk.ingest.image import PlanarImage

_SPECULAR, _SHININESS = 0.15, 32.0
_UPRIGHT = (float(np.sqrt(0.5)), 0.0, 0.0, float(np.sqrt(0.5)))  # a quarter turn about x: +Y to +Z, −Z to +Y
# Without a surface to test against, a triangle over a step deeper than this many cells is taken for a rubber sheet
# unless its neighbours slope as much.
_STEEP = 4.0


def bake_planar(image: PlanarImage, key: str) -> BakedObject:
    """The picture stands upright on its lower edge, seen from +Z: its x is the asset's x, its top is up."""
    width, height = image.size
    depth = np.ascontiguousarray(image.depth[::-1])  # the cap's rows run along z, from the picture's top down
    solid = np.isfinite(depth)
    deepest = max(float(depth[solid].max(initial=0.0)), 1e-3 * max(width, height))
    cylinder = Cylinder(float(np.hypot(width, height)) / 2, -1.0001 * deepest, 0.0, width / 2, height / 2)
    x, y, z = np.moveaxis(image.normal[::-1], -1, 0)
    normal = np.where(solid[..., None], np.stack([x, z, -y], -1), 0)
    colour = linear_from_srgb8(image.colour[::-1])
    albedo = np.where(solid[..., None], np.concatenate([colour, np.full_like(colour[..., :1], _SPECULAR)], -1), 0)
    steps = usable_steps((depth.shape[0], depth.shape[1]))
    cells = _connect(depth, cylinder, steps)
    owner = np.full(depth.shape, Face.TOP, np.uint8)
    picture = DepthImage(Face.TOP, 0, depth, normal.astype(np.float32), albedo.astype(np.float32), cells, owner)
    return BakedObject(cylinder, (picture,), (), _SHININESS, steps, key, (0.0, height / 2, 0.0), _UPRIGHT)


def _connect(depth: NDArray[np.float32], cylinder: Cylinder, steps: int) -> tuple[NDArray[np.uint16], ...]:
    """Grid triangles that lie on the surface, judged from the image alone.

    A surface that is steep goes on being steep: the depth at the middle of a triangle, interpolated from the texels
    around it, must agree with the triangle's own (as the ray through its centre does for a mesh), or the step be small.
    """
    shape = (depth.shape[0], depth.shape[1])
    cells = []
    for level in range(steps):
        step = 1 << level
        i0, j0, i1, j1 = grid_cells(shape, Face.TOP, step)
        columns, rows = cell_triangles(Face.TOP, i0, j0, i1, j1)
        corners = depth[rows, columns]
        complete = np.isfinite(corners).all(-1)
        with np.errstate(invalid="ignore"):
            spread = corners.max(-1) - corners.min(-1)
            middle = depth[np.round(rows.mean(-1)).astype(int), np.round(columns.mean(-1)).astype(int)]
            off = np.abs(middle - corners.mean(-1))
            smooth = spread <= _STEEP * step * max(texel_size(cylinder, Face.TOP, shape))
            # At step 1 the nearest texel is a corner and says nothing; there only the slope decides.
            kept = complete & (smooth | ((level > 0) & (off <= CUT_TOLERANCE * spread)))
        cells.append(kept[0].astype(np.uint16) | kept[1].astype(np.uint16) << 7)
    return tuple(cells)
