"""Decide which grid triangles lie on the surface: the discontinuity cut, across layers (docs/baking.md).

A depth image is a height field only in part: at a silhouette its nearest surface jumps, and the surface behind
continues one layer deeper. So each corner of a triangle is taken from the layer that continues the depths of the
others, and the resulting triangles are tested against the mesh with rays.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.grid import cell_triangles, grid_cells
from depthwalk.bake.images import Face
from depthwalk.bake.raycast import RayCaster
from depthwalk.geometry.soa import StructOfArrays
from depthwalk.geometry.vectors import lengths
from depthwalk.parallel import Map, batches
from depthwalk.types import Array

# Cast a ray through a triangle's centre and measure how far the surface there is off the triangle's plane, relative to
# the triangle's depth range, or to a cell if that is _LONG. Above this it is dropped. Measured on five models: a slope
# has 0, a step 0.33 to 0.67.
CUT_TOLERANCE = 0.15
_LEAST_ALIGNMENT = 0.5  # cosine between a triangle and the surface hit through its centre: within 60°
# A wall may be off the mesh by this part of its shortest edge. At 1, walls stand off the surface like combs; below 0.3,
# rounded edges lose theirs at low resolution.
_WALL_SLACK = 0.4
_LONG = 4.0  # cells: depth range above which a triangle is tested more strictly
_MIDDLE = np.full(3, 1 / 3)
# Further points of long triangles, at uneven distances: across a fence, points at even ones may all be on bars. Points
# nearer to the corners would cut walls that end at an edge.
_ALONG = np.concatenate([0.2 + 0.4 * np.eye(3), 0.43 - 0.29 * np.eye(3)])
_BATCH = 1 << 15  # cells at a time: with eight layers, the gaps between all pairs of samples take 17 MB


def connect(
    caster: RayCaster,
    grid: FaceGrid,
    depths: NDArray[np.float32],
    steps: int,
    cut: bool = True,
    across_layers: bool = True,
    parallel_map: Map = map,
) -> list[list[NDArray[np.uint16]]]:
    """Connect the samples of a face to triangles and drop those that do not lie on the mesh.

    Parameters
    ----------
    caster
        The mesh, ready for ray casting, object frame.
    grid
        Rays and texels of the face.
    depths
        (L, H, W) float32, metres from the face inward, +inf where empty; in each texel, hits fill the first layers.
    steps
        Number of grids, of steps 1, 2, … 2^(steps − 1).
    cut
        Whether to drop triangles that are off the mesh; otherwise every triangle counts as surface.
    across_layers
        Whether a triangle's corners may be on different layers.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    list
        For each layer, a list with an array (cells,) uint16 for each level, as in `DepthImage.cells`.
    """
    corners = [grid_cells(grid.shape, grid.face, 1 << level) for level in range(steps)]
    codes = [np.zeros((len(depths), level[0].size), np.uint16) for level in corners]
    solid = np.isfinite(depths[0])  # samples fill the first layers

    def work(task: tuple[int, slice]) -> None:
        level, batch = task
        i0, j0, i1, j1 = batch_corners = [axis[batch] for axis in corners[level]]
        samples = np.sum([solid[j, i] for j in (j0, j1) for i in (i0, i1)], axis=0)
        filled = np.flatnonzero(samples >= 3)
        if not len(filled):
            return
        cells = [axis[filled] for axis in batch_corners]
        found = _connect_cells(caster, grid, depths, cells, level, cut, across_layers)
        codes[level][:, batch.start + filled] = found

    tasks = [(level, batch) for level, cells in enumerate(corners) for batch in batches(cells[0].size, _BATCH)]
    list(parallel_map(work, tasks))
    return [[level[layer] for level in codes] for layer in range(len(depths))]


def _connect_cells(
    caster: RayCaster,
    grid: FaceGrid,
    depths: NDArray[np.float32],
    corners: list[NDArray[np.int64]],
    level: int,
    cut: bool,
    across_layers: bool,
) -> NDArray[np.uint16]:
    """Return the codes (L, cells) of a batch of cells of one level; corners: as `grid_cells` returns them."""
    layers, height, width = depths.shape
    columns, rows = (axis.reshape(-1, 3) for axis in cell_triangles(grid.face, *corners))  # (triangles, 3)
    texels = (rows * width + columns).T
    solid = np.flatnonzero(np.isfinite(depths[0].take(texels)).all(0))
    columns, rows = columns.take(solid, 0), rows.take(solid, 0)
    flat = depths.reshape(layers, -1)
    corner_depths = np.stack([flat.take(corner, 1) for corner in texels.take(solid, 1)])  # (3, L, solid)
    anchor, triangle, second, third = (_continue_layers if across_layers else _single_layers)(corner_depths)
    chosen = np.stack([corner_depths[0][anchor, triangle], corner_depths[1][second, triangle],
                       corner_depths[2][third, triangle]]).T  # fmt: skip
    # The unwrapped column of a wrapped corner, so that a centre never averages across the seam.
    unwrapped = np.where(columns < np.tile(corners[0], 2)[solid, None], columns + width, columns)
    u, v = (((axis + 0.5) / size).take(triangle, 0) for axis, size in ((unwrapped, width), (rows, height)))
    limit = (1 << level) * grid.longest_texel
    kept = _on_surface(caster, grid, u, v, chosen, limit, layers) if cut else np.ones(len(chosen), bool)
    codes = np.zeros((layers, 2 * corners[0].size), np.uint16)
    code = (1 | second << 1 | third << 4).astype(np.uint16)
    codes[anchor[kept], solid[triangle[kept]]] = code[kept]
    lower, upper = codes[:, : corners[0].size], codes[:, corners[0].size :]
    return lower | upper << np.uint16(7)


def _continue_layers(depths: NDArray[np.float32]) -> tuple[NDArray[np.intp], ...]:
    """Choose the layers of the corners of each triangle so that one surface runs through them.

    Two samples belong together if each is the other's nearest in depth; in a triangle this must hold for all three
    pairs.

    depths: (3, L, n) of the corners, finite on layer 0. Returns for each candidate, of which a triangle may have
    several: the layer of its first corner, its number, and the layers of its second and third corner.
    """
    deepest = np.isfinite(depths).sum(1).max(0)  # samples fill the first layers, and few cells have many
    alone = np.flatnonzero(deepest == 1)
    nearest = np.zeros_like(alone)
    parts = [(nearest, alone, nearest, nearest)]
    for layers in range(2, depths.shape[1] + 1):
        selected = np.flatnonzero(deepest == layers)
        if not len(selected):
            continue
        first, second, third = depths[:, :layers, selected]
        to_second, to_third, between = _mutual(first, second), _mutual(first, third), _mutual(second, third)
        complete = (to_second >= 0) & (to_third >= 0) & (between[to_second, np.arange(len(selected))] == to_third)
        anchor, triangle = complete.nonzero()
        parts.append((anchor, selected[triangle], to_second[anchor, triangle], to_third[anchor, triangle]))
    anchor, triangle, second, third = (np.concatenate(column) for column in zip(*parts, strict=True))
    return anchor, triangle, second, third


def _single_layers(depths: NDArray[np.float32]) -> tuple[NDArray[np.intp], ...]:
    """Return the same as `_continue_layers` with all corners on one layer, each layer a height field of its own."""
    layer, triangle = np.nonzero(np.isfinite(depths).all(0))
    return layer, triangle, layer, layer


def _mutual(first: NDArray[np.float32], second: NDArray[np.float32]) -> NDArray[np.intp]:
    """Return for each sample of `first` (L, n) the layer of its partner in `second` (L, n), or −1."""
    with np.errstate(invalid="ignore"):
        gap = np.fmin(
            np.abs(first[:, None] - second[None]), np.float32(np.inf)
        )  # (L of first, L of second, n); not NaN
    forth, back = gap.argmin(1), gap.argmin(0)
    columns = np.arange(first.shape[1])[None]
    layers = np.arange(len(first))[:, None]
    mutual = (back[forth, columns] == layers) & np.isfinite(gap.min(1))
    return np.where(mutual, forth, -1)


@dataclass(frozen=True, kw_only=True)
class _Triangles(StructOfArrays):
    """Hold n triangles of samples.

    u, v, depth: (n, 3), of their corners. spread: (n,), difference between their depths. points: (n, 3, 3), the
    corners, object frame. normal: (n, 3), unit.
    """

    u: Array
    v: Array
    depth: Array
    spread: Array
    points: Array
    normal: Array


def _on_surface(
    caster: RayCaster, grid: FaceGrid, u: Array, v: Array, depth: Array, limit: float, layers: int
) -> NDArray[np.bool_]:
    """Return whether triangles of the samples u, v, depth (n, 3) approximate the mesh.

    A triangle whose depths differ by less than `limit`, a cell, does. A steeper one does if the mesh passes through its
    centre; more points of a long one are tested, and more strictly, since something may cross it by chance.
    """
    spread = depth.max(-1) - depth.min(-1)
    kept = spread <= limit
    selected = np.flatnonzero(~kept)
    if not len(selected):
        return np.asarray(kept)
    steep = _triangles(grid, u.take(selected, 0), v.take(selected, 0), depth.take(selected, 0), spread[selected])
    met = _meets(caster, grid, steep, _MIDDLE, limit, layers)
    for weights in _ALONG:
        long = np.flatnonzero(met & (steep.spread > _LONG * limit))
        if not len(long):
            break
        met[long] = _meets(caster, grid, steep.take(long), weights, limit, layers)
    kept[selected] = met
    return np.asarray(kept)


def _triangles(grid: FaceGrid, u: Array, v: Array, depth: Array, spread: Array) -> _Triangles:
    points = grid.points_at(u, v, depth)
    normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 1])
    normal /= np.maximum(lengths(normal), np.float32(1e-20))[:, None]
    return _Triangles(u=u, v=v, depth=depth, spread=spread, points=points, normal=normal)


def _meets(
    caster: RayCaster, grid: FaceGrid, triangles: _Triangles, weights: Array, limit: float, layers: int
) -> NDArray[np.bool_]:
    """Return which triangles (n,) meet the mesh at one of their points, given by the `weights` (3,) of the corners.

    They do if the ray through that point hits the mesh there; or, for a wall along the rays, if the mesh is hardly off
    the wall.
    """
    points, normal = triangles.points, triangles.normal
    origin, direction = grid.rays_at(triangles.u @ weights, triangles.v @ weights)
    with np.errstate(divide="ignore", invalid="ignore"):
        expected = np.einsum("ni,ni->n", points[:, 0] - origin, normal) / np.einsum("ni,ni->n", direction, normal)
        # Between the bars of a fence, no point is farther from a bar than a part of a long triangle's depth range.
        allowed = CUT_TOLERANCE * np.where(triangles.spread > _LONG * limit, np.float32(limit), triangles.spread)
        max_distance = np.fmin(expected + 1.01 * allowed, grid.max_depth)  # hits farther away do not matter
        hits = caster.peel(origin, direction, layers, max_distance)
        # The surface hit must also be parallel to the triangle: among many surfaces, some match in depth by chance.
        aligned = np.abs(np.einsum("lni,ni->ln", hits.normal, normal)) >= _LEAST_ALIGNMENT
        met = ((np.abs(hits.distance - expected) <= allowed) & aligned).any(0)

    wall = np.flatnonzero(~met)
    if not len(wall):
        return np.asarray(met)
    corners, ahead = np.moveaxis(points.take(wall, 0), 1, 0), normal.take(wall, 0)
    shortest = np.min([lengths(corners[k] - corners[k - 1]) for k in range(3)], axis=0)
    near = _WALL_SLACK * np.minimum(shortest, limit).astype(np.float32)
    # Grid triangles face outward (except those past the axis, where θ runs the other way): cast rays head on.
    if grid.face is Face.SIDE:
        ahead[triangles.depth.take(wall, 0).mean(1) > grid.cylinder.radius] *= -1
    start = np.einsum("k,kni->ni", weights, corners).astype(np.float32) + near[:, None] * ahead
    hits = caster.peel(start, -ahead, 2, 2.01 * near)
    met[wall] = ((hits.distance <= 2 * near) & (caster.two_sided | ~hits.flipped)).any(0)
    return np.asarray(met)
