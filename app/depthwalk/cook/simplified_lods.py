"""Levels of an object: one surface over all of its faces, with ever fewer triangles.

Grids end at every edge, in borders, and overlap where owners meet: two thirds of their triangles are there, however
smooth the surface. Here it is simplified as a whole. Shading still comes from the depth images: each triangle looks
into the one that holds it best.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import square_texel
from depthwalk.bake.images import BakedObject
from depthwalk.cook.cases import RANGES, piece_horizons, piece_numbers
from depthwalk.cook.edge_collapse import (
    ClusteredSurface,
    cluster_vertices,
    collapse_edges,
    surface_of,
    vertex_directions,
)
from depthwalk.cook.foliage_dilation import spread, voxels
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.cook.index_chunks import MOST_VERTICES
from depthwalk.cook.lod_geometry import BORDER, POSITION_STEPS, LodGeometry, vertex_positions
from depthwalk.cook.sharp_features import find_sharp_features
from depthwalk.cook.view_selection import NOWHERE, select_views
from depthwalk.geometry.spatial_order import morton
from depthwalk.geometry.triangles import face_normals, row_ids, sample_triangles
from depthwalk.geometry.vectors import lengths
from depthwalk.parallel import Map, batches, thread_map
from depthwalk.types import Array, Ints

_SAME = 0.01  # texels, within which points are one, in the levels that show all that the images hold
_FINE_TOLERANCES = 0.35, 0.7  # texels, of these, see `collapse_edges`
_BETWEEN = 0.5  # texels, of one more of what is dense, of which the second has a sixth of the triangles, or is none
_DENSE_TOLERANCES = 1.0, 1.4  # texels, of more such where all others have far fewer triangles, as of foliage
_DENSE = 2.5  # triangles per texel of an image: more than are drawn where a texel is a pixel
_CUBE = 0.5  # texels: foliage is made to meet as many cubes of this side as it did
_SHARPEST = 0.18  # texels, which are pixels where meshes begin to stand in: nobody sees less, nor do shadows show it
_WELD = 2.0  # texels, within which points become one in all others
_FIRST_TOLERANCE = 1.0  # texels, of the first of them
_LEFT = 0.75  # of the area that a welded level has: with less, what is not welded is no level
_GROWTH = 2**0.5  # from one to the next: leaves somewhat more than half of the triangles
_COARSE = 13  # of them at most
_FEWEST = 24  # triangles that are worth a level
_WORTH = 0.65  # of the finer level's triangles: with more than that it is no level of its own
_SMOOTH = 0.5  # cosine: edges between whose ends the surface turns further cross a crease, which is no arc
_PROBES, _DISCS = 8_000, 20_000  # samples, and discs on a level, at least, that tell how far apart they are
_IMAGES = 1 << 16  # more than the numbers of images with their flags, which fit into 16 bits
_SHARE = 0.98  # of the samples, which are no farther off than a level's error


def build_simplified_lods(baked: BakedObject) -> LodGeometry:
    """The arrays of `baked`, for all faces, in levels by geometric error. Objects with meso-structure, which displaces
    every sample, have all their grids instead."""
    if baked.meso is not None:
        return build_grid_lods(baked)
    grid = build_grid_lods(replace(baked, steps=1), in_pieces=False)
    triangles = grid.indices.reshape(-1, 3).astype(np.int64)
    point, yields = grid.positions, grid.vertices[:, 3] & BORDER > 0
    most = _DENSE * baked.images[0].depth.size
    # Ends of surfaces first, or what is flat would shrink by as much as is welded; what another face owns last.
    rank = np.where(grid.texels[:, 0] < 0, 0, np.where(yields, 2, 1))
    with thread_map() as each:
        surfaces = list(_surfaces(point, triangles, rank, square_texel(baked), most, each))
    if len(surfaces[0][0].triangles) > most:  # foliage
        side = _CUBE * square_texel(baked)
        wanted = voxels(point[triangles], side)
        levels = [spread(surface, wanted, side, off)[surface.triangles] for surface, off in surfaces]
    else:
        levels = [surface.point[surface.triangles] for surface, _ in surfaces]
    used = np.zeros(len(point), bool)
    used[triangles] = True
    samples = np.flatnonzero(used & ~yields)
    probes = point[np.random.default_rng(0).permutation(samples)[:_PROBES]]
    error = np.maximum.accumulate([_deviation(probes, corners) for corners in levels])
    # Of foliage nobody would ever see the finest, and two thirds of the memory would go to that.
    sharp = _SHARPEST * square_texel(baked)
    needless = [len(corners) > most and off <= sharp for corners, off in zip(levels, error[1:], strict=False)]
    finest = [*needless, False].index(False)
    return _as_grids(grid, baked, levels[finest:], error[finest:])


def _bulged(point: Array, triangles: Ints) -> Array:
    """Points (n, 3) of the surface of triangles (t, 3), moved outward by as much as that passes below the arcs through
    them: samples lie on the surface, so triangles between them lie within what is convex and make it too thin.

    Over a triangle the mean height of the arcs is that over the middles of its edges.
    """
    facing = vertex_directions(point, triangles)
    normal = facing / np.maximum(lengths(facing), 1e-30)[:, None]
    height, edges = np.zeros((2, len(point)))
    for ends in triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]:
        (start, end), (one, other) = point[ends].swapaxes(0, 1), normal[ends].swapaxes(0, 1)
        smooth = np.einsum("ij,ij->i", one, other) > _SMOOTH
        above = np.where(smooth, np.einsum("ij,ij->i", end - start, other - one) / 8, 0)
        for vertex in ends.T:
            height += np.bincount(vertex, above, len(point))
            edges += np.bincount(vertex, minlength=len(point))
    return np.asarray(point + (height / np.maximum(edges, 1))[:, None] * normal)


def _surfaces(
    point: Array, triangles: Ints, rank: Ints, texel: float, most: float, each: Map
) -> Iterator[tuple[ClusteredSurface, float]]:
    """One level after the other, and its tolerance, metres.

    point (n, 3), triangles (t, 3): of the grid; rank (n,): see `cluster_vertices`; most: triangles, foliage has more.
    """
    surface = collapse_edges(_joined(point, triangles, rank, _SAME * texel), _FINE_TOLERANCES[0] * texel, each)
    dense = len(surface.triangles) > most
    welded = _welded(point, triangles, rank, _WELD * texel, arcs=not dense)  # leaves that became one are on none
    coarse = collapse_edges(welded, _FIRST_TOLERANCE * texel, each)
    between = (_BETWEEN,) if dense else ()
    for tolerance in sorted(_FINE_TOLERANCES + between + _DENSE_TOLERANCES):
        if tolerance > _FINE_TOLERANCES[0]:
            surface = collapse_edges(surface, tolerance * texel, each)
        # Leaves of a texel's size go from the one as they are contracted, and hold together in the other.
        if tolerance > _FINE_TOLERANCES[0] and surface.area <= _LEFT * coarse.area:
            break
        if tolerance in _DENSE_TOLERANCES and len(coarse.triangles) > _WORTH * len(surface.triangles):
            break
        before = len(surface.triangles)
        yield surface, tolerance * texel
    for level in range(_COARSE):
        if len(coarse.triangles) < _FEWEST:
            return
        tolerance = _FIRST_TOLERANCE * _GROWTH**level * texel
        if len(coarse.triangles) <= _WORTH * before:
            before = len(coarse.triangles)
            yield coarse, tolerance
        coarse = collapse_edges(coarse, _GROWTH * tolerance, each)


def _joined(point: Array, triangles: Ints, rank: Ints, cell: float) -> ClusteredSurface:
    """See `cluster_vertices`. Bulged, and drawn into the ridges between samples, which are too far apart for that in `_welded`."""
    point, triangles = cluster_vertices(point, triangles, rank, cell)
    return surface_of(_bulged(point, triangles), triangles, find_sharp_features(point, triangles))


def _welded(point: Array, triangles: Ints, rank: Ints, cell: float, arcs: bool = True) -> ClusteredSurface:
    """See `cluster_vertices`. Bulged only then, if `arcs`: between what is left they are longer and higher than between samples."""
    point, triangles = cluster_vertices(point, triangles, rank, cell)
    return surface_of(_bulged(point, triangles) if arcs else point, triangles)


def _deviation(probes: Array, corners: Array) -> float:
    """How far most of the points `probes` (n, 3) are at most from triangles (t, 3, 3), metres. Discs that just overlap
    stand for these, which is right within a disc's radius beside the nearest one, and exact above it."""
    from scipy.spatial import cKDTree

    count = max(_DISCS, 2 * len(corners))
    middle, normal = sample_triangles(corners, count)
    away, nearest = cKDTree(middle, compact_nodes=False, balanced_tree=False).query(probes)
    above = np.einsum("ij,ij->i", probes - middle[nearest], normal[nearest])
    beside = np.sqrt(np.maximum(away**2 - above**2, 0))
    radius = 2 * np.sqrt(face_normals(corners)[1].sum() / count)
    return float(np.quantile(np.hypot(above, np.maximum(beside - radius, 0)), _SHARE))


def _as_grids(grid: LodGeometry, baked: BakedObject, levels: list[Array], error: Array) -> LodGeometry:
    """Levels of triangles (t, 3, 3) over the box of `grid`."""
    with thread_map() as each:
        images = select_views(baked, np.concatenate(levels), each)
    ends = np.cumsum([len(corners) for corners in levels])
    vertices: list[NDArray[np.uint16]] = []
    indices: list[NDArray[np.uint16]] = []
    counts: list[Ints] = []  # of levels, indices of each range
    horizons: list[Array] = []
    for corners, image in zip(levels, np.split(images, ends[:-1]), strict=True):
        position = np.round(np.clip((corners - grid.box_low) / grid.box_size, 0, 1) * POSITION_STEPS).astype(np.uint16)
        placed = vertex_positions(position.reshape(-1, 3), grid.box_low, grid.box_size).reshape(-1, 3, 3)
        piece = piece_numbers(placed)
        # Neighbours together: a vertex is shaded once for all its triangles.
        order = np.lexsort((morton(corners.mean(1)), piece))
        order = order[image[order] != NOWHERE]
        counts.append(3 * np.bincount(piece[order], minlength=RANGES))
        horizons.append(piece_horizons(placed[order], piece[order]))
        for shared, numbers in _chunks(position[order], image[order]):
            vertices.append(shared)
            indices.append(numbers)
    chunks = np.array([[0, 0], *([part.size, len(shared)] for part, shared in zip(indices, vertices, strict=True))])
    count = np.array(counts)
    first = (np.cumsum(count) - count.ravel()).reshape(count.shape)
    texels = np.full((sum(map(len, vertices)), 2), -1, np.int16)
    return replace(
        grid,
        vertices=np.concatenate(vertices),
        texels=texels,
        indices=np.concatenate(indices),
        chunks=chunks[:-1].cumsum(0),
        first=first,
        count=count,
        horizon=np.array(horizons),
        error=error,
    )


def _chunks(position: NDArray[np.uint16], image: Ints) -> Iterator[tuple[NDArray[np.uint16], NDArray[np.uint16]]]:
    """Vertices and indices of each chunk of triangles at `position` (t, 3, 3) that look into `image` (t,)."""
    for some in batches(len(position), MOST_VERTICES):
        vertices, numbers = _share_vertices(position[some], image[some])
        if len(vertices) <= MOST_VERTICES:
            yield vertices, numbers.ravel().astype(np.uint16)
        else:
            half = some.start + (some.stop - some.start) // 2
            for part in slice(some.start, half), slice(half, some.stop):
                yield from _chunks(position[part], image[part])


def _share_vertices(position: NDArray[np.uint16], image: Ints) -> tuple[NDArray[np.uint16], Ints]:
    """Vertices (v, 4) as in `LodGeometry`, in the order of their first use, and the numbers (t, 3) of those at `position`
    (t, 3, 3), each triangle turned so that its last, provoking one has its `image` (t,).

    A point has the image of most of its triangles; those that find none of theirs there get a vertex of their own.
    """
    corner, first = row_ids((position.reshape(-1, 3) @ (1 << 32, 1 << 16, 1))[:, None])
    corner, points = corner.reshape(-1, 3), position.reshape(-1, 3)[first]
    pairs, uses = np.unique(corner * _IMAGES + image[:, None], return_counts=True)
    own = np.zeros(len(points), np.int64)
    rising = np.argsort(uses, kind="stable")
    own[pairs[rising] // _IMAGES] = pairs[rising] % _IMAGES  # the last written stays
    last = (own[corner] == image[:, None]).argmax(1)  # 0 where none is
    corner = np.take_along_axis(corner, (np.arange(3) + last[:, None] + 1) % 3, axis=1)
    looks = own[corner]
    looks[:, 2] = image
    number, first = row_ids((corner * _IMAGES + looks).reshape(-1, 1))
    by_use = np.argsort(first)
    vertices = np.column_stack([points[corner.ravel()[first]], looks.ravel()[first]])[by_use].astype(np.uint16)
    return vertices, np.argsort(by_use)[number.reshape(-1, 3)]
