"""Twin of shaders/common/phong.glsl and shaders/light."""

import numpy as np

from depthwalk.types import Array


def reflected(albedo: Array, specular: Array, shininess: Array, normal: Array, view: Array, to_light: Array) -> Array:
    """Linear RGB (n, 3) that surfaces send to the viewer of light of strength 1 (Phong 1975). albedo (n, 3); specular,
    shininess (n,); normal, view (n, 3) unit, `view` from the viewer to the surface; to_light (n, 3) or (3,) unit."""
    lambert = np.maximum((normal * to_light).sum(-1), 0)
    mirrored = view - 2 * np.einsum("ni,ni->n", view, normal)[:, None] * normal
    cosine = np.maximum((mirrored * to_light).sum(-1), 0)
    highlight = np.where(lambert > 0, specular * cosine ** np.maximum(shininess, 1), 0)
    return albedo * lambert[:, None] + highlight[:, None]


def phong(
    albedo: Array,
    specular: Array,
    shininess: Array,
    normal: Array,
    view: Array,
    to_sun: Array,
    sun: Array,
    ambient: Array,
) -> Array:
    """Linear RGB (n, 3) in the light of the sun and of `ambient:`. As for `reflected`; all vectors in the world; to_sun
    (3,) unit; sun, ambient (3,) linear."""
    everywhere = ambient * (0.75 + 0.25 * normal[:, 1:2])
    return albedo * everywhere + sun * reflected(albedo, specular, shininess, normal, view, to_sun)


def lamp_light(
    point: Array, position: Array, reach: float, axis: Array | None = None, angle: float = np.pi
) -> tuple[Array, Array]:
    """What of a lamp's light at 1 m reaches points (n, 3), and the unit vectors (n, 3) to it. reach: its range, metres;
    axis: (3,) unit, where a spot light shines; angle: of its cone, radians.

    Karis 2013, "Real Shading in Unreal Engine 4": (1 − (d/range)⁴)² / d². A cone is whole within 0.8 of its angle and
    from there fades with the square of the cosine's part of the way to its edge.
    """
    to_lamp = position - point
    distance = np.linalg.norm(to_lamp, axis=1)
    to_lamp = to_lamp / distance[:, None]
    strength = np.maximum(1 - (distance / reach) ** 4, 0) ** 2 / np.maximum(distance, 0.01) ** 2
    if axis is not None:
        edge, full = np.cos(angle / 2), np.cos(0.8 * angle / 2)
        strength = strength * np.clip((-(to_lamp @ axis) - edge) / (full - edge), 0, 1) ** 2
    return strength, to_lamp
