"""Find the triangles of the surface that points of a scan lie on.

Around each point its neighbours are projected into the plane that fits them (Hoppe et al. 1992, "Surface Reconstruction
from Unorganized Points"), and the triangles of their Delaunay triangulation that have the point as a corner make up its
star (Gopi, Krishnan and Silva 2000, "Surface Reconstruction based on Lower Dimensional Localized Delaunay
Triangulation"). The surface consists of the triangles of all stars. Where stars disagree, as in noise, triangles
overlap; leaving out those of a single star would leave holes.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from depthwalk.geometry.triangles import row_ids
from depthwalk.geometry.view_directions import view_axes
from depthwalk.parallel import thread_map
from depthwalk.types import Array, Ints

_Points = NDArray[np.float64]

_STAR = 32  # neighbours that a star may use: with 24, surfaces of randomly spread points have twice the holes
_PLANE = 12  # nearest of them, which a plane fits
_SPACING = 6  # nearest of them, whose mean distance is the spacing of points
_LONELY = 2.0  # most spacing of a point, times the median of its neighbours': it may lie beside the surface
_LONGEST = 6.0  # edge of a triangle, times the spacing of each of its corners
_THINNEST = 0.04  # height of a triangle, relative to its longest edge, below which it is a sliver
_WIDEST = np.cos(np.radians(150))  # cosine of a star's angle at its point: where it is wider is a border of the surface
_SAME = 1e-9  # radians between neighbours that are in the same direction
_WEIGHT = 1e-3  # of points, see `_stars`
_BATCH = 1 << 12  # points at a time, so that what is computed of them stays in a processor's cache


def point_surface(point: _Points, normal: _Points) -> tuple[Ints, _Points]:
    """Return triangles through points, and normals of the surface.

    Parameters
    ----------
    point
        (n, 3) at least three distinct points.
    normal
        (n, 3) unit normals; rows that are NaN are found. Neighbours get them on the same side, and most of a closed
        surface's point outward.

    Returns
    -------
    tuple
        (t, 3) the corners of the triangles, counter-clockwise as seen along the normals, and the unit normals (n, 3).
        Points may have no triangle, and t may be 0, as for points on a line.
    """
    order = cKDTree(point).indices  # neighbours beside each other, in a processor's cache
    triangles, found = _sorted_surface(point[order], normal[order])
    normal = np.empty_like(found)
    normal[order] = found
    return order[triangles], normal


def _sorted_surface(point: _Points, normal: _Points) -> tuple[Ints, _Points]:
    """Return what `point_surface` returns, of points that lie near the rows before and after them."""
    count = min(_STAR, len(point) - 1)
    distance, near = cKDTree(point).query(point, count + 1, workers=-1)
    distance, near = distance[:, 1:], near[:, 1:]
    missing = np.isnan(normal[:, 0])
    if missing.any():
        found = _oriented(_plane_normals(point, near[:, :_PLANE]), point, near[:, :_PLANE])
        normal = np.where(missing[:, None], found, normal)
    spacing = distance[:, :_SPACING].mean(axis=1)
    spacing = np.minimum(spacing, _LONELY * np.median(spacing[near[:, :_PLANE]], axis=1))
    weight = _WEIGHT * np.square(distance[:, 0]) * np.random.default_rng(0).random(len(point))
    rows = np.split(np.arange(len(point)), np.arange(_BATCH, len(point), _BATCH))
    with thread_map() as parallel:
        stars = list(parallel(lambda batch: _stars(point, normal, weight, batch, near[batch]), rows))
    triangles = np.sort(np.concatenate(stars), axis=1)
    triangles = triangles[row_ids(triangles)[1]] if len(triangles) else triangles
    longest, across = _measured(point, triangles)
    height = np.linalg.norm(across, axis=1) / np.maximum(longest, np.finfo(np.float64).tiny)
    short = (longest < _LONGEST * spacing[triangles].min(axis=1)) & (height > 0)
    triangles, across, is_thin = triangles[short], across[short], (height <= _THINNEST * longest)[short]
    kept = _without_slivers(triangles, is_thin)
    triangles, across = triangles[kept], across[kept]
    faces_away = np.einsum("td,td->t", across, normal[triangles].sum(axis=1)) < 0
    triangles[faces_away] = triangles[faces_away, ::-1]
    return triangles, normal


def _without_slivers(triangles: Ints, is_thin: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which triangles (t,) to keep: not those that are thin and at the border, layer by layer.

    Neighbours along a border are nearly in line. Within the surface, leaving out a thin triangle would leave a slit.
    """
    kept = np.ones(len(triangles), bool)
    if not is_thin.any():
        return kept
    edge = row_ids(triangles[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2))[0].reshape(-1, 3)  # corners ascend
    while True:
        uses = np.bincount(edge[kept].ravel(), minlength=int(edge.max()) + 1)
        dropped = kept & is_thin & (uses[edge] == 1).any(axis=1)
        if not dropped.any():
            return kept
        kept &= ~dropped


def _measured(point: _Points, triangles: Ints) -> tuple[Array, Array]:
    """Return the longest edge (t,) of triangles, and their normals (t, 3), as long as twice their areas."""
    a, b, c = (point[corner] for corner in triangles.T)
    sides = np.stack([b - a, c - b, a - c])
    return np.sqrt(np.einsum("std,std->st", sides, sides).max(axis=0)), np.cross(b - a, c - a)


def _plane_normals(point: _Points, near: Ints) -> _Points:
    """Return the unit normals (n, 3) of the planes that fit each point and its neighbours (n, k) best."""
    normals = np.empty_like(point)
    for start in range(0, len(point), _BATCH):
        batch = slice(start, start + _BATCH)
        offset = np.concatenate([np.zeros((len(point[batch]), 1, 3)), point[near[batch]] - point[batch, None]], axis=1)
        offset -= offset.mean(axis=1, keepdims=True)
        offset /= np.abs(offset).max(axis=(1, 2), keepdims=True)  # so that no square underflows
        normals[batch] = np.linalg.eigh(offset.transpose(0, 2, 1) @ offset)[1][:, :, 0]  # eigenvalues ascend
    return normals


def _oriented(normal: _Points, point: _Points, near: Ints) -> _Points:
    """Return normals (n, 3), turned so that neighbours (n, k) are on the same side.

    They follow the tree of neighbours whose planes differ least (Hoppe et al. 1992, section 3.3). Each connected piece
    is then turned so that it faces away from its middle.
    """
    count = len(point)
    row, column = np.repeat(np.arange(count), near.shape[1]), near.ravel()
    apart = 1 - np.abs(np.einsum("nd,nd->n", normal[row], normal[column])) + 1e-6  # a weight of 0 would be no edge
    tree = minimum_spanning_tree(csr_array((apart, (row, column)), shape=(count, count)))
    pieces, piece = connected_components(tree, directed=False)
    # One more node ties the pieces together, so that a single search visits all of them.
    first = np.unique(piece, return_index=True)[1]
    ends = tree.tocoo()
    ties = np.concatenate([ends.row, np.full(pieces, count)]), np.concatenate([ends.col, first])
    tied = csr_array((np.ones(len(ties[0])), ties), shape=(count + 1, count + 1))
    parent = breadth_first_order(tied, count, directed=False)[1][:count]
    is_root = parent == count
    parent = np.where(is_root, np.arange(count), parent)
    turn = np.where(~is_root & (np.einsum("nd,nd->n", normal, normal[parent]) < 0), -1, 1)
    while (parent[parent] != parent).any():  # twice as far up in each turn
        turn, parent = turn * turn[parent], parent[parent]
    normal = normal * turn[:, None]
    middle = np.stack([np.bincount(piece, axis) for axis in point.T], 1) / np.bincount(piece)[:, None]
    outward = np.bincount(piece, np.einsum("nd,nd->n", normal, point - middle[piece]))
    return np.asarray(normal * np.where(outward < 0, -1, 1)[piece, None])


def _stars(point: _Points, normal: _Points, weight: Array, rows: Ints, near: Ints) -> Ints:
    """Return the triangles (t, 3) around some points, each with its point first.

    A neighbour at q shares a Delaunay edge with the point, the origin, if the middle line between both bounds the
    point's Voronoi cell: that is, if q ÷ |q|² is a corner of the convex hull of all neighbours, inverted so. Sorted by
    angle, one that lies on the origin's side of the line from its predecessor to its successor is none. Of four points
    on a circle, as on a grid, either diagonal would do; small weights of the points (a power diagram) choose the same
    one in all four stars.

    rows: (m,) the points. near: (m, k) their neighbours.
    """
    # Neighbours in the order of their angles in the plane across the normal, those of all points one after the other.
    offset = point[near] - point[rows, None]
    x, y = np.einsum("mkd,mad->amk", offset, view_axes(normal[rows])[:, :2])
    power = np.einsum("mkd,mkd->mk", offset, offset) + weight[rows, None] - weight[near]
    order = np.argsort(np.arctan2(y, x), axis=1) + np.arange(0, near.size, near.shape[1])[:, None]
    near, x, y = (column.ravel()[order.ravel()] for column in (near, x / power, y / power))
    star = np.repeat(np.arange(len(rows)), order.shape[1])
    while True:
        before, after = _ring(star)
        ax, ay, bx, by = x[before], y[before], x[after], y[after]
        square = x * x + y * y
        longest = np.maximum(square[before], square[after])
        inside = (bx - ax) * (y - ay) - (by - ay) * (x - ax) > -_SAME * longest
        # Of neighbours in the same direction the nearest stays, and so does one beside a gap of half a turn.
        farther = square < longest
        kept = ~(inside & farther & (before != after) & (ax * by - ay * bx > -_SAME * (ax * bx + ay * by)))
        if kept.all():
            break
        near, x, y, star = near[kept], x[kept], y[kept], star[kept]
    narrow = x * bx + y * by > _WIDEST * np.sqrt(square * square[after])
    corner = np.flatnonzero(narrow & (x * by - y * bx > 0))
    return np.stack([rows[star[corner]], near[corner], near[after[corner]]], axis=1)


def _ring(star: Ints) -> tuple[Ints, Ints]:
    """Return the places, before and after each (n,), of its neighbours in its star: runs of equal numbers (n,)."""
    last = np.flatnonzero(np.diff(star, append=-1))
    first = np.concatenate([[0], last[:-1] + 1])
    before, after = np.arange(-1, len(star) - 1), np.arange(1, len(star) + 1)
    before[first], after[last] = last, first
    return before, after
