"""Tabulate the scene's assets for planning: bounds, levels of detail and index ranges."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import square_texel
from depthwalk.bake.images import BakedObject, Face
from depthwalk.cook.cases import BOTTOM_PIECE, PAPER_SIDE, PIECES, RANGES, piece_runs
from depthwalk.cook.cook import CookedObject
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.geometry.bounding_hull import CORNERS
from depthwalk.ingest.mesh import MeshLevel
from depthwalk.render.impostors.warp_planes import Volumes
from depthwalk.render.lod.mesh_fallback import MeshFallbacks
from depthwalk.render.lod.mesh_lod import MeshLevels
from depthwalk.render.resources.cooked_parts import CookedParts
from depthwalk.render.resources.library import Library
from depthwalk.render.view.bounds import outside
from depthwalk.scene.arrays import SIMPLIFIED, Objects, Representation
from depthwalk.types import Array, Ints, Mask, Rows


@dataclass(frozen=True, kw_only=True, eq=False)
class AssetTable:
    """Hold what planning needs of meshes and depth objects; `a` is how many numbers `CookedParts` gives them.

    A depth object is the depth images of one part of an asset.

    Attributes
    ----------
    volumes : the cylinders of the depth objects.
    texel : (a,) edge of a texel of the side image, metres.
    levels : (a,) number of the coarsest level of detail.
    centre : (a, 3) centres of the bounding spheres, metres, object frames.
    bounding_radius : (a,) radii of the bounding spheres, metres.
    half_height : (a,) half the height of an upright cylinder about the same centre that encloses the asset, metres.
    cylinder_radius : (a,) radius of that cylinder, metres.
    index_first : (a, levels, RANGES) first index of each range of indices, see `LodGeometry`.
    index_count : (a, levels, RANGES) number of indices of each range.
    horizon : (a, levels, PIECES, 4) metres, for culling pieces that face away, see `piece_horizons`.
    triangles : (a, levels) number of triangles of all pieces.
    error : (a, levels) geometric error, metres, see `LodGeometry`; +inf where the object has no such level.
    meshes : the levels of detail of the meshes.
    mesh_fallbacks : which of the meshes may replace which depth objects.
    full_triangles : number of triangles of all objects' full meshes, or of the meshes that their depth images were
        baked from. For pictures with depth it is not known, and counts as 0.
    clusters : the clusters of the meshes that are drawn by clusters, by number.
    """

    volumes: Volumes
    texel: Array
    levels: Ints
    centre: Array
    bounding_radius: Array
    half_height: Array
    cylinder_radius: Array
    index_first: Ints
    index_count: Ints
    horizon: Array
    triangles: Ints
    error: Array
    meshes: MeshLevels
    mesh_fallbacks: MeshFallbacks
    full_triangles: int
    clusters: dict[int, MeshClusters] = field(default_factory=dict)

    @cached_property
    def area(self) -> Array:
        """Return the areas (a,) of the cylinders of the depth objects, seen from the side, square metres."""
        return 2 * self.volumes.radius * (self.volumes.top - self.volumes.bottom)

    @cached_property
    def has_paper_cases(self) -> Mask:
        """Return which (a,) depth objects have their triangles in the ranges of the paper's cases, see `cook.cases`.

        Depth images that were cooked before (a scene names their file) have the renderer's own pieces of the side.
        """
        return np.asarray(~self.index_count[:, :, PAPER_SIDE + 1 : BOTTOM_PIECE].any((1, 2)))

    @cached_property
    def _known_runs(self) -> dict[tuple[int, int, int], tuple[tuple[int, int], ...]]:
        """Return the cache of `runs`."""
        return {}

    def runs(self, asset: int, level: int, pieces: int) -> tuple[tuple[int, int], ...]:
        """Return the runs of an asset's indices that draw `pieces` of a level, see `cook.cases.piece_runs`.

        Parameters
        ----------
        asset : the number in `CookedParts`.
        level : the level of detail.
        pieces : bit mask of the pieces.

        Returns
        -------
        A pair for each run, its first index and its number of indices.
        """
        key = asset, level, pieces
        if key not in self._known_runs:
            self._known_runs[key] = piece_runs(self.index_first[key[:2]], self.index_count[key[:2]], pieces)
        return self._known_runs[key]

    def nearest(self, asset: Rows, viewer: Array) -> Array:
        """Return the distances of viewers from the cylinders that enclose n objects.

        Parameters
        ----------
        asset : (n,) number of each object's asset in `CookedParts`.
        viewer : (n, 3) the viewer in each object's frame, metres.

        Returns
        -------
        (n,) metres in the objects' frames.
        """
        return outside(viewer, self.centre[asset], self.half_height[asset], self.cylinder_radius[asset])


def asset_table(objects: Objects, library: Library, parts: CookedParts, fallbacks: bool = True) -> AssetTable:
    """Return the table of all numbers of `parts`, filled in for the assets that `objects` use.

    Parameters
    ----------
    objects : the objects, whose `asset` holds numbers of `parts`.
    library : provides the assets.
    parts : numbers the parts that are drawn, and cooks them.
    fallbacks : whether meshes may replace depth images.

    Returns
    -------
    The table, in which the rows of unused numbers mean nothing.
    """
    meshes = _used_meshes(objects, library)
    used = [number for number in np.unique(objects.asset).tolist() if number >= len(library)]
    cooked = {number: parts.cooked(number) for number in used}
    volumes, texel = _volumes(len(parts), cooked)
    replacing = _mesh_fallbacks(objects, library, parts) if fallbacks else MeshFallbacks.empty(len(parts))
    enclosing = _Enclosing.empty(len(parts))
    for number, levels in meshes.items():
        enclosing.put_mesh(number, levels)
    for number, depth_object in cooked.items():
        enclosing.put_depth_object(number, depth_object.outline)
    enclosing.put_fallbacks(replacing, list(meshes))
    index_first, index_count, horizon, error = _level_columns(len(parts), cooked)
    levels_of_detail = np.zeros(len(parts), np.int64)
    levels_of_detail[used] = [len(depth_object.error) - 1 for depth_object in cooked.values()]
    mesh_levels = MeshLevels.empty(len(parts))
    for number, levels in meshes.items():
        mesh_levels.add(number, levels)
    return AssetTable(
        volumes=volumes,
        texel=texel,
        levels=levels_of_detail,
        centre=enclosing.centre,
        bounding_radius=enclosing.bounding_radius,
        half_height=enclosing.half_height,
        cylinder_radius=enclosing.cylinder_radius,
        index_first=index_first,
        index_count=index_count,
        horizon=horizon,
        triangles=index_count[:, :, :PIECES].sum(-1) // 3,
        error=error,
        meshes=mesh_levels,
        mesh_fallbacks=replacing,
        full_triangles=_full_triangles(objects, meshes, cooked, parts),
        clusters=_used_clusters(objects, library),
    )


@dataclass(frozen=True, kw_only=True)
class _Enclosing:
    """Hold the columns of `AssetTable` with the assets' bounds, while they are filled in."""

    centre: NDArray[np.float64]
    bounding_radius: NDArray[np.float64]
    half_height: NDArray[np.float64]
    cylinder_radius: NDArray[np.float64]

    @classmethod
    def empty(cls, count: int) -> "_Enclosing":
        """Return columns of `count` zeros."""
        centre, (radius, half_height, cylinder_radius) = np.zeros((count, 3)), np.zeros((3, count))
        return cls(centre=centre, bounding_radius=radius, half_height=half_height, cylinder_radius=cylinder_radius)

    def put_mesh(self, number: int, levels: tuple[MeshLevel, ...]) -> None:
        """Enclose a mesh: the sphere holds the mesh itself, the cylinder all of its simplified `levels` too."""
        low, high = levels[0].mesh.bounds
        centre = np.asarray((low + high) / 2, np.float64)
        self.centre[number] = centre
        self.bounding_radius[number] = np.linalg.norm(levels[0].mesh.positions - centre, axis=1).max()
        x, y, z = np.abs(np.concatenate([level.mesh.positions for level in levels]) - centre).T
        self.half_height[number], self.cylinder_radius[number] = y.max(), np.hypot(x, z).max()

    def put_depth_object(self, number: int, baked: BakedObject) -> None:
        """Enclose a depth object by its cylinder, or by the box within that."""
        cylinder = baked.cylinder
        self.centre[number] = 0, (cylinder.bottom + cylinder.top) / 2, 0
        self.half_height[number] = cylinder.height / 2
        self.cylinder_radius[number] = min(cylinder.radius, np.hypot(cylinder.half_width, cylinder.half_depth))
        self.bounding_radius[number] = np.hypot(self.half_height[number], self.cylinder_radius[number])

    def put_fallbacks(self, fallbacks: MeshFallbacks, known: list[int]) -> None:
        """Bound meshes that may replace depth objects as these are, except meshes whose own bounds are `known`."""
        rows = np.flatnonzero((fallbacks.mesh >= 0) & ~np.isin(fallbacks.mesh, known))
        mesh, half_height, radius = fallbacks.mesh[rows], fallbacks.half_height[rows], fallbacks.cylinder_radius[rows]
        self.centre[mesh], self.half_height[mesh], self.cylinder_radius[mesh] = (
            fallbacks.centre[rows],
            half_height,
            radius,
        )
        self.bounding_radius[mesh] = np.hypot(half_height, radius)


def _used_meshes(objects: Objects, library: Library) -> dict[int, tuple[MeshLevel, ...]]:
    """Return the meshes that `objects` use, by number; with all levels of detail if they are drawn simplified."""
    simplified = set(objects.asset[np.isin(objects.representation, SIMPLIFIED)].tolist())
    levels: dict[int, tuple[MeshLevel, ...]] = {}
    for number in np.unique(objects.asset[objects.asset < len(library)]).tolist():
        mesh = library.drawn_mesh(number)
        if mesh is not None:
            levels[number] = library.mesh_levels(number) if number in simplified else (MeshLevel(mesh, 0.0),)
    return levels


def _full_triangles(
    objects: Objects, meshes: dict[int, tuple[MeshLevel, ...]], cooked: dict[int, CookedObject], parts: CookedParts
) -> int:
    """Return `AssetTable.full_triangles` of `objects`, which use these meshes and depth objects, by number."""
    counts = np.zeros(len(parts), np.int64)
    for number, levels in meshes.items():
        counts[number] = len(levels[0].mesh.faces)
    for number, depth_object in cooked.items():
        if number == parts.numbers(parts.asset_of(number)).start:  # each part holds the count of the whole mesh
            counts[number] = depth_object.outline.mesh_triangles or 0
    return int(counts[objects.asset].sum())


def _used_clusters(objects: Objects, library: Library) -> dict[int, MeshClusters]:
    """Return the clusters of the meshes that `objects` draw by clusters, by number."""
    used = np.unique(objects.asset[objects.representation == Representation.MESH_CLUSTERS]).tolist()
    found = ((number, library.mesh_clusters(number)) for number in used)
    return {number: clusters for number, clusters in found if clusters is not None}


def _volumes(count: int, cooked: dict[int, CookedObject]) -> tuple[Volumes, NDArray[np.float64]]:
    """Return `AssetTable.volumes` and `texel` for `count` numbers, of which `cooked` are depth objects."""
    columns = {name: np.zeros(count) for name in ("radius", "bottom", "top")}
    hull, has_side, texel = np.zeros((count, CORNERS, 3)), np.zeros(count, bool), np.ones(count)
    for number, depth_object in cooked.items():
        baked = depth_object.outline
        for name, column in columns.items():
            column[number] = getattr(baked.cylinder, name)
        hull[number] = depth_object.hull
        has_side[number] = any(image.face is Face.SIDE for image in baked.images)
        texel[number] = square_texel(baked)
    return Volumes(**columns, hull=hull, has_side=has_side), texel


def _level_columns(
    count: int, cooked: dict[int, CookedObject]
) -> tuple[Ints, Ints, NDArray[np.float64], NDArray[np.float64]]:
    """Return `AssetTable.index_first`, `index_count`, `horizon` and `error` for `count` numbers.

    cooked: those of them that are depth objects.
    """
    most_levels = max((len(depth_object.error) for depth_object in cooked.values()), default=1)
    index_first, index_count = np.zeros((2, count, most_levels, RANGES), np.int64)
    horizon, error = np.full((count, most_levels, PIECES, 4), np.inf), np.full((count, most_levels), np.inf)
    for number, depth_object in cooked.items():
        row = number, slice(len(depth_object.error))
        index_first[row], index_count[row] = depth_object.first, depth_object.count
        horizon[row], error[row] = depth_object.horizon, depth_object.error
    return index_first, index_count, horizon, error


def _mesh_fallbacks(objects: Objects, library: Library, parts: CookedParts) -> MeshFallbacks:
    """Return the meshes that may replace `objects`: where depth images show a mesh, and no meso-structure on it."""
    fallbacks = MeshFallbacks.empty(len(parts))
    imaged = np.unique(objects.asset[objects.asset >= parts.first])
    for asset in np.unique([parts.asset_of(number) for number in imaged.tolist()]).astype(int).tolist():
        numbers = parts.numbers(asset)
        outlines = [parts.cooked(number).outline for number in numbers]
        if library.has_mesh(asset) and all(outline.meso is None for outline in outlines):
            fallbacks.add(asset, numbers, outlines)
    return fallbacks
