"""Store and look up the surroundings of a viewer: the twin of shaders/reprojection/capture.frag and surround.glsl."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.view_directions import direction_from_square, square_from_direction
from depthwalk.reference.reprojection import look_up
from depthwalk.render.reprojection.surround import SURROUND_STEPS
from depthwalk.render.view.field_of_view import shows
from depthwalk.render.view.view import View
from depthwalk.types import Array, Mask


def captured(picture: View, distances: Array, places: Array) -> NDArray[np.float64]:
    """Return what a map of all directions stores of a picture.

    Parameters
    ----------
    picture
        The view of the picture.
    distances
        (h, w) metres along the picture's view axis, lower row first.
    places
        (n, 2) positions in the map, 0 to 1.

    Returns
    -------
    NDArray[np.float64]
        (n, 4) position from which each direction was seen, world, and distance of its surface, metres; 0 where the
        picture shows nothing.
    """
    seen = direction_from_square(2 * places - 1, False) @ picture.axes.T
    inside = shows(picture, seen)
    ahead = np.where(inside, seen[:, 2], 1.0)
    place = 0.5 + 0.5 * seen[:, :2] / (ahead[:, None] * np.array(picture.half_extent))
    away = look_up(distances, np.where(inside[:, None], place, 0)) / ahead
    surfaces = np.column_stack([np.tile(picture.position, (len(places), 1)), away])
    return np.where(inside[:, None], surfaces, 0.0)


def places_around(surfaces: Array, viewer: Array, rays: Array) -> tuple[NDArray[np.float64], Mask]:
    """Return where in a map of all directions the surfaces on a viewer's rays were seen.

    Fixed-point iteration alternates between the distance of the surface at a position of the map, and the position in
    the map of the point at that distance along the ray.

    Parameters
    ----------
    surfaces
        (size, size, 4) as `captured` returns them, for the centres of all texels, lowest row first.
    viewer
        (3,) world, metres.
    rays
        (n, 3) unit, world.

    Returns
    -------
    tuple[NDArray[np.float64], Mask]
        (n, 2) positions, 0 to 1, and (n,) whether anything is known there.
    """

    def surface_at(place: Array) -> NDArray[np.float64]:
        return np.stack([look_up(surfaces[..., k], place) for k in range(4)], -1)

    place = 0.5 + 0.5 * square_from_direction(rays, False)
    surface = surface_at(place)
    known = surface[:, 3] > 0
    goes_on = known
    for _ in range(SURROUND_STEPS):
        offset = surface[:, :3] - viewer
        point = offset + surface[:, 3:] * direction_from_square(2 * place - 1, False)
        along = np.maximum((point * rays).sum(1), 1e-2)
        following = 0.5 + 0.5 * square_from_direction(along[:, None] * rays - offset, False)
        hit = surface_at(following)
        goes_on = goes_on & (hit[:, 3] > 0)
        place = np.where(goes_on[:, None], following, place)
        surface = np.where(goes_on[:, None], hit, surface)
    return place, known
