"""Choose the viewpoints of the measured pictures: 42 views on a sphere, and a few close ones."""

import math
from dataclasses import dataclass

import numpy as np
from pyglm import glm

from depthwalk.geometry.vectors import components
from depthwalk.ingest.mesh import Mesh
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera

FOV = 40.0  # degrees, vertical
FILL = 0.9  # of the frame's shorter side, filled by the bounding sphere's outline
CLOSE = 1.3  # radii from the centre of the bounding sphere

# Elevation, degrees: number of views. Every view represents about the same part of the sphere.
SPHERE_RINGS = {-50: 7, -22: 10, 5: 10, 33: 9, 60: 5, 88: 1}
CLOSE_RINGS = {-20: 2, 10: 4, 45: 2}


@dataclass(frozen=True)
class Viewpoint:
    """Hold the direction from which a view looks at an object.

    Attributes
    ----------
    elevation
        Height of the viewer above the object's horizon, degrees; 90 is straight above.
    azimuth
        Angle of the viewer about +Y, degrees; 0 looks from +Z, 90 from +X.
    close
        Whether to look from `CLOSE` bounding radii away, instead of from where the object fills the frame.
    """

    elevation: float
    azimuth: float
    close: bool = False


def _on_rings(rings: dict[int, int], close: bool = False) -> tuple[Viewpoint, ...]:
    """Spread views evenly over each ring; every second ring is rotated by half a step."""
    return tuple(
        Viewpoint(float(elevation), round((k + ring % 2 / 2) * 360 / count, 3), close)
        for ring, (elevation, count) in enumerate(rings.items())
        for k in range(count)
    )


SPHERE = _on_rings(SPHERE_RINGS)
CLOSE_BY = _on_rings(CLOSE_RINGS, close=True)
FEW = SPHERE[::4]  # 11 of them, at every elevation but the last
VERIFY = SPHERE[3::7]  # 6 of them


@dataclass(frozen=True)
class Sphere:
    """Hold a bounding sphere.

    Attributes
    ----------
    centre
        (3,) centre, metres, asset frame.
    radius
        Radius, metres.
    """

    centre: tuple[float, float, float]
    radius: float


def bounding_sphere(mesh: Mesh) -> Sphere:
    """Return the smallest sphere that holds `mesh` and has the centre of its bounding box, metres, asset frame."""
    low, high = (corner.astype(np.float64) for corner in mesh.bounds)
    centre = (low + high) / 2
    return Sphere(tuple(centre.tolist()), float(np.linalg.norm(mesh.positions - centre, axis=1).max()))


def view_of(sphere: Sphere, viewpoint: Viewpoint, size: tuple[int, int]) -> View:
    """Return the view of an object from a viewpoint.

    Parameters
    ----------
    sphere
        Bounding sphere of the object, metres.
    viewpoint
        Where to look from.
    size
        Width and height of the picture, pixels.

    Returns
    -------
    View
        The view, whose near and far planes depend on the object's size.
    """
    fov = math.radians(FOV)
    shorter = math.tan(fov / 2) * min(1.0, size[0] / size[1])
    distance = sphere.radius * (CLOSE if viewpoint.close else 1 / math.sin(math.atan(FILL * shorter)))
    position = glm.dvec3(*sphere.centre) + away(viewpoint) * distance
    # Relative to the object's size, not in metres: the depth buffer is as precise for a coin as for a cathedral.
    near, far = 0.02 * distance, distance + 4 * sphere.radius
    return View(Camera(components(position), sphere.centre, fov), size, near, far)


def away(viewpoint: Viewpoint) -> glm.dvec3:
    """Return the unit vector (3,), world, from the object towards a viewer at `viewpoint`."""
    return glm.euclidean(glm.radians(glm.dvec2(viewpoint.elevation, viewpoint.azimuth)))
