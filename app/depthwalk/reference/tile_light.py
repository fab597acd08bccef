"""Light impostor tiles in pass 1, and filter them in pass 2, as the twin of the shaders with `light.mode: warp`.

Liu, Liu and Wu 2007 light each fragment of the intermediate image (§2.4), which pass 2 then draws as a filtered texture
(§2.5). Shaders: warp/warp.vert and warp.frag (LIT), composite/tile_texels.glsl, material_resolve/material_resolve.frag.
"""

import numpy as np

from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.reference.light import Surfaces, reflected
from depthwalk.types import Array, Mask


def surface_point(corners: Array, lam: Array, share: Array) -> Array:
    """Return the points of a triangle shown at positions on the plane.

    λ and λ·P are linear over the plane (see `reference.warp.unwarp`), where the rasteriser interpolates. P, the point
    itself, is not: between two samples, the midpoint on the plane shows a point closer to the sample nearer the viewer.

    Parameters
    ----------
    corners
        (3, 3) the triangle's corners P, metres, object frame.
    lam
        (3,) λ of the corners, as `reference.warp.warp` returns it.
    share
        (n, 3) barycentric coordinates of the positions in the triangle of the warped corners, on the plane.

    Returns
    -------
    Array
        (n, 3) points of the triangle, metres, object frame.
    """
    homogeneous = share @ np.column_stack([lam[:, None] * corners, lam])
    return np.asarray(homogeneous[:, :3] / homogeneous[:, 3:])


def forward_light(surfaces: Surfaces, view: Array, rotation: Array, to_sun: Array, sun: Array, ambient: Array) -> Array:
    """Light surfaces in the frame of their object, as shaders/common/forward_light.glsl does (§2.4).

    Parameters
    ----------
    surfaces
        The n surfaces, with normals in the object frame.
    view
        (n, 3) unit vectors from the viewer, object frame.
    rotation
        (4,) unit quaternion (x, y, z, w) of the object, world from object.
    to_sun
        (3,) unit vector to the sun, world.
    sun
        (3,) linear RGB of the sun's light.
    ambient
        (n, 3) linear RGB that ambient light adds on a white surface with these normals.

    Returns
    -------
    Array
        (n, 3) linear RGB.
    """
    to_light = rotate(conjugate(rotation[None]), to_sun[None])[0]
    return surfaces.albedo * ambient + sun * reflected(surfaces, view, to_light)


def filtered_light(light: Array, filled: Mask, position: Array) -> Array:
    """Filter the lit texels around positions bilinearly, ignoring empty ones (§2.5).

    Parameters
    ----------
    light
        (H, W, 3) linear RGB of a tile's texels.
    filled
        (H, W) which texels are not empty.
    position
        (n, 2) column and row in texels, whole numbers at the corners of texels. One of the four texels around each
        position must not be empty.

    Returns
    -------
    Array
        (n, 3) linear RGB.
    """
    low = np.floor(position - 0.5).astype(int)
    part = position - 0.5 - low
    total, weights = np.zeros((len(position), 3)), np.zeros((len(position), 1))
    for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)):
        column = np.clip(low[:, 0] + i, 0, light.shape[1] - 1)
        row = np.clip(low[:, 1] + j, 0, light.shape[0] - 1)
        across, up = (part[:, 0] if i else 1 - part[:, 0]), (part[:, 1] if j else 1 - part[:, 1])
        weight = (across * up * filled[row, column])[:, None]
        total += weight * light[row, column]
        weights += weight
    return np.asarray(total / weights)


def shadowed_light(tile_light: Array, lit: Array, unshadowed: Array) -> Array:
    """Put surfaces lit in pass 1 into shadow: each colour keeps the same part that it keeps without a tile.

    Parameters
    ----------
    tile_light
        (n, 3) linear RGB, filtered from tiles, without shadows.
    lit, unshadowed
        (n, 3) linear RGB of the same surfaces by `forward_light`, with shadows and without.

    Returns
    -------
    Array
        (n, 3) linear RGB.
    """
    left = np.where(unshadowed > 0, lit / np.maximum(unshadowed, 1e-6), 1.0)
    return np.asarray(left * tile_light)
