"""Place the cascades, the sun's shadow maps about the viewer: one for each of several slices by distance.

Near the viewer a map covers little and shows fine edges; farther maps cover more (Zhang et al. 2006, "Parallel-Split
Shadow Maps for Large-scale Virtual Environments"). They are placed so that they change as seldom as possible.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.geometry.vectors import components
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View, matrix_array
from depthwalk.scene.effect_settings import ShadowParams
from depthwalk.types import Array

DEPTH = 1.5  # depth of a map, in widths: deep enough to move rarely along the light; shaders read it
_STEPS_PER_RADIUS = 2  # steps in which the nearest map moves sideways, per radius of its slice; each map has one more
_EXTENT_STEPS = 16  # least number of steps, per radius, in which the sphere of all shadows grows and moves
_NEAREST_SPLIT = 1 / 64  # of the distance: splitting from the near plane would give slices of centimetres


@dataclass(frozen=True, kw_only=True)
class Cascade:
    """Describe what a shadow map of the sun sees: an orthographic picture of a box.

    Attributes
    ----------
    centre
        The middle of the box that it sees, metres, world.
    half
        Half the width and half the height of that box, metres.
    axes
        (3, 3) rows right, up and towards the sun, unit vectors, world.
    resolution
        Texels along an edge.
    """

    centre: tuple[float, float, float]
    half: float
    axes: Array
    resolution: int

    @property
    def texel(self) -> float:
        """Return the length that the edge of a texel covers, metres."""
        return 2 * self.half / self.resolution

    @property
    def light(self) -> tuple[float, float, float, float]:
        """Return the direction to the sun, world, as a point at infinity in homogeneous coordinates."""
        x, y, z = self.axes[2].tolist()
        return x, y, z, 0.0

    @cached_property
    def clip_from_centre(self) -> glm.dmat4:
        """Return the orthographic projection of world vectors from the centre, metres, to clip coordinates."""
        return glm.scale(glm.dvec3(1, 1, -1 / DEPTH) / self.half) * glm.dmat4(glm.dmat3(self.axes))

    def meets(self, bounds: Bounds) -> NDArray[np.bool_]:
        """Return which spheres may cast a shadow within the map.

        These meet the prism that begins at the map's far side and extends towards the sun without end.

        Parameters
        ----------
        bounds
            The n spheres, world.

        Returns
        -------
        NDArray[np.bool_]
            (n,) whether each sphere may cast a shadow in it.
        """
        right, up, toward = ((bounds.centre - np.array(self.centre, np.float32)) @ self.axes.T.astype(np.float32)).T
        across = np.maximum(np.abs(right), np.abs(up)) < self.half + bounds.bounding_radius
        return np.asarray(across & (toward > -(DEPTH * self.half + bounds.bounding_radius)))

    def rectangle(self, bounds: Bounds) -> tuple[int, int, int, int]:
        """Return where n spheres may be in the map, texels: left, bottom, width and height; width 0 without any."""
        if not len(bounds.bounding_radius):
            return 0, 0, 0, 0
        across = (bounds.centre - np.array(self.centre, np.float32)) @ self.axes[:2].T.astype(np.float32)
        radius = bounds.bounding_radius[:, None]
        low = np.floor(((across - radius).min(0) / self.half + 1) / 2 * self.resolution).clip(0, self.resolution)
        high = np.ceil(((across + radius).max(0) / self.half + 1) / 2 * self.resolution).clip(0, self.resolution)
        (left, bottom), (width, height) = low.astype(int).tolist(), (high - low).astype(int).tolist()
        return left, bottom, width, height

    def texels(self, bounds: Bounds) -> tuple[Array, Array]:
        """Return the length that a texel of the map covers where spheres are; for the sun the same everywhere.

        Parameters
        ----------
        bounds
            The n spheres, world.

        Returns
        -------
        tuple[Array, Array]
            Metres (n,) where each sphere comes nearest to the light, and metres (n,) at its middle.
        """
        texel = np.full(len(bounds.bounding_radius), self.texel)
        return texel, texel


def light_axes(to_sun: Array) -> NDArray[np.float64]:
    """Return the axes of a light's shadow map.

    The coordinate axis farthest from the light's direction points up in the map.

    Parameters
    ----------
    to_sun
        (3,) direction towards the light, of any length, world.

    Returns
    -------
    NDArray[np.float64]
        (3, 3) rows right, up and towards the light, unit vectors, world.
    """
    up = glm.dvec3()
    up[int(np.argmin(np.abs(to_sun)))] = 1
    return matrix_array(glm.dmat3(glm.lookAt(glm.dvec3(), -glm.dvec3(*to_sun), up)))


def shadow_extent(bounds: Bounds, to_sun: Array, ground: float | None) -> tuple[Array, float] | None:
    """Return a sphere that holds all objects and the shadows that they cast on the ground.

    No shadow of the sun falls outside it, however large the ground is. It is the sphere about the objects, extended by
    half the way along the light from their highest point down to the ground, and rounded up, so that it stays in place
    while an object moves; otherwise the shadows of objects at rest would swim.

    Parameters
    ----------
    bounds
        Spheres about the n objects, world.
    to_sun
        (3,) unit vector towards the sun, world.
    ground
        y of the ground, metres, world; None where there is none.

    Returns
    -------
    tuple[Array, float] | None
        Its centre (3,), metres, world, and its radius, metres. None if there are no objects, or if a sun at or below
        the horizon casts shadows without end.
    """
    if not len(bounds.bounding_radius):
        return None
    middle, radius = bounds.sphere()
    if ground is None:
        return _snapped(middle, radius)
    if to_sun[1] <= 0:
        return None
    top = float((bounds.centre[:, 1] + bounds.bounding_radius).max())
    way = max(top - ground, 0.0) / float(to_sun[1])
    return _snapped(middle - way / 2 * to_sun, radius + way / 2)


def fit_cascades(
    view: View, to_sun: Array, params: ShadowParams, extent: tuple[Array, float] | None = None
) -> tuple[Cascade, ...]:
    """Place the sun's maps about the viewer, up to a distance of `params.distance`.

    A map holds the sphere about the viewer whose radius is the end of its slice, so that turning and zooming change no
    map (a clipmap: Losasso and Hoppe 2004, "Geometry Clipmaps"). Its centre moves by whole texels, so that edges of
    shadows do not swim, and by many at a time, so that it is seldom redrawn; along the light by even more, which costs
    no texels. A map that would be larger than `extent` is fitted to that, does not move, and is the last.

    Parameters
    ----------
    view
        The view, with near and far plane fitted to what it sees.
    to_sun
        (3,) direction towards the sun, of any length, world.
    params
        Number, reach and resolution of the maps.
    extent
        Centre (3,), metres, world, and radius, metres, of a sphere that holds all shadows, see `shadow_extent`; None if
        there is no such sphere.

    Returns
    -------
    tuple of Cascade
        The nearest first; none if everything in sight is beyond the distance.
    """
    middle, size = (view.position, np.inf) if extent is None else extent
    distance = min(params.distance, _power_of_two(float(np.linalg.norm(middle - view.position)) + size))
    if view.depth_range[0] >= distance:
        return ()
    axes = light_axes(to_sun)
    light_from_world = glm.dmat3(axes)
    viewer = light_from_world * glm.dvec3(*view.position)
    ends = split_distances(_NEAREST_SPLIT * distance, distance, params.cascades, params.split)
    cascades = []
    for number, radius in enumerate(ends.tolist()):
        step = radius / (_STEPS_PER_RADIUS + number)
        half = radius + step / 2
        if size <= half:
            cascades.append(Cascade(centre=tuple(middle.tolist()), half=size, axes=axes, resolution=params.resolution))
            break
        texel = 2 * half / params.resolution
        sideways = max(np.floor(step / texel), 1.0) * texel
        steps = glm.dvec3(sideways, sideways, 2 * (DEPTH * half - radius))
        centre = (glm.round(viewer / steps) * steps) * light_from_world  # a row vector: rotates back
        cascades.append(Cascade(centre=components(centre), half=half, axes=axes, resolution=params.resolution))
    return tuple(cascades)


def split_distances(near: float, far: float, count: int, share: float) -> NDArray[np.float64]:
    """Return the distances at which slices of the view end: the practical split scheme of Zhang et al. 2006.

    Parameters
    ----------
    near
        Distance from the viewer at which the first slice begins, metres.
    far
        Distance from the viewer at which the last slice ends, metres.
    count
        Number of slices.
    share
        Share of the logarithmic split, 0 to 1, which gives all slices the same error in pixels; the rest is the uniform
        split, which gives near slices more room.

    Returns
    -------
    NDArray[np.float64]
        (count,) distances, metres, rising; the last is `far`.
    """
    part = np.arange(1, count + 1) / count
    return share * near * (far / near) ** part + (1 - share) * (near + (far - near) * part)


def _power_of_two(distance: float) -> float:
    """Round up to a power of 2, so that maps keep their size while a viewer walks about a small scene."""
    return float(2 ** np.ceil(np.log2(distance)))


def _snapped(middle: Array, radius: float) -> tuple[Array, float]:
    """Return an enclosing sphere whose centre and radius are multiples of a step, which depends on the radius."""
    step = _power_of_two(radius) / 2 / _EXTENT_STEPS
    snapped = np.round(middle / step) * step
    needed = float(np.linalg.norm(snapped - middle)) + radius
    return snapped, float(np.ceil(needed / step) * step)
