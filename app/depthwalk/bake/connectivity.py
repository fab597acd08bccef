"""Which grid triangles lie on the surface: the cut, made to work across layers (docs/baking.md).

A depth image is a height field only in part: next to a silhouette its nearest surface jumps, and the surface behind
goes on one layer deeper. So each corner of a triangle is taken from the layer whose depth continues the others', and
what remains is tested against the mesh with rays.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import Cylinder, Face, cell_triangles, grid_cells, surface_rays, texel_size
from depthwalk.bake.raycast import RayCaster

# A triangle is dropped where the surface on the ray through its centre is off its plane by more than this part of its
# depth range: half-way values separate a slope (0) from a step (0.33 to 0.67), measured on five models.
CUT_TOLERANCE = 0.15
_LEAST_ALIGNMENT = 0.5  # cosine between a triangle and the surface on the ray through its centre: within 60°
# A wall may be off the mesh by this part of its shortest edge. With 1, walls stand off the surface like combs; below
# 0.3, rounded edges lose theirs at low resolution.
_WALL_SLACK = 0.4
_BATCH = 1 << 15  # cells at a time: with eight layers, the gaps between all pairs of samples take 17 MB

Array = NDArray[np.floating]


def connect(
    caster: RayCaster, cylinder: Cylinder, face: Face, depths: NDArray[np.float32], steps: int
) -> list[list[NDArray[np.uint16]]]:
    """The `cells` of every layer of a face: [layer][level], see `DepthImage`. depths: (L, H, W)."""
    layers, height, width = depths.shape
    cells: list[list[NDArray[np.uint16]]] = [[] for _ in range(layers)]
    for level in range(steps):
        corners = grid_cells((height, width), face, 1 << level)
        codes = np.empty((layers, corners[0].size), np.uint16)
        for first in range(0, corners[0].size, _BATCH):
            some = slice(first, first + _BATCH)
            codes[:, some] = _connect_cells(caster, cylinder, face, depths, [axis[some] for axis in corners], level)
        for layer in range(layers):
            cells[layer].append(codes[layer])
    return cells


def _connect_cells(
    caster: RayCaster,
    cylinder: Cylinder,
    face: Face,
    depths: NDArray[np.float32],
    corners: list[NDArray[np.int64]],
    level: int,
) -> NDArray[np.uint16]:
    """The codes (L, cells) of some cells of one level; corners: theirs, as `grid_cells` gives them."""
    layers, height, width = depths.shape
    columns, rows = cell_triangles(face, *corners)  # (2, cells, 3)
    # The unwrapped column of a wrapped corner, so that a centre never averages across the seam.
    unwrapped = np.where(columns < corners[0][None, :, None], columns + width, columns)
    u, v = (unwrapped.reshape(-1, 3) + 0.5) / width, (rows.reshape(-1, 3) + 0.5) / height
    corner_depths = np.moveaxis(depths[:, rows, columns].reshape(layers, -1, 3), 2, 0)  # (3, L, triangles)
    anchor, triangle, second, third = _continue_layers(corner_depths)
    chosen = np.stack([corner_depths[0][anchor, triangle], corner_depths[1][second, triangle],
                       corner_depths[2][third, triangle]], -1)  # fmt: skip
    limit = (1 << level) * max(texel_size(cylinder, face, (height, width)))
    kept = _on_surface(caster, cylinder, face, u[triangle], v[triangle], chosen, limit, layers)
    codes = np.zeros((layers, 2, corners[0].size), np.uint16)
    code = (1 | second << 1 | third << 4).astype(np.uint16)
    codes.reshape(layers, -1)[anchor[kept], triangle[kept]] = code[kept]
    return codes[:, 0] | codes[:, 1] << np.uint16(7)


def _continue_layers(depths: NDArray[np.float32]) -> tuple[NDArray[np.intp], ...]:
    """Candidate triangles of corner depths (3, L, n): anchor layer, triangle number, layers of its other corners.

    Two samples belong together if each is the other's nearest in depth; a triangle needs that of all three pairs.
    """
    second, third, between = _mutual(depths[0], depths[1]), _mutual(depths[0], depths[2]), _mutual(depths[1], depths[2])
    columns = np.arange(depths.shape[2])[None]
    complete = (second >= 0) & (third >= 0) & (between[second, columns] == third)
    anchor, triangle = complete.nonzero()
    return anchor, triangle, second[anchor, triangle], third[anchor, triangle]


def _mutual(here: NDArray[np.float32], there: NDArray[np.float32]) -> NDArray[np.intp]:
    """For each sample of `here` (L, n) the layer of its partner in `there` (L, n), or −1."""
    with np.errstate(invalid="ignore"):
        gap = np.nan_to_num(np.abs(here[:, None] - there[None]), nan=np.inf, posinf=np.inf)  # (L here, L there, n)
    forth, back = gap.argmin(1), gap.argmin(0)
    columns = np.arange(here.shape[1])[None]
    layers = np.arange(len(here))[:, None]
    mutual = (back[forth, columns] == layers) & np.isfinite(gap.min(1))
    return np.where(mutual, forth, -1)


def _on_surface(
    caster: RayCaster, cylinder: Cylinder, face: Face, u: Array, v: Array, depth: Array, limit: float, layers: int
) -> NDArray[np.bool_]:
    """Whether triangles of the samples u, v, depth (n, 3) approximate the mesh.

    One whose depths differ by less than `limit`, a cell, does. A steeper one does if the ray through its centre meets
    the mesh where it meets the triangle; or, a wall along the rays, if the mesh is hardly off its middle.
    """
    spread = depth.max(-1) - depth.min(-1)
    kept = spread <= limit
    steep = np.flatnonzero(~kept)
    origin, direction = surface_rays(cylinder, face, u[steep], v[steep])
    points = origin + depth[steep, :, None] * direction  # (steep, 3, 3)
    edges = np.roll(points, -1, axis=1) - points
    normal = np.cross(edges[:, 0], edges[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)

    origin, direction = surface_rays(cylinder, face, u[steep].mean(1), v[steep].mean(1))
    with np.errstate(divide="ignore", invalid="ignore"):
        expected = np.einsum("ni,ni->n", points[:, 0] - origin, normal) / np.einsum("ni,ni->n", direction, normal)
        reach = 2 * cylinder.radius if face is Face.SIDE else cylinder.height
        hits = caster.peel(origin, direction, layers, reach)
        # What is met must also lie as the triangle does: where surfaces are many, some are at any depth by chance.
        aligned = np.abs(np.einsum("lni,ni->ln", hits.normal, normal)) >= _LEAST_ALIGNMENT
        off = np.abs(hits.distance - expected)
        kept[steep] = ((off <= CUT_TOLERANCE * spread[steep]) & aligned).any(0)

    wall = np.flatnonzero(~kept[steep])
    near = _WALL_SLACK * np.minimum(np.linalg.norm(edges[wall], axis=2).min(1), limit)[:, None].astype(np.float32)
    # Grid triangles face outward (but for those past the axis, where θ runs the other way): meet the mesh head on.
    ahead = normal[wall].astype(np.float32)
    if face is Face.SIDE:
        ahead[depth[steep[wall]].mean(1) > cylinder.radius] *= -1
    start = points[wall].mean(1).astype(np.float32) + near * ahead
    hits = caster.peel(start, -ahead, 2, np.inf)
    kept[steep[wall]] = ((hits.distance <= 2 * near[:, 0]) & (caster.two_sided | ~hits.flipped)).any(0)
    return kept
