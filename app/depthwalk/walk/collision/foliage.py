"""Find the thin leaves of a surface, which a viewer brushes aside: those that cover nothing solid.

The branches of a fir and the outside of a clipped tree are equally rough. But behind the latter there is a volume that
cannot be reached from outside: it stops a viewer, as a hedge does.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.indexed_triangles import normals_and_areas, opposite_edges, vertex_directions
from depthwalk.geometry.triangles import row_ids, sample_batches
from depthwalk.geometry.vectors import lengths
from depthwalk.types import Array, Ints, Mask, Rows

_VOXEL = 0.1  # metres, world
_SMOOTH = 0.55  # agreement of the normals of neighbours from which on a surface is no foliage; a cube's corners: 0.58
_NEIGHBOURHOOD = 2  # voxels: edge of the cells in which that is averaged
_LEAF = 1.2  # metres, world: the largest tuft, whose triangles have no longer edges
_CORE = 27  # voxels of the smallest volume that counts as solid
_BEHIND = 3  # voxels between foliage and the volume that it covers, at most
_MOST_VOXELS = 1 << 24
_SAMPLES = 16  # points per voxel's face, by which triangles are entered


def thin_leaves(points: Array, triangles: Rows, scale: float = 1.0) -> Mask:
    """Return which triangles are foliage with nothing solid behind it.

    Parameters
    ----------
    points
        (n, 3) vertices, metres, asset frame.
    triangles
        (t, 3) rows of `points`.
    scale
        Size of the object relative to the asset.

    Returns
    -------
    numpy.ndarray
        (t,) bool.
    """
    none = np.zeros(len(triangles), bool)
    if not len(triangles):
        return none
    voxel = _VOXEL / scale
    corners = points[triangles]
    low = corners.min((0, 1))
    size = np.floor((corners.max((0, 1)) - low) / voxel).astype(np.int64) + 1
    if size.max() > _MOST_VOXELS or size.prod() > _MOST_VOXELS:
        return none
    middle = np.floor((corners.mean(1) - low) / voxel).astype(np.int64)
    small = lengths(corners - np.roll(corners, 1, 1)).max(1) <= _LEAF / scale
    number, kept = row_ids(np.ascontiguousarray(points))
    distinct, welded = points[kept], number[triangles]
    rough = small & _is_rough(distinct, welded, middle // _NEIGHBOURHOOD, _LEAF / scale)
    if not rough.any():
        return none
    covering = _near_core(_occupied(corners, low, voxel, size))
    thin = rough & ~covering[tuple(np.minimum(middle, size - 1).T)]
    return _with_remnants(distinct, welded, thin, _LEAF / scale) if thin.any() else none


def _is_rough(points: Array, welded: Ints, cell: Rows, leaf: float) -> Mask:
    """Return whether the normals of neighbouring triangles differ much, on average in the `cell` (t, 3) of each.

    points: (n, 3), all different; welded: (t, 3), rows of these.

    Neighbours are triangles that share vertices and, of loose pieces of up to `leaf` metres, all nearby.
    """
    normal, area = normals_and_areas(points, welded)
    total = np.bincount(welded.ravel(), np.repeat(2 * area, 3), len(points))
    agreement = lengths(vertex_directions(points, welded)) / np.maximum(total, 1e-30)
    group, _ = row_ids(cell)
    share = np.bincount(group, area * agreement[welded].mean(1)) / np.maximum(np.bincount(group, area), 1e-30)
    around, _ = row_ids(cell // 2)
    together = np.stack([np.bincount(around, area * axis) for axis in normal.T], -1).astype(np.float64)
    is_chaos = lengths(together) < _SMOOTH * np.bincount(around, area)
    return np.asarray((share[group] < _SMOOTH) | (is_chaos[around] & _loose_pieces(points, welded, leaf)[0]))


def _with_remnants(points: Array, welded: Ints, thin: Mask, leaf: float) -> Mask:
    """Return which triangles `welded` (t, 3) are `thin` (t,), or of a piece of up to `leaf` metres that these leave."""
    torn = np.zeros(len(points), bool)
    torn[welded[thin]] = True
    rest = np.flatnonzero(~thin)
    loose, piece = _loose_pieces(points, welded[rest], leaf)
    torn_pieces = np.zeros(piece.max(initial=0) + 1, bool)
    torn_pieces[piece[torn[welded[rest]].any(1)]] = True
    whole = thin.copy()
    whole[rest[loose & torn_pieces[piece]]] = True
    return whole


def _loose_pieces(points: Array, welded: Ints, leaf: float) -> tuple[Mask, Rows]:
    """Return which triangles (t, 3), rows of points (n, 3), are of open pieces of up to `leaf`, metres; and the pieces.

    The latter are numbers (t,), the same for triangles that are connected.
    """
    from scipy.sparse import coo_array  # here, since no first picture needs it
    from scipy.sparse.csgraph import connected_components

    ones, count = np.ones(2 * len(welded), np.int8), len(points)
    links = coo_array((ones, (welded[:, [0, 1]].T.ravel(), welded[:, [1, 2]].T.ravel())), shape=(count, count))
    pieces, number = connected_components(links, directed=False)
    low, high = np.full((pieces, 3), np.inf), np.full((pieces, 3), -np.inf)
    np.minimum.at(low, number, points)
    np.maximum.at(high, number, points)
    edges = np.zeros(pieces, bool)
    piece = number[welded[:, 0]]
    edges[piece[(opposite_edges(welded) < 0).reshape(-1, 3).any(1)]] = True
    return np.asarray((edges & (lengths(high - low) <= leaf))[piece]), piece


def _occupied(corners: Array, low: Array, voxel: float, size: Rows) -> NDArray[np.bool_]:
    """Return which voxels of a grid of `size` (3,) from `low` (3,) on triangles with `corners` (t, 3, 3) touch."""
    occupied = np.zeros(size, bool)
    edges = np.concatenate([corners.reshape(-1, 3), ((corners + np.roll(corners, 1, 1)) / 2).reshape(-1, 3)])
    areas = lengths(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])) / 2
    count = int(min(_SAMPLES * areas.sum() / voxel**2, _MOST_VOXELS)) + 1
    spread = (points for points, _ in sample_batches(corners, areas, count))
    for points in (edges, *spread):
        occupied[tuple(np.clip(np.floor((points - low) / voxel).astype(np.int64), 0, size - 1).T)] = True
    return occupied


def _near_core(occupied: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which voxels are near a volume that cannot be reached from outside, other than from below.

    That is the asset's own below, where no leaves are because it stands there, even if an object was turned over since.
    """
    from scipy import ndimage  # here, since no first picture needs it

    open_around = np.pad(~occupied, ((1, 1), (0, 1), (1, 1)), constant_values=True)
    number, _ = ndimage.label(open_around)
    inside = np.where(number == number[0, -1, 0], 0, number)[1:-1, :-1, 1:-1]
    voxels = np.bincount(inside.ravel())
    voxels[0] = 0
    core = (voxels >= _CORE)[inside]
    cube = np.ones((3, 3, 3), bool)
    return np.asarray(ndimage.binary_dilation(core, cube, _BEHIND) if core.any() else core)
