"""Place a camera so that objects fill its picture."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.geometry.vectors import components
from depthwalk.render.view.bounds import Bounds
from depthwalk.scene.arrays import Camera, Objects
from depthwalk.scene.camera import view_from_world
from depthwalk.scene.similarity import from_yaw
from depthwalk.types import Array

# From the objects to a camera that sees them all, world: from in front, which is +z as in glTF, 30° to the right and
# 22° from above. So three sides show, and what faces −z shows not only its back; faces are still seen.
FRONT_RIGHT = glm.dvec3(0.5, 0.4, 0.87)
_FACING = (
    glm.dvec3(1, 0.25, 0),
    glm.dvec3(0, 1, 0.6),
    glm.dvec3(0, 0.25, 1),
)  # the same for what is flat along x, y, z
_FLAT = 0.1  # of the second extent: a model is flat whose least extent is below that
_FILLED = 0.9  # part of the picture's height or width that the objects fill
_NEAREST = 0.3  # of the objects' radius: least distance of any part of them, so that the perspective stays mild
_TURNS = 32  # directions that stand for a whole turn: between two of them, corners reach half a per cent farther
_BLOCK = 1024  # objects whose points are rotated at a time


def camera_on(
    objects: Objects,
    bounds: Bounds,
    extremes: Callable[[int], Array],
    *,
    aspect: float,
    fov: float,
    away: glm.dvec3,
    turns: bool = False,
) -> Camera:
    """Return the nearest camera that sees all objects, with a margin around.

    The direction of the camera fixes the directions of the four sides of its frustum. The points farthest along their
    normals determine where these planes must be, and so where the camera is.

    Parameters
    ----------
    objects : the n objects.
    bounds : their bounding spheres, world.
    extremes : returns the points (k, 3), metres, asset frame, that reach farthest of the asset with a given number. It
        is only called for assets of objects whose spheres may reach farthest of all.
    aspect : width of the picture over its height.
    fov : vertical angle of view, radians.
    away : direction from the objects to the camera, world, of any length.
    turns : whether the camera shall see them all also while it turns about its target, around the world's y axis.

    Returns
    -------
    The camera, world, its target in the middle of the objects; one near the origin where there are no objects.
    """
    if not len(objects):
        return Camera((0.0, 1.6, 5.0), (0.0, 1.0, 0.0), fov)
    middle, radius = bounds.sphere()
    away = away / max(map(abs, components(away)))  # so that no square of a small number is 0
    rigid = view_from_world(Camera(components(away), (0.0, 0.0, 0.0), fov))
    right, up, back = np.array(glm.dmat3(rigid).to_list()).T  # rows of the rotation, world
    across, down = np.array([aspect, 1.0]) * math.tan(fov / 2) * _FILLED
    # In view coordinates, z towards the viewer: a point is visible where ±x ≤ across · (z of the camera − z).
    sides = np.stack([right + across * back, across * back - right, up + down * back, down * back - up, back, -back])
    angles = np.linspace(0, 2 * np.pi, _TURNS, endpoint=False) if turns else np.zeros(1)
    turned = rotate(from_yaw(angles)[:, None], sides).reshape(-1, 3)
    reach = _reach(objects, bounds, extremes, turned, middle).reshape(-1, len(sides)).max(0)
    if turns:  # no side reaches farther than the opposite one, for the target to be on the axis
        reach = np.repeat(reach.reshape(-1, 2).max(1), 2)
    east, west, north, south, front, rear = reach
    toward = max((east + west) / (2 * across), (north + south) / (2 * down), front + _NEAREST * radius)
    depth = 0.0 if turns else (front - rear) / 2  # of the middle of the objects
    sideways = right * (east - west) / 2 + up * (north - south) / 2 + middle
    place, target = sideways + back * toward, sideways + back * depth
    return Camera(components(glm.dvec3(place)), components(glm.dvec3(target)), fov)


def facing(objects: Objects, bounds: Bounds, extremes: Callable[[int], Array]) -> glm.dvec3:
    """Return the direction from the objects to a camera that is to show them, world.

    It is FRONT_RIGHT, but a single flat object is seen from its broad side, a floor or a terrain from above: from the
    side it would be a line. `objects`, `bounds` and `extremes` are those of `camera_on`.
    """
    if len(objects) != 1:
        return FRONT_RIGHT
    reach = _reach(objects, bounds, extremes, np.concatenate([np.eye(3), -np.eye(3)]), bounds.sphere()[0])
    extent = reach[:3] + reach[3:]
    least, second, _ = np.sort(extent)
    return _FACING[int(extent.argmin())] if least < _FLAT * second else FRONT_RIGHT


def _reach(
    objects: Objects, bounds: Bounds, extremes: Callable[[int], Array], directions: Array, middle: Array
) -> NDArray[np.float64]:
    """Return how far objects reach from a point in given directions.

    Parameters
    ----------
    objects, bounds, extremes : see `camera_on`.
    directions : (d, 3) of any lengths, world.
    middle : (3,) the point, metres, world.

    Returns
    -------
    (d,) largest scalar product of each direction with the vector from `middle` to a point of the objects.
    """
    along = (bounds.centre - middle) @ directions.T
    spread = bounds.bounding_radius[:, None] * np.linalg.norm(directions, axis=1)
    rows = np.flatnonzero((along + spread >= (along - spread).max(0)).any(1))
    reach = np.full(len(directions), -np.inf)
    for asset in np.unique(objects.asset[rows]).tolist():
        points, members = extremes(asset), rows[objects.asset[rows] == asset]
        for block in np.split(members, range(_BLOCK, len(members), _BLOCK)):
            turned = rotate(conjugate(objects.rotation[block].astype(np.float64))[:, None], directions)
            place = (objects.position[block] - middle) @ directions.T
            scaled = objects.scale[block, None] * (turned @ points.T).max(-1, initial=-np.inf)
            reach = np.maximum(reach, (place + scaled).max(0))
    return reach
