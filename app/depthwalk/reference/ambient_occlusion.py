"""Estimate which part of the ambient light reaches surfaces past others; the twin of shaders/ambient_occlusion.

Ground-truth ambient occlusion: Jimenez, Wu, Pesce and Jarabo 2016, "Practical Realtime Strategies for Accurate Indirect
Occlusion". All vectors are in world axes, from the viewer.
"""

from dataclasses import dataclass

import numpy as np

from depthwalk.types import Array, Mask, Rows


@dataclass(frozen=True, kw_only=True)
class SeenSurfaces:
    """Hold what a depth buffer and normals say about the surfaces that a picture shows; row 0 is at the bottom.

    Attributes
    ----------
    point : (H, W, 3) the surfaces' points, metres; anything where nothing is.
    normal : (H, W, 3) their normals, of unit length.
    present : (H, W) whether there is a surface.
    right, up : (3,) the directions of rows and columns of the picture, of unit length.
    reach : (H, W) how many pixels a metre covers at each point.
    """

    point: Array
    normal: Array
    present: Mask
    right: Array
    up: Array
    reach: Array


RISES = 0.1
"""Sine of the angle above a surface's plane from which on points count in full, against the rounding of pixels."""


def light_up_to(horizon: Array, turned: Array) -> Array:
    """Return the cosine-weighted light in a plane between the ray to the viewer and a horizon (eq. 7).

    Parameters
    ----------
    horizon : angles from that ray, radians, negative to one side.
    turned : angle of the normal from that ray, radians; horizons are at most a right angle from it.
    """
    return np.asarray(0.25 * (np.cos(turned) + 2 * horizon * np.sin(turned) - np.cos(2 * horizon - turned)))


def turns(rows: int, columns: int) -> Array:
    """Return by which part of a step texels (rows, columns) turn their planes, all different in a block of 4 × 4."""
    y, x = np.indices((rows, columns))
    low_x, low_y, high_x, high_y = x & 1, y & 1, x >> 1 & 1, y >> 1 & 1
    return np.asarray(((low_x ^ low_y) * 8 + low_y * 4 + (high_x ^ high_y) * 2 + high_y) / 16)


def ambient_visibility(seen: SeenSurfaces, radius: float, directions: int, steps: int) -> Array:
    """Return the part of the ambient light that reaches every second pixel of every second row, before smoothing.

    Parameters
    ----------
    seen : the surfaces of the picture.
    radius : distance within which surfaces hide each other from ambient light, metres.
    directions : planes through the ray in which horizons are searched.
    steps : pixels that are looked at for each horizon.

    Returns
    -------
    (⌈H / 2⌉, ⌈W / 2⌉) part of the light, 1 where nothing is.
    """
    rows, columns = np.meshgrid(*(np.arange(0, size, 2) for size in seen.present.shape), indexing="ij")
    point, normal = seen.point[rows, columns], seen.normal[rows, columns]
    to_viewer = -point / np.maximum(np.linalg.norm(point, axis=-1, keepdims=True), 1e-9)
    turn = turns(*rows.shape)
    reach, shift = radius * seen.reach[rows, columns], (4 * turn + 0.125) % 1
    light, open_light = np.zeros(rows.shape), np.zeros(rows.shape)
    for direction in range(directions):
        angle = np.pi * (direction + turn) / directions
        along = np.stack([np.cos(angle), np.sin(angle)], -1)
        aside = along[..., :1] * seen.right + along[..., 1:] * seen.up
        tangent = aside - np.sum(aside * to_viewer, -1, keepdims=True) * to_viewer
        tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
        across = np.cross(tangent, to_viewer)
        in_plane = normal - np.sum(normal * across, -1, keepdims=True) * across
        weight = np.linalg.norm(in_plane, axis=-1)
        turned = np.arctan2(np.sum(in_plane * tangent, -1), np.sum(in_plane * to_viewer, -1))
        for side in (-1, 1):
            lowest = np.clip(turned + side * np.pi / 2, -np.pi, np.pi)
            step = side * reach[..., None] * along
            cosine = _horizon(seen, (rows, columns), to_viewer, step, shift, np.cos(lowest), radius, steps)
            horizon = side * np.minimum(np.arccos(np.clip(cosine, -1, 1)), side * lowest)
            light += weight * light_up_to(horizon, turned)
            open_light += weight * light_up_to(lowest, turned)
    found = np.where(open_light > 0, light / np.where(open_light > 0, open_light, 1), 1)
    return np.where(seen.present[rows, columns], np.clip(found, 0, 1), 1)


def _horizon(
    seen: SeenSurfaces,
    pixel: tuple[Rows, Rows],
    to_viewer: Array,
    along: Array,
    shift: Array,
    lowest: Array,
    radius: float,
    steps: int,
) -> Array:
    """Return the cosines (h, w) of the steepest horizons along lines in the picture, at least `lowest`.

    pixel: rows and columns (h, w); along: (h, w, 2) pixels to the right and up.
    """
    highest, (height, width) = lowest, seen.present.shape
    for step in range(steps):
        part = ((step + shift) / steps)[..., None]
        offset = np.rint(along * part**2 + np.sign(along)).astype(int)
        row, column = pixel[0] + offset[..., 1], pixel[1] + offset[..., 0]
        inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
        row, column = np.where(inside, row, 0), np.where(inside, column, 0)
        beside = seen.point[row, column] - seen.point[pixel]
        away = np.maximum(np.linalg.norm(beside, axis=-1), 1e-6)
        rise = np.sum(beside * seen.normal[pixel], -1) / away
        fade = np.clip(2 - 2 * away / radius, 0, 1) * np.clip(rise / RISES, 0, 1) * inside
        highest = np.maximum(highest, lowest + fade * (np.sum(beside * to_viewer, -1) / away - lowest))
    return np.asarray(highest)


def with_reflected(visibility: Array, albedo: Array) -> Array:
    """Return the part of the light that arrives once surfaces of the same colour have reflected it too (§6).

    Parameters
    ----------
    visibility : (n,) the part that arrives directly.
    albedo : (n, 3) linear.

    Returns
    -------
    (n, 3) at least `visibility`.
    """
    v = visibility[:, None]
    cubic, square, linear = 2.0404 * albedo - 0.3324, -4.7951 * albedo + 0.6417, 2.7552 * albedo + 0.6903
    return np.asarray(np.maximum(v, ((v * cubic + square) * v + linear) * v))
