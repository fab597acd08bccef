"""Build levels of an object as one simplified surface over all of its faces, with ever fewer triangles.

Grids end at every edge of a surface, in boundary strips, and overlap where ownership changes from face to face: two
thirds of their triangles are there, however smooth the surface. Here the finest grids are merged into one surface
(`vertex_clustering`), which is simplified as a whole (`edge_collapse`); where sheets of it still end before each
other, slits are closed (`slit_closing`). Shading still comes from the depth images: each triangle looks into the one
that shows it best (`view_selection`).
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain
from typing import NamedTuple

import numpy as np

from depthwalk.bake.face_grid import square_texel
from depthwalk.bake.images import BakedObject
from depthwalk.cook.edge_collapse import collapse_edges
from depthwalk.cook.foliage_dilation import FoliageCover
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.cook.hole_filling import fill_holes
from depthwalk.cook.indexed_lods import index_levels
from depthwalk.cook.lod_geometry import BORDER, LodGeometry
from depthwalk.cook.quadrics import ClusteredSurface, clustered_surface
from depthwalk.cook.sharp_features import find_sharp_features
from depthwalk.cook.slit_closing import close_slits
from depthwalk.cook.vertex_clustering import cluster_vertices, kept_vertices
from depthwalk.cook.view_selection import select_views
from depthwalk.geometry.indexed_triangles import opposite_edges, vertex_directions
from depthwalk.geometry.triangles import face_normals, sample_triangles
from depthwalk.geometry.vectors import lengths
from depthwalk.parallel import Map, begin
from depthwalk.types import Array, Ints, Mask

# Tolerances and sizes are in texels, which are pixels where an object appears as large as its images.
_FINE_VOXEL = 0.01  # within which vertices are merged, in the levels that show all the detail of the images
_FINE_TOLERANCES = 0.35, 0.7  # of those, see `collapse_edges`
_BETWEEN = 0.5  # of an extra one for foliage, whose second has a sixth of the triangles, or is missing
_FOLIAGE_TOLERANCES = 1.0, 1.4  # of further ones if all other levels have far fewer triangles, as with foliage
_FOLIAGE_DENSITY = 2.5  # triangles per texel of an image: more than are drawn where a texel is a pixel
_DILATION_VOXEL = 0.5  # edge of voxels, of which dilated foliage touches as many as before
_SHARPEST = 0.18  # where meshes begin to replace the images: finer levels are never seen, not even in shadows
# Within which vertices are merged, in all other levels. Folds that are narrower tear; for leaves, less than two texels
# gave no better picture for as many triangles.
_COARSE_VOXEL, _FOLIAGE_VOXEL = 0.9, 2.0
_COARSE_TOLERANCE = 1.0  # of the first of those
_HOLE = 12.0, 12  # longest rim of a hole that those close, and its most edges: of 16, it may be the open end of a pleat
_FINE_HOLE = 24.0, 24  # of the levels that show all the detail
_LEAFY = 4.0  # times the triangles that only foliage has left: a grid with more is of leaves, whose holes are real
_GROWTH = 2**0.5  # from one to the next: leaves somewhat more than half of the triangles
_COARSE_LEVELS = 13  # at most
# Of a level's tolerance: voxels within which leaves are merged, and tolerances of the merged ones. All are tried.
_REMERGED = (1.0, (1.0, 0.5)), (0.5, (1.0,))
_MIN_AREA = 0.75  # of the area of the first coarse level: a fine surface with less is not used as a level
_MIN_TRIANGLES = 24  # fewest triangles of a level
_MAX_SHARE = 0.65  # of the finer level's triangles: a surface with more is not worth a level
_END = 0  # rank of vertices at the ends of surfaces, see `cluster_vertices`
_SMOOTH = 0.5  # cosine: where the surface turns further along an edge, this crosses a crease and is not an arc
_PROBES, _DISCS = 8_000, 20_000  # samples, and fewest discs on a level, for measuring the distance between them
_QUANTILE = 0.98  # of the samples, which are within a level's error
# Least error of a level relative to its tolerance. Most levels measure a third. Where all is flat, samples show no
# error at all, while the corners of a sheet or a card may be off by the whole tolerance.
_LEAST_ERROR = 0.15


def build_simplified_lods(baked: BakedObject, parallel: Map = map) -> LodGeometry:
    """Build the levels of an object by geometric error, each one surface over all faces.

    An object with meso-structure, which displaces every sample, gets all its grids instead.

    Parameters
    ----------
    baked
        The depth images of the object, object frame.
    parallel
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    LodGeometry
        The levels, the finest first.
    """
    if baked.meso is not None:
        return build_grid_lods(baked)
    grid = build_grid_lods(replace(baked, steps=1), in_pieces=False, parallel=parallel)
    levels, error = _simplify(baked, grid, parallel)
    views = select_views(baked, np.concatenate(levels), parallel)
    return index_levels(grid, levels, views, error, parallel)


def _simplify(baked: BakedObject, grid: LodGeometry, parallel: Map) -> tuple[list[Array], Array]:
    """Return triangles (t, 3, 3) of each level, metres, and the levels' errors (levels,), metres.

    grid: the object's grids of step 1.
    """
    texel = square_texel(baked)
    triangles = grid.indices.reshape(-1, 3).astype(np.int64)
    point, yields = grid.positions, grid.vertices[:, 3] & BORDER > 0
    most = _FOLIAGE_DENSITY * baked.images[0].depth.size
    # Ends of surfaces first, otherwise flat parts would shrink by a voxel; what another face owns last.
    rank = np.where(grid.texels[:, 0] < 0, _END, np.where(yields, 2, 1))
    used = np.zeros(len(point), bool)
    used[triangles] = True
    probes = point[np.random.default_rng(0).permutation(np.flatnonzero(used & ~yields))[:_PROBES]]
    cover = FoliageCover(point, triangles, _DILATION_VOXEL * texel)
    surfaces = _surfaces(point, triangles, rank, texel, most, cover, parallel)
    finest_surface = next(surfaces)
    foliage = len(finest_surface.surface.triangles) > most

    def measured(level: _Level) -> tuple[Array, float]:
        surface, tolerance, corners = level.surface, level.tolerance, level.dilated
        if corners is None:
            corners = cover.restored(surface, tolerance) if foliage else surface.point[surface.triangles]
        # Slits are closed afterwards: the probes, none of which is in a slit, say nothing about what closes it.
        error = max(_deviation(probes, corners), _LEAST_ERROR * tolerance)
        return corners if foliage else _without_slits(surface, texel), error

    # Threads measure a level while the next one is built.
    levels, deviations = zip(*parallel(measured, chain([finest_surface], surfaces)), strict=True)
    error = np.maximum.accumulate(deviations)
    # The finest level of foliage would never be seen, and would take two thirds of the memory.
    needless = [
        len(corners) > most and next_error <= _SHARPEST * texel
        for corners, next_error in zip(levels, error[1:], strict=False)
    ]
    finest = [*needless, False].index(False)
    return list(levels[finest:]), error[finest:]


def _without_slits(surface: ClusteredSurface, texel: float) -> Array:
    """Return the triangles (t, 3, 3), metres, of a surface whose slits are closed; texel: metres."""
    point, triangles = close_slits(surface.point, surface.triangles, texel)
    return point[triangles]


class _Level(NamedTuple):
    """A level whose error is not known yet: a surface and its tolerance, metres.

    dilated: its triangles (t, 3, 3) after dilation, metres, where they have been needed already.
    """

    surface: ClusteredSurface
    tolerance: float
    dilated: Array | None = None


def _surfaces(
    point: Array, triangles: Ints, rank: Ints, texel: float, most: float, cover: FoliageCover, parallel: Map
) -> Iterator[_Level]:
    """Yield the levels, finest first.

    point (n, 3), triangles (t, 3): of the grid; rank (n,): see `cluster_vertices`; texel: metres; most: a number of
    triangles that only foliage exceeds; cover: of the grid.
    """

    def clustered(voxel: float) -> tuple[Array, Ints]:
        return cluster_vertices(point, triangles, rank, voxel * texel)

    is_leafy = len(triangles) > _LEAFY * most

    def closed(surface_point: Array, surface_triangles: Ints, hole: tuple[float, int]) -> Ints:
        return surface_triangles if is_leafy else fill_holes(surface_point, surface_triangles, hole[0] * texel, hole[1])

    def coarse_levels() -> list[_Level]:
        coarse_point, coarse_triangles = clustered(_COARSE_VOXEL)
        coarse = _coarse_surface(coarse_point, closed(coarse_point, coarse_triangles, _HOLE))
        return _coarse_levels(coarse, texel, parallel)

    coarse_beside = begin(coarse_levels, parallel)
    kept, fine_triangles = kept_vertices(point, triangles, rank, _FINE_VOXEL * texel)
    fine_point = point[kept].astype(np.float64)
    fine = _fine_surface(fine_point, closed(fine_point, fine_triangles, _FINE_HOLE), rank[kept] == _END, parallel)
    fine = collapse_edges(fine, _FINE_TOLERANCES[0] * texel, parallel)
    foliage = len(fine.triangles) > most
    coarse = _foliage_levels(clustered, texel, cover, parallel) if foliage else coarse_beside()
    coarsest = coarse[0].surface
    between = (_BETWEEN,) if foliage else ()
    for tolerance in sorted(_FINE_TOLERANCES + between + _FOLIAGE_TOLERANCES):
        if tolerance > _FINE_TOLERANCES[0]:
            fine = collapse_edges(fine, tolerance * texel, parallel)
        # Leaves of a texel's size vanish from the fine one as their edges collapse, and stay whole in the coarse one.
        if tolerance > _FINE_TOLERANCES[0] and fine.area <= _MIN_AREA * coarsest.area:
            break
        if tolerance in _FOLIAGE_TOLERANCES and len(coarsest.triangles) > _MAX_SHARE * len(fine.triangles):
            break
        before = len(fine.triangles)
        yield _Level(fine, tolerance * texel)
    for level in coarse:
        count = len(level.surface.triangles)
        if count < _MIN_TRIANGLES:
            return
        if count <= _MAX_SHARE * before:
            before = count
            yield level


def _coarse_levels(coarse: ClusteredSurface, texel: float, parallel: Map) -> list[_Level]:
    """Return a surface at ever larger tolerances, metres, down to the first that has too few triangles for a level."""
    levels: list[_Level] = []
    for level in range(_COARSE_LEVELS):
        tolerance = _COARSE_TOLERANCE * _GROWTH**level * texel
        coarse = collapse_edges(coarse, tolerance, parallel)
        levels.append(_Level(coarse, tolerance))
        if len(coarse.triangles) < _MIN_TRIANGLES:
            break
    return levels


def _foliage_levels(
    clustered: Callable[[float], tuple[Array, Ints]], texel: float, cover: FoliageCover, parallel: Map
) -> list[_Level]:
    """Return the levels of foliage, as `_coarse_levels` does for other surfaces.

    Once only a few of many leaves are left, dilation cannot make up for the others, and crowns would become bare from
    afar. From there on, leaves are merged within voxels as large as the tolerance, or half as large, which leaves a
    closed surface.

    clustered: `cluster_vertices` of the grid, by the voxel in texels; texel: metres; cover: of the grid.
    """

    def merged(voxel: float) -> ClusteredSurface:
        return _coarse_surface(*clustered(voxel), bulged=False)  # merged leaves are not on an arc

    def coarser(finer: ClusteredSurface, tolerance: float) -> _Level | None:
        most = _MAX_SHARE * len(finer.triangles)
        collapsed = collapse_edges(finer, tolerance, parallel)
        if len(collapsed.triangles) > most:
            return None
        others: list[tuple[ClusteredSurface, Array]] = []
        for surface in chain([collapsed], remerged(tolerance)):
            if _MIN_TRIANGLES <= len(surface.triangles) <= most:
                corners = cover.restored(surface, tolerance)
                if cover.is_restored(corners):
                    return _Level(surface, tolerance, corners)
                others.append((surface, corners))
        whole = ((surface, corners) for surface, corners in others if cover.looks_restored(corners))
        return next((_Level(surface, tolerance, corners) for surface, corners in whole), None)

    def remerged(tolerance: float) -> Iterator[ClusteredSurface]:
        for voxel_share, tolerance_shares in _REMERGED:
            surface = merged(voxel_share * tolerance / texel)
            yield from (collapse_edges(surface, share * tolerance, parallel) for share in tolerance_shares)

    first, tolerance = merged(_FOLIAGE_VOXEL), _COARSE_TOLERANCE * texel
    levels = [_Level(collapse_edges(first, tolerance, parallel), tolerance)]
    for _ in range(1, _COARSE_LEVELS):
        tolerance *= _GROWTH
        level = coarser(levels[-1].surface, tolerance)
        if level is not None:
            levels.append(level)
    return levels


def _fine_surface(point: Array, triangles: Ints, at_end: Mask, parallel: Map) -> ClusteredSurface:
    """Return a finely clustered surface, bulged, and pulled into the ridges between samples.

    After coarse clustering, samples are too far apart to detect ridges. point, triangles: the result of
    `cluster_vertices`; at_end: (n,), vertices where a surface ends.
    """
    bulged = begin(lambda: _bulged(point, triangles), parallel)
    opposite = opposite_edges(triangles)
    features = find_sharp_features(point, triangles, opposite)
    return clustered_surface(bulged(), triangles, features, opposite, at_end)


def _coarse_surface(point: Array, triangles: Ints, bulged: bool = True) -> ClusteredSurface:
    """Return a coarsely clustered surface, bulged if asked for. The parameters are the result of `cluster_vertices`.

    It is bulged after clustering: the arcs between the remaining vertices are longer and higher than between samples.
    """
    return clustered_surface(_bulged(point, triangles) if bulged else point, triangles)


def _bulged(point: Array, triangles: Ints) -> Array:
    """Return the vertices (n, 3) of triangles (t, 3), moved outward by the mean height of the arcs through them.

    Samples lie on the surface, so triangles between them lie inside convex parts and make them too thin. Over a
    triangle, the mean height of the arcs is the mean over the midpoints of its edges.
    """
    facing = vertex_directions(point, triangles)
    normal = facing / np.maximum(lengths(facing), 1e-30)[:, None]
    height = np.zeros(len(point))
    corners = np.ascontiguousarray(triangles.T)
    places, normals = ([vectors.take(corner, 0) for corner in corners] for vectors in (point, normal))
    for start, end in (0, 1), (1, 2), (2, 0):
        smooth = np.einsum("ij,ij->i", normals[start], normals[end]) > _SMOOTH
        turn = np.einsum("ij,ij->i", places[end] - places[start], normals[end] - normals[start])
        above = np.where(smooth, turn / 8, 0)
        for vertex in corners[start], corners[end]:
            height += np.bincount(vertex, above, len(point))
    edges = 2 * np.bincount(corners.ravel(), minlength=len(point))  # two of each triangle meet in its corner
    return np.asarray(point + (height / np.maximum(edges, 1))[:, None] * normal)


def _deviation(probes: Array, corners: Array) -> float:
    """Return the distance, metres, within which most of the points `probes` (n, 3) are of triangles (t, 3, 3).

    Overlapping discs replace the triangles. Distances beside the nearest disc are accurate to within its radius, and
    those above it are exact.
    """
    from scipy.spatial import cKDTree

    count = max(_DISCS, 2 * len(corners))
    middle, normal = sample_triangles(corners, count)
    distance, nearest = cKDTree(middle, compact_nodes=False, balanced_tree=False).query(probes)
    above = np.einsum("ij,ij->i", probes - middle[nearest], normal[nearest])
    beside = np.sqrt(np.maximum(distance**2 - above**2, 0))
    radius = 2 * np.sqrt(face_normals(corners)[1].sum() / count)
    return float(np.quantile(np.hypot(above, np.maximum(beside - radius, 0)), _QUANTILE))
