"""Depth images as vertex and index arrays: one vertex per texel in use, one index list per grid step and face.

Nothing that is empty or cut is in a list, so it costs nothing (DESIGN §4).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject, Cylinder, DepthImage, Face, cell_triangles, grid_cells, image_points
from depthwalk.render.lod import Case

_BLOCK = 8  # cells; indices run block by block, so that a vertex is shaded about 1.3 times instead of twice
GRID_LAYOUT = ("4u2", "in_sample")  # of Grids.vertices, for GL
PAST_AXIS = 256  # added to a vertex's image number where depth exceeds the radius: its θ is half a turn off

_FACES_OF_CASE = {
    Case.SIDE: (Face.SIDE, Face.SIDE),
    Case.SIDE_AND_TOP: (Face.TOP, Face.SIDE),
    Case.SIDE_AND_BOTTOM: (Face.SIDE, Face.BOTTOM),
    Case.ALL: (Face.TOP, Face.BOTTOM),
}


@dataclass(frozen=True)
class Grids:
    """vertices: (V, 4) uint16: x, y, z over the box of `box_low` + [0, 1] · `box_size` (metres), and image number.

    indices: (I,) uint32, triangles. first, count: (levels, cases) runs of `indices`.
    """

    vertices: NDArray[np.uint16]
    indices: NDArray[np.uint32]
    first: NDArray[np.int64]
    count: NDArray[np.int64]
    box_low: NDArray[np.float32]
    box_size: NDArray[np.float32]


def build_grids(baked: BakedObject) -> Grids:
    """The arrays of all images and steps of `baked`."""
    levels = range(baked.steps)
    radius = baked.cylinder.radius
    triangles = {(n, level): _triangles(image, level, radius) for n, image in enumerate(baked.images) for level in levels}
    vertices, numbering = [], []
    total = 0
    low, size = _box(baked.cylinder)
    for image_index, image in enumerate(baked.images):
        used = np.zeros(image.depth.size, bool)
        for level in levels:
            used[triangles[image_index, level]] = True
        texels = _blockwise(used.nonzero()[0], image.depth.shape)
        number = np.zeros(image.depth.size, np.uint32)
        number[texels] = total + np.arange(len(texels), dtype=np.uint32)
        total += len(texels)
        numbering.append(number)
        vertices.append(_vertices(baked.cylinder, image, image_index, texels, low, size))
    first = np.zeros((baked.steps, len(Case)), np.int64)
    count = np.zeros_like(first)
    runs: list[NDArray[np.uint32]] = []
    position = 0
    for level in levels:
        starts = {}
        for face in Face:
            starts[face] = position
            for image_index, image in enumerate(baked.images):
                if image.face is face:
                    run = numbering[image_index][triangles[image_index, level]]
                    runs.append(run)
                    position += len(run)
        ends = {face: starts[Face(face + 1)] if face < Face.BOTTOM else position for face in Face}
        for case, (head, tail) in _FACES_OF_CASE.items():
            first[level, case] = starts[head]
            count[level, case] = ends[tail] - starts[head]
    return Grids(np.concatenate(vertices), np.concatenate(runs), first, count, low, size)


def _triangles(image: DepthImage, level: int, radius: float) -> NDArray[np.int64]:
    """Texel numbers (3 · triangles,) of the triangles of step 2^level that lie on the surface, block by block."""
    shape = image.depth.shape
    i0, j0, i1, j1 = grid_cells(shape, image.face, 1 << level)
    bits = image.cells[j0, i0] >> np.uint32(2 * level)
    cells = np.flatnonzero(bits & 3)
    block = _BLOCK << level
    cells = cells[np.lexsort((i0[cells] // block, j0[cells] // block))]
    columns, rows = cell_triangles(image.face, i0[cells], j0[cells], i1[cells], j1[cells])
    texels = np.moveaxis(rows * shape[1] + columns, 0, 1)  # (cells, 2, 3)
    kept = np.stack([bits[cells] & 1, bits[cells] & 2], -1) > 0
    corners = texels[kept]
    if image.face is Face.SIDE:  # past the axis θ runs the other way: the winding turns round
        past = image.depth.ravel()[corners].mean(-1) > radius
        corners[past] = corners[past, ::-1]
    return corners.ravel()


def _blockwise(texels: NDArray[np.int64], shape: tuple[int, ...]) -> NDArray[np.int64]:
    row, column = np.divmod(texels, shape[1])
    return texels[np.lexsort((column // _BLOCK, row // _BLOCK))]


def _box(cylinder: Cylinder) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    half = np.array([cylinder.half_width, cylinder.half_depth])
    low = np.array([-half[0], cylinder.bottom, -half[1]], np.float32)
    return low, np.array([2 * half[0], cylinder.height, 2 * half[1]], np.float32)


def _vertices(
    cylinder: Cylinder,
    image: DepthImage,
    image_index: int,
    texels: NDArray[np.int64],
    low: NDArray[np.float32],
    size: NDArray[np.float32],
) -> NDArray[np.uint16]:
    points = image_points(cylinder, image).reshape(-1, 3)[texels]
    out = np.empty((len(texels), 4), np.uint16)
    out[:, :3] = np.round(np.clip((points - low) / size, 0, 1) * 65535)
    past = (image.face is Face.SIDE) & (image.depth.ravel()[texels] > cylinder.radius)
    out[:, 3] = image_index + PAST_AXIS * past
    return out
