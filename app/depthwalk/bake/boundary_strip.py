"""Trace boundary strips: the surface between the last samples of a depth image and its true edge.

A grid triangle needs three samples of one surface. On its own, a grid therefore ends up to a cell short of every
silhouette and discontinuity cut, and thin things (a leaf, a finger) fall through it. Where a sample's neighbour does
not continue its surface, the surface is followed from the sample along the grid edge to its end. Triangles between
samples and end points then complete the cells, as marching triangles complete an isosurface at a boundary.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.grid import cell_triangles, grid_cells
from depthwalk.bake.images import BoundaryStrip
from depthwalk.bake.raycast import RayCaster
from depthwalk.types import Array

_FIRST_STRIDE = 0.25  # of a cell: narrower gaps are stepped over
_STRIDES = 10  # advances and halvings: they find the end to 1/64 cell or better
_SLACK = 0.35  # cells: how far a surface may curve away from its tangent plane within one cell
_PRECISION = 1 / 64  # of a cell
_LEAST_LENGTH = 1 / 32  # of a cell: a shorter strip is not worth a triangle


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Hold the L layers of hits of one face.

    Attributes
    ----------
    depth
        (L, H, W) float32, metres from the face inward, +inf where empty. In each texel, hits fill the first layers.
    facing
        (L, H, W, 3) float32, unit, object frame: normals of the triangles hit, turned toward the ray's origin.
    flipped
        (L, H, W) bool, True where the surface was hit from behind.
    """

    depth: NDArray[np.float32]
    facing: NDArray[np.float32]
    flipped: NDArray[np.bool_]


def trace_boundary_strip(
    caster: RayCaster,
    grid: FaceGrid,
    samples: Samples,
    level: int,
    codes: list[NDArray[np.uint16]],
    followed: NDArray[np.bool_],
) -> BoundaryStrip:
    """Trace the boundary strip of the grid of one level.

    Where a sample lacks one of its grid triangles, the edge of its surface is near. Rays follow the surface from that
    sample along the sides of the missing triangle to the edge. Triangles between samples and the points found there
    complete the cells.

    Parameters
    ----------
    caster
        The mesh, ready for ray casting, object frame.
    grid
        Rays and texels of the face.
    samples
        What the face's rays hit.
    level
        The grid has step 2^level.
    codes
        The triangles of each layer at this level, (cells,) uint16 as in `DepthImage.cells`.
    followed
        (L, H, W) bool, True for samples whose surface is to be followed.

    Returns
    -------
    BoundaryStrip
        The strip of `grid.face` at `level`; it may be empty.
    """
    _, height, width = samples.depth.shape
    free, texels, position = _open_triangles(grid, samples, level, codes, followed)
    layer, triangle, corner = free.nonzero()
    start = layer * height * width + texels[triangle, corner]  # sample numbers

    # The two edges of each free corner. Most are shared by two triangles and are followed once.
    turns = np.stack([(corner + 1) % 3, (corner + 2) % 3])
    edges = (start * (height * width) + texels[triangle, turns]).ravel()
    _, once, edge = np.unique(edges, return_index=True, return_inverse=True)
    from_sample = np.tile(start, 2)[once]
    begin, end = position[triangle, corner], position[triangle, turns].reshape(-1, 2)
    cell = (1 << level) * grid.longest_texel
    begin, end = (np.asarray(points.take(once, 0)) for points in (np.tile(begin, (2, 1)), end))
    along, depth = _follow(caster, grid, samples, from_sample, begin, end, cell)

    edge = edge.reshape(2, -1)
    partner = _partners(
        samples.depth.reshape(len(samples.depth), -1),
        free,
        (triangle, turns),
        texels,
        along[edge] >= 1,
        depth[edge],
        cell,
    )
    triangles = _polygons(start, corner, partner, along[edge], samples.depth.size + edge)
    ends = triangles >= samples.depth.size
    used, number = np.unique(triangles[ends] - samples.depth.size, return_inverse=True)
    triangles[ends] = samples.depth.size + number
    from_sample = from_sample[used]
    offset = along[used, None] * (end[used] - begin[used]) * [width, height]
    rise = depth[used] - samples.depth.ravel()[from_sample]
    order = np.argsort(triangles[:, 0], kind="stable")
    return BoundaryStrip(
        face=grid.face,
        level=level,
        start=from_sample.astype(np.int32),
        offset=_rounded(offset, (1 << level) * _PRECISION).astype(np.float16),
        rise=_rounded(rise, cell * _PRECISION).astype(np.float16),
        triangles=triangles[order].astype(np.int32),
    )


def _rounded(values: Array, step: float) -> Array:
    """Round to multiples of the largest power of two up to `step`: noise would not compress."""
    unit = 2.0 ** np.floor(np.log2(step))
    return np.asarray(np.round(values / unit) * unit)


def _open_triangles(
    grid: FaceGrid,
    samples: Samples,
    level: int,
    codes: list[NDArray[np.uint16]],
    followed: NDArray[np.bool_],
) -> tuple[NDArray[np.bool_], NDArray[np.int64], Array]:
    """Return the grid's triangles that lack a sample and have a `followed` sample at a corner.

    Returns which samples (L, triangles, 3) are free, see `_free_corners`; the texels (triangles, 3) at the corners; and
    their positions (triangles, 3, 2) u, v, which exceed 1 where a triangle crosses the seam.
    """
    layers, height, width = samples.depth.shape
    corners = grid_cells(grid.shape, grid.face, 1 << level)
    columns, rows = (axis.reshape(-1, 3) for axis in cell_triangles(grid.face, *corners))  # (triangles, 3)
    texels = rows * width + columns
    free = _free_corners(np.isfinite(samples.depth).reshape(layers, -1), texels, codes)
    begins = (free & followed.reshape(layers, -1).take(texels, 1)).any(0)
    selected = np.unique(np.flatnonzero(begins) // 3)
    columns, rows = columns.take(selected, 0), rows.take(selected, 0)
    # Unwrapped, so that an edge across the seam stays short.
    unwrapped = np.where(columns < np.tile(corners[0], 2)[selected, None], columns + width, columns)
    position = np.stack([(unwrapped + 0.5) / width, (rows + 0.5) / height], -1)
    return free.take(selected, 1), texels.take(selected, 0), position


def _free_corners(
    solid: NDArray[np.bool_], texels: NDArray[np.int64], codes: list[NDArray[np.uint16]]
) -> NDArray[np.bool_]:
    """Return which samples (L, triangles, 3) at the corners `texels` (triangles, 3) no triangle there uses.

    solid: (L, H·W), True where a texel holds a sample.
    """
    free = solid.take(texels, 1)
    for anchor, code in enumerate(codes):
        for half, offset in ((code & 127, 0), (code >> 7, code.size)):
            filled = np.flatnonzero(half & 1)
            free[anchor, filled + offset, 0] = False
            free[half[filled] >> 1 & 7, filled + offset, 1] = False
            free[half[filled] >> 4 & 7, filled + offset, 2] = False
    return free


def _follow(
    caster: RayCaster,
    grid: FaceGrid,
    samples: Samples,
    start: NDArray[np.int64],
    begin: Array,
    end: Array,
    cell: float,
) -> tuple[Array, NDArray[np.float32]]:
    """Follow the surface of samples `start` (n,) from (u, v) `begin` (n, 2) toward `end` (n, 2).

    Each advance must hit the mesh within a slack of the tangent plane at the last point; otherwise the stride is
    halved. Returns the part of the way (n,) in [0, 1] along which the surface continues, and the depth (n,) at its end,
    metres.
    """
    depth = samples.depth.take(start)
    normal = samples.facing.reshape(-1, 3).take(start, 0)
    from_behind = samples.flipped.take(start)
    point = grid.points_at(begin[:, 0], begin[:, 1], depth)
    along, stride = np.zeros(len(start)), np.full(len(start), _FIRST_STRIDE)
    for _ in range(_STRIDES):
        going = np.flatnonzero(along < 1)
        if not len(going):
            break
        target = np.minimum(along[going] + stride[going], 1)
        from_here, facing = begin.take(going, 0), normal.take(going, 0)
        spot = from_here + target[:, None] * (end.take(going, 0) - from_here)
        origin, direction = grid.rays_at(spot[:, 0], spot[:, 1])
        slope = np.einsum("ni,ni->n", direction, facing)
        steep = np.minimum(slope, -0.03)  # about 88°: a surface along the rays has no depth to predict
        expected = np.einsum("ni,ni->n", point.take(going, 0) - origin, facing) / steep
        slack = _SLACK * stride[going] * cell * (1 - 0.5 / steep)
        first = np.maximum(expected - slack, 0).astype(np.float32)
        hit = caster.first(origin + first[:, None] * direction, direction)
        found = first + hit.distance
        meets = (slope < -0.03) & (found <= expected + slack) & (hit.flipped == from_behind[going])
        met = np.flatnonzero(meets)
        on = going[met]
        along[on], depth[on], normal[on] = target[met], found[met], hit.normal.take(met, 0)
        point[on] = origin.take(met, 0) + found[met, None] * direction.take(met, 0)
        stride[going[~meets]] /= 2
    return along, depth


def _partners(
    depth: NDArray[np.float32],
    free: NDArray[np.bool_],
    ends: tuple[NDArray[np.int64], NDArray[np.int64]],
    texels: NDArray[np.int64],
    arrived: NDArray[np.bool_],
    end_depth: NDArray[np.float32],
    cell: float,
) -> NDArray[np.int64]:
    """Return, for each turn and free corner (2, n), the free corner at which its edge arrives, or −1.

    Only mutual arrivals count: the edge back must arrive where this one began.
    """
    triangle, turns = ends
    number = np.full(free.shape, -1, np.int64)
    number[free] = np.arange(int(free.sum()))
    partner = np.full(turns.shape, -1, np.int64)
    nearest = np.full(turns.shape, 0.5 * cell)
    for layer in range(len(depth)):
        with np.errstate(invalid="ignore"):
            gap = np.abs(depth[layer][texels[triangle, turns]] - end_depth)
        better = arrived & free[layer, triangle, turns] & (gap < nearest)
        partner[better] = number[layer, triangle, turns][better]
        nearest[better] = gap[better]
    here = np.arange(len(triangle))
    for turn in (0, 1):  # the way back from the next corner is its second turn, and vice versa
        linked = partner[turn] >= 0
        partner[turn, linked & (partner[1 - turn, partner[turn]] != here)] = -1
    return partner


def _polygons(
    start: NDArray[np.int64],
    corner: NDArray[np.int64],
    partner: NDArray[np.int64],
    along: Array,
    ending: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Fill each triangle's cell from its free corners to the boundary, with triangles (n, 3) of vertex numbers.

    start (n,): vertex of each free corner. corner (n,): which corner of the triangle it is. partner (2, n): the free
    corner after and before it on the same surface, or −1. along, ending (2, n): how far the surface extends toward the
    corner after and before it, and the vertex at its end.
    """
    after, before = partner
    follower = np.where(after >= 0, after[after], -1)  # of the one after
    long_enough = along[0] * along[1] > _LEAST_LENGTH**2
    alone = np.flatnonzero((after < 0) & (before < 0) & long_enough)
    head = (after >= 0) & (before < 0)
    pair = np.flatnonzero(head & (follower < 0))
    chain = np.flatnonzero(head & (follower >= 0))
    ring = np.flatnonzero((after >= 0) & (before >= 0) & (follower >= 0) & (corner == 0))
    ring = ring[after[follower[ring]] == ring]
    second, third = after, follower
    pieces = [
        (start[alone], ending[0, alone], ending[1, alone]),
        (start[pair], start[second[pair]], ending[0, second[pair]]),
        (start[pair], ending[0, second[pair]], ending[1, pair]),
        (start[chain], start[second[chain]], ending[1, chain]),
        (start[second[chain]], ending[0, third[chain]], ending[1, chain]),
        (start[second[chain]], start[third[chain]], ending[0, third[chain]]),
        (start[ring], start[second[ring]], start[third[ring]]),
    ]
    return np.concatenate([np.stack(piece, -1) for piece in pieces])
