"""Depth images as vertex and index arrays: one vertex per texel in use, one index list per grid step and face.

Nothing that is empty or cut is in a list, so it costs nothing (DESIGN §4).
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject, Cylinder, DepthImage, Face, image_points, layer_triangles
from depthwalk.render.lod import Case

_BLOCK = 8  # cells; indices run block by block, so that a vertex is shaded about 1.3 times instead of twice
GRID_LAYOUT = ("4u2", "in_sample")  # of Grids.vertices, for GL
PAST_AXIS = 256  # added to a vertex's image number where depth exceeds the radius: its θ is half a turn off


class Run(IntEnum):
    """The order of triangles in an index list. What another face samples better is kept apart, so that it is drawn only
    where that face is not."""

    TOP = 0  # the top cap's own
    SIDE_OF_TOP = 1  # on the side image, but better on the top cap
    SIDE = 2
    SIDE_OF_BOTTOM = 3
    BOTTOM = 4


_RUNS_OF_CASE = {
    Case.SIDE: (Run.SIDE_OF_TOP, Run.SIDE, Run.SIDE_OF_BOTTOM),
    Case.SIDE_AND_TOP: (Run.TOP, Run.SIDE, Run.SIDE_OF_BOTTOM),
    Case.SIDE_AND_BOTTOM: (Run.SIDE_OF_TOP, Run.SIDE, Run.BOTTOM),
    Case.ALL: (Run.TOP, Run.SIDE, Run.BOTTOM),
}
RUNS_PER_CASE = 3


@dataclass(frozen=True)
class Grids:
    """vertices: (V, 4) uint16: x, y, z over the box of `box_low` + [0, 1] · `box_size` (metres), and image number.

    indices: (I,) uint32, triangles. first, count: (levels, cases, RUNS_PER_CASE) runs of `indices`; a run that adjoins
    the one before it is merged into that, and has count 0 itself.
    """

    vertices: NDArray[np.uint16]
    indices: NDArray[np.uint32]
    first: NDArray[np.int64]
    count: NDArray[np.int64]
    box_low: NDArray[np.float32]
    box_size: NDArray[np.float32]


def build_grids(baked: BakedObject) -> Grids:
    """The arrays of all images and steps of `baked`."""
    low, size = _box(baked.cylinder)
    vertices: list[NDArray[np.uint16]] = []
    runs: dict[tuple[int, Run], list[NDArray[np.uint32]]] = {}
    total = 0
    for face in Face:
        images = [image for image in baked.images if image.face is face]
        if not images:
            continue
        first_image = baked.images.index(images[0])
        triangles = [_face_triangles(images, level, baked.cylinder.radius) for level in range(baked.steps)]
        used = np.zeros(len(images) * images[0].depth.size, bool)
        for corners, _ in triangles:
            used[corners] = True
        samples = _blockwise(used.nonzero()[0], images[0].depth.shape)
        number = np.zeros(used.size, np.uint32)
        number[samples] = total + np.arange(len(samples), dtype=np.uint32)
        total += len(samples)
        vertices.append(_vertices(baked.cylinder, images, first_image, samples, low, size))
        for level, (corners, run) in enumerate(triangles):
            for kind in Run:
                runs.setdefault((level, kind), []).append(number[corners[run == kind]].ravel())
    lists = {key: np.concatenate(parts) for key, parts in sorted(runs.items())}
    first, count = _ranges(lists, baked.steps)
    return Grids(np.concatenate(vertices), np.concatenate(list(lists.values())), first, count, low, size)


def _ranges(
    lists: dict[tuple[int, Run], NDArray[np.uint32]], levels: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Grids.first and Grids.count of the index lists, laid out one after another."""
    ends = np.cumsum([len(part) for part in lists.values()])
    starts = dict(zip(lists, np.concatenate([[0], ends[:-1]]).tolist(), strict=True))
    first = np.zeros((levels, len(Case), RUNS_PER_CASE), np.int64)
    count = np.zeros_like(first)
    for level in range(levels):
        for case, kinds in _RUNS_OF_CASE.items():
            slot = -1
            for kind in kinds:
                start, length = starts[level, kind], len(lists[level, kind])
                if slot >= 0 and first[level, case, slot] + count[level, case, slot] == start:
                    count[level, case, slot] += length
                else:
                    slot += 1
                    first[level, case, slot], count[level, case, slot] = start, length
    return first, count


def _face_triangles(images: list[DepthImage], level: int, radius: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sample numbers (n, 3), layer · H · W + texel, of the surface triangles of step 2^level, and the Run (n,) of each.

    Caps leave out what another face owns: the side is always drawn.
    """
    height, width = images[0].depth.shape
    depth = np.stack([image.depth for image in images]).ravel()
    owner = np.stack([image.owner for image in images]).ravel()
    parts = [layer_triangles(image, level) for image in images]
    corners = np.concatenate([layers * height * width + texels for layers, texels in parts])
    face = images[0].face
    owners = owner[corners]
    # A triangle belongs to another face only with all its corners, so that neighbours overlap where owners meet.
    shared = np.where((owners == owners[:, :1]).all(1), owners[:, 0], face)
    if face is Face.SIDE:
        past = depth[corners].mean(-1) > radius  # past the axis θ runs the other way: the winding turns round
        corners[past] = corners[past, ::-1]
        run = np.array([Run.SIDE_OF_TOP, Run.SIDE, Run.SIDE_OF_BOTTOM])[shared]
    else:
        corners = corners[shared == face]
        run = np.full(len(corners), Run.TOP if face is Face.TOP else Run.BOTTOM)
    row, column = np.divmod(corners[:, 0] % (height * width), width)
    block = _BLOCK << level
    order = np.lexsort((column // block, row // block))
    return corners[order], run[order]


def _blockwise(samples: NDArray[np.int64], shape: tuple[int, ...]) -> NDArray[np.int64]:
    row, column = np.divmod(samples % (shape[0] * shape[1]), shape[1])
    return samples[np.lexsort((column // _BLOCK, row // _BLOCK))]


def _box(cylinder: Cylinder) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    half = np.array([cylinder.half_width, cylinder.half_depth])
    low = np.array([-half[0], cylinder.bottom, -half[1]], np.float32)
    return low, np.array([2 * half[0], cylinder.height, 2 * half[1]], np.float32)


def _vertices(
    cylinder: Cylinder,
    images: list[DepthImage],
    first_image: int,
    samples: NDArray[np.int64],
    low: NDArray[np.float32],
    size: NDArray[np.float32],
) -> NDArray[np.uint16]:
    points = np.concatenate([image_points(cylinder, image).reshape(-1, 3) for image in images])[samples]
    depth = np.concatenate([image.depth.ravel() for image in images])[samples]
    out = np.empty((len(samples), 4), np.uint16)
    out[:, :3] = np.round(np.clip((points - low) / size, 0, 1) * 65535)
    past = (images[0].face is Face.SIDE) & (depth > cylinder.radius)
    out[:, 3] = first_image + samples // images[0].depth.size + PAST_AXIS * past
    return out
