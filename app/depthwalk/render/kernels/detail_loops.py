"""Choose how objects are drawn, and at which level of detail.

The reference is `render.draw.object_detail`, with `render.lod` and `cook.cases.seen_pieces`.
"""

import math

import numpy as np

from depthwalk.kernels.compilation import (
    BoolArray1,
    Float32Array1,
    Float32Array2,
    Float64Array1,
    Float64Array2,
    Float64Array3,
    Float64Array4,
    Int32Array1,
    Int64Array1,
    Int64Array2,
    UInt8Array1,
    compiled,
    compiled_as_annotated,
)
from depthwalk.render.kernels.layout_loops import turned_axes, warp_face
from depthwalk.types import Array, Rows

_DPCI, _DMESH = 1, 2  # of `scene.arrays.Representation`
_POLYGONS, _TILE, _DIRECT, _NOTHING = 0, 1, 2, 3  # of `object_detail.DrawMethod`


@compiled
def _length(x: float, y: float, z: float) -> float:
    """Return the length of a vector."""
    return math.sqrt(x * x + y * y + z * z)


@compiled
def _seen_pieces(horizon: Array, edges: Array, viewer: Array, slack: float, step: int) -> int:
    """Return the bits of those pieces 0, `step`, 2 · `step` … that a viewer may see; see `cook.cases.seen_pieces`.

    horizon, edges: (p, 4) and (p, 4, 3). slack: tolerance, as a part of the viewer's distance.
    """
    x, y, z = viewer[0], viewer[1], viewer[2]
    farther, bits = slack * _length(x, y, z), 0
    for piece in range(0, len(horizon), step):
        for k in range(4):
            ahead = x * edges[piece, k, 0] + y * edges[piece, k, 1] + z * edges[piece, k, 2]
            if ahead + farther > horizon[piece, k]:
                bits |= 1 << piece
                break
    return bits


@compiled
def _viewer(position: Array, rotation: Array, scale: float, eye: Array, viewer: Array) -> None:
    """Write where the viewer stands in the frame of an object into `viewer` (3,), see `view.viewer_in_object`.

    position, rotation, scale: the object. eye: (3,) the viewer, metres, world.
    """
    a, b, c, w = -rotation[0], -rotation[1], -rotation[2], rotation[3]
    x, y, z = eye[0] - position[0], eye[1] - position[1], eye[2] - position[2]
    across_x, across_y, across_z = b * z - c * y + w * x, c * x - a * z + w * y, a * y - b * x + w * z
    viewer[0] = (x + 2 * (b * across_z - c * across_y)) / scale
    viewer[1] = (y + 2 * (c * across_x - a * across_z)) / scale
    viewer[2] = (z + 2 * (a * across_y - b * across_x)) / scale


@compiled
def _outside(viewer: Array, centre: Array, half_height: float, radius: float) -> float:
    """Return the distance of a viewer from an upright cylinder, see `view.bounds.outside`."""
    beside = max(math.hypot(viewer[0] - centre[0], viewer[2] - centre[2]) - radius, 0.0)
    return math.hypot(beside, max(abs(viewer[1] - centre[1]) - half_height, 0.0))


@compiled_as_annotated
def describe(
    rows: Int64Array1,
    position: Float32Array2,
    rotation: Float32Array2,
    scale: Float32Array1,
    asset: Int32Array1,
    representation: UInt8Array1,
    centre: Float32Array2,
    bounding_radius: Float32Array1,
    eye: Float64Array1,
    detail_pixels: float,
    error_at_a_metre: float,
    triangles_per_pixel: float,
    step_at_a_metre: float,
    error: Float64Array2,
    triangles: Int64Array2,
    max_level: Int64Array1,
    asset_centre: Float64Array2,
    half_height: Float64Array1,
    cylinder_radius: Float64Array1,
    area: Float64Array1,
    texel: Float64Array1,
    horizon: Float64Array4,
    edges: Float64Array3,
    slack: float,
    worth: float,
    side_pieces: int,
    all_pieces: int,
    radius: Float64Array1,
    bottom: Float64Array1,
    top: Float64Array1,
    has_side: BoolArray1,
    least_distance: float,
) -> tuple[Array, Rows, Rows, Rows, Rows, Array]:
    """Return how the objects `rows` are drawn, see `object_detail.describe`.

    Parameters
    ----------
    rows : (m,) rows of the objects.
    position, rotation, scale, asset, representation, centre, bounding_radius : (n, …) all objects, and their bounding
        spheres, world.
    eye : (3,) the viewer, metres, world.
    detail_pixels : of the `View`.
    error_at_a_metre : see `lod.selection`.
    triangles_per_pixel : how many triangles there may be for each pixel.
    step_at_a_metre : Iter_step, at a distance of one metre, of an object whose texels are one metre large.
    error, triangles, max_level, asset_centre, half_height, cylinder_radius, area, texel, horizon : (a, …) see
        `AssetTable`.
    edges : (p, 4, 3) edges of the cones of the pieces' normals, see `cook.cases`; the first and last piece are caps.
    slack : tolerance of the test for pieces, as a part of the viewer's distance.
    worth : triangles from which on pieces of the side are culled, too.
    side_pieces, all_pieces : bit masks of the pieces of the side, and of all.
    radius, bottom, top, has_side : (a, …) cylinders, see `warp_planes.Volumes`.
    least_distance : least distance of the viewer from a warp plane, as a part of the radius.

    Returns
    -------
    viewer (m, 3), level (m,), pieces (m,), triangles (m,), method (m,) and step (m,), see `ObjectDetail`.
    """
    count, last = len(rows), len(edges) - 1
    viewer, step = np.empty((count, 3)), np.empty(count)
    level, pieces, cost = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.int64)
    method = np.empty(count, np.uint8)
    for k in range(count):
        row = rows[k]
        a, kind, from_object = asset[row], representation[row], viewer[k]
        _viewer(position[row], rotation[row], scale[row], eye, from_object)
        metres = _length(centre[row, 0] - eye[0], centre[row, 1] - eye[1], centre[row, 2] - eye[2])
        step[k] = max(step_at_a_metre * metres / (texel[a] * scale[row]), 1.0)

        allowed = error_at_a_metre * _outside(from_object, asset_centre[a], half_height[a], cylinder_radius[a])
        pixels = area[a] * (scale[row] * detail_pixels / max(metres, bounding_radius[row])) ** 2
        accurate, affordable = 0, 0
        for coarser in range(error.shape[1]):
            accurate += coarser > 0 and error[a, coarser] <= allowed
            affordable += triangles[a, coarser] > triangles_per_pixel * pixels
        level[k] = max(accurate, min(affordable, max_level[a]))
        cost[k] = triangles[a, level[k]]

        _, distance = warp_face(from_object, radius[a], bottom[a], top[a], has_side[a])
        has_plane = distance >= least_distance * radius[a]
        if kind == _DPCI:
            method[k] = _TILE if has_plane else (_DIRECT if has_side[a] or distance > 0 else _NOTHING)
        else:
            method[k] = _DIRECT if kind == _DMESH else _POLYGONS

        if method[k] == _DIRECT:
            pieces[k] = all_pieces
        elif cost[k] >= worth:
            pieces[k] = _seen_pieces(horizon[a, level[k]], edges, from_object, slack, 1)
        else:
            pieces[k] = _seen_pieces(horizon[a, level[k]], edges, from_object, slack, last) | side_pieces
    return viewer, level, pieces, cost, method, step


@compiled
def extent(
    across: float, ahead: float, radius: float, shear: float, tangent: float, near: float
) -> tuple[float, float]:
    """Return where a sphere begins and ends in the picture along one axis, −1 to 1, see `view.bounds.extents`.

    across, ahead: its centre along this axis of the view, and along the view axis, metres. shear, tangent: of the
    `View`, along this axis.
    """
    first, last = -1.0, 1.0
    if ahead - radius > near:
        reach = radius * math.hypot(1.0, shear)
        left, right = across - reach, across + reach
        first = min(left / (ahead - radius), left / (ahead + radius)) / tangent
        last = max(right / (ahead - radius), right / (ahead + radius)) / tangent
    return min(max(first, -1.0), 1.0), min(max(last, -1.0), 1.0)


@compiled_as_annotated
def surfaces(
    rows: Int64Array1,
    tiled: BoolArray1,
    position: Float32Array2,
    rotation: Float32Array2,
    scale: Float32Array1,
    asset: Int32Array1,
    centre: Float32Array2,
    bounding_radius: Float32Array1,
    asset_number: Int64Array1,
    material_depth: Float64Array1,
    crowd: BoolArray1,
    eye: Float64Array1,
    axes: Float64Array2,
    tangent: Float64Array1,
    shear: Float64Array1,
    near: float,
) -> tuple[Array, Array, Array]:
    """Return the records of n objects for the pass `material_resolve`, see `material_depth.material_records`.

    Parameters
    ----------
    rows : (n,) rows of the objects.
    tiled : (n,) which of these are drawn by impostor tiles.
    position, rotation, scale, asset, centre, bounding_radius : (o, …) all objects, and their bounding spheres, world.
    asset_number : (a,) the number of each asset among the k that these objects have.
    material_depth, crowd : (k,) the depth of each of these, and whether it is assumed to cover the whole screen.
    eye, axes, tangent, shear : of the `View`: `position`, `axes`, `half_extent` and `shear`.
    near : the near plane, metres.

    Returns
    -------
    (1 + n, 12) float32, a SURFACE_RECORD each, and (k, 2) low and high corners of the part of the picture in which each
    asset may be.
    """
    record = np.zeros((1 + len(rows), 12), np.float32)
    record[0, 8] = 1.0
    low, high = np.ones((len(crowd), 2)), -np.ones((len(crowd), 2))
    viewer, across = np.empty(3), np.empty(2)
    low[crowd], high[crowd] = -1.0, 1.0
    for k in range(len(rows)):
        row = rows[k]
        number = asset_number[asset[row]]
        _viewer(position[row], rotation[row], scale[row], eye, viewer)
        for j in range(3):
            record[k + 1, j] = viewer[j]
        for j in range(4):
            record[k + 1, 4 + j] = rotation[row, j]
        record[k + 1, 3], record[k + 1, 8], record[k + 1, 9] = scale[row], material_depth[number], tiled[k]
        if crowd[number]:
            continue
        x, y, z = centre[row, 0] - eye[0], centre[row, 1] - eye[1], centre[row, 2] - eye[2]
        across[0] = axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z
        across[1] = axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z
        ahead, radius = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z, np.float64(bounding_radius[row])
        for j in range(2):
            first, last = extent(across[j], ahead, radius, shear[j], tangent[j], near)
            low[number, j], high[number, j] = min(low[number, j], first), max(high[number, j], last)
    return record, low, high


@compiled_as_annotated
def nearer_than(
    rows: Int64Array1,
    position: Float32Array2,
    rotation: Float32Array2,
    scale: Float32Array1,
    asset: Int32Array1,
    eye: Float64Array1,
    mesh: Int64Array1,
    part: Int64Array1,
    offset: Float64Array2,
    turn: Float64Array2,
    reach: Float64Array1,
    span: Float64Array1,
    asset_centre: Float64Array2,
    half_height: Float64Array1,
    cylinder_radius: Float64Array1,
) -> tuple[Rows, Array]:
    """Return which objects with a mesh are nearer to the viewer than `reach`, see `MeshFallbacks.nearer_than`.

    Parameters
    ----------
    rows : (m,) rows of the objects.
    position, rotation, scale, asset : (n, …) all objects.
    eye : (3,) the viewer, metres, world.
    mesh, part, offset, turn, span, asset_centre, half_height, cylinder_radius : (a, …) see `MeshFallbacks`.
    reach : (a,) metres, object frames.

    Returns
    -------
    (k,) indices into `rows`, and (k,) metres, object frames, from the viewer to the assets' cylinders.
    """
    found, nearest, count = np.empty(len(rows), np.int64), np.empty(len(rows)), 0
    viewer, turned, matrix = np.empty(3), np.empty(3), np.empty((3, 3))
    for k in range(len(rows)):
        row = rows[k]
        a = asset[row]
        if mesh[a] < 0:
            continue
        x, y, z = eye[0] - position[row, 0], eye[1] - position[row, 1], eye[2] - position[row, 2]
        if _length(x, y, z) >= (reach[a] + span[a]) * scale[row]:
            continue
        row -= part[a]  # all parts of an asset are replaced, or none, depending on the first
        a = asset[row]
        _viewer(position[row], rotation[row], scale[row], eye, viewer)
        turned_axes(turn[a], matrix)
        for i in range(3):
            turned[i] = matrix[i, 0] * viewer[0] + matrix[i, 1] * viewer[1] + matrix[i, 2] * viewer[2] + offset[a, i]
        metres = _outside(turned, asset_centre[a], half_height[a], cylinder_radius[a])
        if metres < reach[a]:
            found[count], nearest[count] = k, metres
            count += 1
    return found[:count], nearest[:count]
