"""A planar depth image as the paper draws it: warped in its plane by Table(depth) and lit in texture space (Liu et al.
2007, §2.2 and §2.4).

Texture space: u to the right and v upward on the image's plane, depth into it, all in metres, so that angles are those
of the world. It is left-handed: a normal (x, y, z) of the image points to (x, y, −z) there.
"""

from dataclasses import dataclass

import numpy as np

from depthwalk.reference.warp import table
from depthwalk.types import Array


@dataclass(frozen=True)
class Placement:
    """Where an image is: world = position + scale · rotation @ (u, v, −depth).

    position (3,), metres: of the texture space's origin; rotation (3, 3): columns are the image's x, y and z.
    """

    position: Array
    rotation: Array
    scale: float

    def direction(self, world: Array) -> Array:
        """World directions (…, 3) in texture space; their length stays."""
        return (world @ self.rotation) * [1, 1, -1]

    def point(self, world: Array) -> Array:
        """World points (…, 3) in texture space."""
        return self.direction(world - self.position) / self.scale

    def world(self, texture: Array) -> Array:
        """Points (…, 3) of texture space in the world."""
        return self.position + self.scale * (texture * [1, 1, -1]) @ self.rotation.T


def warp_samples(samples: Array, viewer: Array) -> Array:
    """Where samples (n, 3), (u_s, v_s, depth), go on the plane, (n, 2): by Table(depth) of the way to the epipole
    (u_e, v_e). viewer: (3,), (u_e, v_e, −D_t)."""
    moved = table(samples[:, 2], -viewer[2])
    return samples[:, :2] + moved[:, None] * (viewer[:2] - samples[:, :2])


def view_vectors(samples: Array, viewer: Array) -> Array:
    """VD = (u_e, v_e, −D_t) − (u_s, v_s, depth), (n, 3): from each sample to the viewer."""
    return viewer - samples


def phong(
    samples: Array,
    viewer: Array,
    normal: Array,
    albedo: Array,
    specular: Array,
    shininess: Array,
    to_sun: Array,
    up: Array,
    sun: Array,
    ambient: Array,
) -> Array:
    """Linear RGB (n, 3) of samples (n, 3), all in texture space: `reference.light.phong` without a world.

    viewer (3,); normal (n, 3), to_sun (3,) and up (3,), the world's, unit; albedo (n, 3); specular, shininess (n,);
    sun, ambient (3,) linear.
    """
    to_viewer = view_vectors(samples, viewer)
    to_viewer = to_viewer / np.linalg.norm(to_viewer, axis=1, keepdims=True)
    facing = normal @ to_sun
    # The mirrored sun against the viewer; the mirrored view against the sun is the same number.
    mirrored = 2 * facing[:, None] * normal - to_sun
    highlight = np.maximum(np.einsum("ni,ni->n", mirrored, to_viewer), 0) ** np.maximum(shininess, 1)
    highlight = np.where(facing > 0, specular * highlight, 0)
    everywhere = ambient * (0.75 + 0.25 * (normal @ up))[:, None]
    return albedo * (everywhere + sun * np.maximum(facing, 0)[:, None]) + sun * highlight[:, None]
