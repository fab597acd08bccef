"""Draw a planar depth image as the paper does, warped in its plane and lit in texture space.

Liu, Liu and Wu 2007, §2.2 (warp) and §2.4 (shading). No shader works in texture space: depthwalk warps and lights all
depth images by the general equations of shaders/warp/warp.vert and shaders/common/phong.glsl. This twin is the paper's
own formulation for a single plane, with which the tests show that both give the same result.

Texture space has u to the right and v upward on the image's plane and depth into it, all in metres, so that angles are
those of the world. It is left-handed: a normal (x, y, z) of the image points to (x, y, −z) there.
"""

from dataclasses import dataclass

import numpy as np

from depthwalk.reference.light import Surfaces
from depthwalk.reference.warp import table
from depthwalk.types import Array


@dataclass(frozen=True)
class Placement:
    """Place an image in the world: world = position + scale · rotation @ (u, v, −depth).

    Attributes
    ----------
    position
        (3,) origin of the texture space, metres, world.
    rotation
        (3, 3) whose columns are the image's x, y and z axes, unit vectors of the world.
    scale
        Metres of the world per metre of the image.
    """

    position: Array
    rotation: Array
    scale: float

    def direction(self, world: Array) -> Array:
        """Return the directions `world` (…, 3) in texture space; their lengths are preserved."""
        return (world @ self.rotation) * [1, 1, -1]

    def point(self, world: Array) -> Array:
        """Return the points `world` (…, 3), metres, in texture space, metres of the image."""
        return self.direction(world - self.position) / self.scale

    def world(self, texture: Array) -> Array:
        """Return the points `texture` (…, 3) of texture space, metres of the image, in the world, metres."""
        return self.position + self.scale * (texture * [1, 1, -1]) @ self.rotation.T


def warp_samples(samples: Array, viewer: Array) -> Array:
    """Warp samples within the image's plane: each moves toward the epipole (u_e, v_e) (§2.2).

    `reference.warp.table` gives the fraction of this way that a sample moves, by its depth.

    Parameters
    ----------
    samples
        (n, 3) u_s, v_s and depth, metres, texture space.
    viewer
        (3,) u_e, v_e and −D_t, metres, texture space: the viewer is D_t before the plane.

    Returns
    -------
    Array
        (n, 2) u and v of the warped samples, metres, texture space.
    """
    moved = table(samples[:, 2], -viewer[2])
    return samples[:, :2] + moved[:, None] * (viewer[:2] - samples[:, :2])


def view_vectors(samples: Array, viewer: Array) -> Array:
    """Return the vector from each sample to the viewer: (u_e, v_e, −D_t) − (u_s, v_s, depth) (§2.4).

    Parameters
    ----------
    samples
        (n, 3) u_s, v_s and depth, metres, texture space.
    viewer
        (3,) u_e, v_e and −D_t, metres, texture space.

    Returns
    -------
    Array
        (n, 3) vectors, metres, texture space.
    """
    return viewer - samples


def phong(
    samples: Array, surfaces: Surfaces, viewer: Array, to_sun: Array, up: Array, sun: Array, ambient: Array
) -> Array:
    """Light samples in texture space, as `reference.light.phong` does in the world (§2.4).

    Parameters
    ----------
    samples
        (n, 3) u, v and depth, metres. All points and vectors are in texture space.
    surfaces
        The surfaces at the samples.
    viewer
        (3,) u, v and depth of the viewer, metres; its depth is negative.
    to_sun
        (3,) unit vector to the sun.
    up
        (3,) the world's up, as a unit vector of texture space.
    sun, ambient
        (3,) linear RGB of the two lights.

    Returns
    -------
    Array
        (n, 3) linear RGB.
    """
    to_viewer = view_vectors(samples, viewer)
    to_viewer = to_viewer / np.linalg.norm(to_viewer, axis=1, keepdims=True)
    facing = surfaces.normal @ to_sun
    # The mirrored sun against the viewer; the mirrored view against the sun is the same number.
    mirrored = 2 * facing[:, None] * surfaces.normal - to_sun
    highlight = np.maximum(np.einsum("ni,ni->n", mirrored, to_viewer), 0) ** np.maximum(surfaces.shininess, 1)
    highlight = np.where(facing > 0, surfaces.specular * highlight, 0)
    from_everywhere = ambient * (0.75 + 0.25 * (surfaces.normal @ up))[:, None]
    return surfaces.albedo * (from_everywhere + sun * np.maximum(facing, 0)[:, None]) + sun * highlight[:, None]
