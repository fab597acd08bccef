"""Choose how finely objects are drawn.

The reference is `render.draw.object_detail`, with `render.lod` and `cook.cases.seen_pieces`.
"""

import math

import numpy as np

from depthwalk.render.kernels.compilation import compiled
from depthwalk.types import Array, Rows


@compiled()
def _length(x: float, y: float, z: float) -> float:
    """Return the length of a vector."""
    return math.sqrt(x * x + y * y + z * z)


@compiled()
def _seen_pieces(horizon: Array, edges: Array, viewer: Array, slack: float, step: int) -> int:
    """Return bits of the pieces 0, `step`, 2 · `step` … that a viewer may see; see `cook.cases.seen_pieces`.

    horizon, edges: (p, 4) and (p, 4, 3). slack: part of the viewer's distance by which it may be farther ahead.
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


@compiled("F2 F2 F1 D1")
def viewers(position: Array, rotation: Array, scale: Array, eye: Array) -> Array:
    """Return where the viewer stands in the frames of n objects, see `view.viewer_in_object`.

    Parameters
    ----------
    position, rotation, scale : (n, …) the objects.
    eye : (3,) the viewer, metres, world.

    Returns
    -------
    (n, 3) metres, object frames.
    """
    viewer = np.empty((len(scale), 3))
    for k in range(len(scale)):
        a, b, c, w = -rotation[k, 0], -rotation[k, 1], -rotation[k, 2], rotation[k, 3]
        x, y, z = eye[0] - position[k, 0], eye[1] - position[k, 1], eye[2] - position[k, 2]
        across_x, across_y, across_z = b * z - c * y + w * x, c * x - a * z + w * y, a * y - b * x + w * z
        viewer[k, 0] = (x + 2 * (b * across_z - c * across_y)) / scale[k]
        viewer[k, 1] = (y + 2 * (c * across_x - a * across_z)) / scale[k]
        viewer[k, 2] = (z + 2 * (a * across_y - b * across_x)) / scale[k]
    return viewer


@compiled("D2 N1 F1 F2 F1 D1 f f f D2 I2 I1 D2 D1 D1 D1")
def levels(
    viewer: Array,
    asset: Rows,
    scale: Array,
    centre: Array,
    bounding_radius: Array,
    eye: Array,
    detail_pixels: float,
    error_at_a_metre: float,
    triangles_per_pixel: float,
    error: Array,
    triangles: Rows,
    max_level: Rows,
    asset_centre: Array,
    half_height: Array,
    cylinder_radius: Array,
    area: Array,
) -> Rows:
    """Return the level of detail of n objects by its error and its triangles, see `object_detail.choose_levels`.

    Parameters
    ----------
    viewer : (n, 3) the viewer in the frames of the objects, metres.
    asset, scale, centre, bounding_radius : (n, …) the objects, and their bounding spheres, world.
    eye : (3,) the viewer, metres, world.
    detail_pixels : of the `View`.
    error_at_a_metre : see `lod.selection`.
    triangles_per_pixel : how many triangles there may be for each pixel.
    error, triangles, max_level, asset_centre, half_height, cylinder_radius, area : (a, …) see `AssetTable`.

    Returns
    -------
    (n,) levels, 0 the finest.
    """
    count = len(asset)
    chosen = np.empty(count, np.int64)
    for k in range(count):
        a = asset[k]
        x, z = viewer[k, 0] - asset_centre[a, 0], viewer[k, 2] - asset_centre[a, 2]
        beside = max(math.hypot(x, z) - cylinder_radius[a], 0.0)
        above = max(abs(viewer[k, 1] - asset_centre[a, 1]) - half_height[a], 0.0)
        allowed = error_at_a_metre * math.hypot(beside, above)
        distance = _length(centre[k, 0] - eye[0], centre[k, 1] - eye[1], centre[k, 2] - eye[2])
        pixels = area[a] * (scale[k] * detail_pixels / max(distance, bounding_radius[k])) ** 2
        level, affordable = 0, 0
        for coarser in range(error.shape[1]):
            level += coarser > 0 and error[a, coarser] <= allowed
            affordable += triangles[a, coarser] > triangles_per_pixel * pixels
        chosen[k] = max(level, min(affordable, max_level[a]))
    return chosen


@compiled("D2 N1 I1 I2 D4 D3 f f i")
def pieces(
    viewer: Array,
    asset: Rows,
    level: Rows,
    triangles: Rows,
    horizon: Array,
    edges: Array,
    slack: float,
    worth: float,
    side_pieces: int,
) -> Rows:
    """Return the pieces of n objects that the viewer may see, see `object_detail.choose_pieces`.

    Parameters
    ----------
    viewer : (n, 3) the viewer in the frames of the objects, metres.
    asset, level : (n,) numbers of the assets, and levels of detail.
    triangles, horizon : (a, levels, …) see `AssetTable`.
    edges : (p, 4, 3) edges of the cones of the pieces' normals, see `cook.cases`; the first and last piece are caps.
    slack : part of the viewer's distance by which it may be farther ahead.
    worth : triangles from which on pieces of the side are left out, too.
    side_pieces : bit mask of the pieces of the side.

    Returns
    -------
    (n,) bit masks.
    """
    count, last = len(asset), len(edges) - 1
    chosen = np.empty(count, np.int64)
    for k in range(count):
        of_level = horizon[asset[k], level[k]]
        if triangles[asset[k], level[k]] >= worth:
            chosen[k] = _seen_pieces(of_level, edges, viewer[k], slack, 1)
        else:
            chosen[k] = _seen_pieces(of_level, edges, viewer[k], slack, last) | side_pieces
    return chosen


@compiled("I1 F2 F1 N1 D1 I1 D1 D1 f")
def close(
    rows: Rows,
    position: Array,
    scale: Array,
    asset: Rows,
    eye: Array,
    mesh: Rows,
    texel: Array,
    span: Array,
    metres_per_texel: float,
) -> Rows:
    """Return which objects may be near enough to be drawn as meshes, see `MeshFallbacks.near_by`.

    Parameters
    ----------
    rows : (m,) rows of the objects.
    position, scale, asset : (n, …) of all objects.
    eye : (3,) the viewer, metres, world.
    mesh, texel, span : (a,) see `MeshFallbacks`.
    metres_per_texel : distance, for each metre of a texel, at which that is as large as it may be.

    Returns
    -------
    (k,) numbers among the m.
    """
    found, count = np.empty(len(rows), np.int64), 0
    for k in range(len(rows)):
        row = rows[k]
        a = asset[row]
        if mesh[a] >= 0:
            x, y, z = eye[0] - position[row, 0], eye[1] - position[row, 1], eye[2] - position[row, 2]
            if _length(x, y, z) < (metres_per_texel * texel[a] + span[a]) * scale[row]:
                found[count] = k
                count += 1
    return found[:count]
