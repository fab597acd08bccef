"""Compute the reflection of light, as the twin of shaders/common/phong.glsl and shaders/light.

Surfaces reflect light by Phong's model (Phong 1975, "Illumination for Computer Generated Pictures"); lamps lose
strength with the distance as in Karis 2013, "Real Shading in Unreal Engine 4". All colours are linear RGB.
"""

from dataclasses import dataclass

import numpy as np

from depthwalk.types import Array


@dataclass(frozen=True, kw_only=True)
class Surfaces:
    """Hold what lighting must know of n surfaces.

    Attributes
    ----------
    albedo : (n, 3) linear RGB of the diffuse reflection, 0 to 1.
    specular : (n,) strength of the highlight, 0 to 1.
    normal : (n, 3) unit normals, in the frame of the light, often the world's.
    shininess : (n,) exponent of the highlight; below 1 it counts as 1.
    """

    albedo: Array
    specular: Array
    normal: Array
    shininess: Array


def reflected(surfaces: Surfaces, view: Array, to_light: Array) -> Array:
    """Return the light that surfaces reflect to the viewer from a light of strength 1 in one direction.

    Parameters
    ----------
    surfaces
        The n surfaces.
    view
        (n, 3) unit vectors from the viewer to the surfaces.
    to_light
        (n, 3) or (3,) unit vectors to the light. All vectors are in one frame, which may be any.

    Returns
    -------
    Array
        (n, 3) linear RGB; zero where the surface faces away from the light.
    """
    normal = surfaces.normal
    lambert = np.maximum((normal * to_light).sum(-1), 0)
    mirrored = view - 2 * np.einsum("ni,ni->n", view, normal)[:, None] * normal
    cosine = np.maximum((mirrored * to_light).sum(-1), 0)
    highlight = np.where(lambert > 0, surfaces.specular * cosine ** np.maximum(surfaces.shininess, 1), 0)
    return np.asarray(surfaces.albedo * lambert[:, None] + highlight[:, None])


def phong(surfaces: Surfaces, view: Array, to_sun: Array, sun: Array, ambient: Array) -> Array:
    """Return the light that surfaces send to the viewer, lit by the sun and by a scene's ambient light.

    The ambient light has the default direction and contrast: three quarters of it are the same for all surfaces, and
    the last quarter is multiplied by the normal's y, so that surfaces facing down get less.

    Parameters
    ----------
    surfaces
        The n surfaces; all vectors are in the world's frame.
    view
        (n, 3) unit vectors from the viewer to the surfaces.
    to_sun
        (3,) unit vector to the sun.
    sun, ambient
        (3,) linear RGB of the two lights.

    Returns
    -------
    Array
        (n, 3) linear RGB.
    """
    from_everywhere = ambient * (0.75 + 0.25 * surfaces.normal[:, 1:2])
    return surfaces.albedo * from_everywhere + sun * reflected(surfaces, view, to_sun)


def lamp_light(
    point: Array, position: Array, reach: float, axis: Array | None = None, angle: float = np.pi
) -> tuple[Array, Array]:
    """Return how strong a lamp's light is at points, and the directions from which it comes.

    At the distance d the strength is (1 − (d/range)⁴)² / d² (Karis 2013). A spot light has this strength within 0.8 of
    its cone's angle. From there to the cone's edge it is multiplied by t², where t falls from 1 to 0 linearly with the
    cosine of the angle.

    Parameters
    ----------
    point
        (n, 3) points, metres, world.
    position
        (3,) the lamp, metres, world.
    reach
        The lamp's range, metres, beyond which it gives no light.
    axis
        (3,) unit vector in which a spot light shines; None for a point light, which shines in all directions.
    angle
        Full angle of the spot light's cone, radians; a point light ignores it.

    Returns
    -------
    strength : Array
        (n,) factors of the lamp's colour; 1 at one metre, but for the fall-off towards the range.
    to_lamp : Array
        (n, 3) unit vectors from the points to the lamp, world.
    """
    to_lamp = position - point
    distance = np.linalg.norm(to_lamp, axis=1)
    to_lamp = to_lamp / distance[:, None]
    strength = np.maximum(1 - (distance / reach) ** 4, 0) ** 2 / np.maximum(distance, 0.01) ** 2
    if axis is not None:
        edge, full = np.cos(angle / 2), np.cos(0.8 * angle / 2)
        strength = strength * np.clip((-(to_lamp @ axis) - edge) / (full - edge), 0, 1) ** 2
    return strength, to_lamp
