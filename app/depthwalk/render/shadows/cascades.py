"""Fit the sun's shadow maps to the view: one for each of several slices by distance, each seen along the light.

Near the viewer a map covers little and shows fine edges; farther maps cover more (Zhang et al. 2006, "Parallel-Split
Shadow Maps for Large-scale Virtual Environments"). The maps are placed so that they change as seldom as possible.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View, matrix_array
from depthwalk.scene.render_settings import ShadowParams
from depthwalk.types import Array

DEPTH = 1.5  # depth of a map, in widths: so deep a map need not move as often along the light; shaders read it
_STEPS_PER_RADIUS = 4  # steps by which a map's centre moves sideways, per radius of its slice
_NEAREST_SPLIT = 1 / 64  # of the distance: logarithms of the near plane itself would give slices of centimetres


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

        They are those that meet the prism which begins at the map's far side and goes on towards the sun without end.

        Parameters
        ----------
        bounds
            The n spheres, world.

        Returns
        -------
        NDArray[np.bool_]
            (n,) whether each sphere may.
        """
        right, up, toward = ((bounds.centre - np.array(self.centre, np.float32)) @ self.axes.T.astype(np.float32)).T
        across = np.maximum(np.abs(right), np.abs(up)) < self.half + bounds.bounding_radius
        return np.asarray(across & (toward > -(DEPTH * self.half + bounds.bounding_radius)))

    def texels(self, bounds: Bounds) -> tuple[Array, Array]:
        """Return what a texel of the map covers where spheres are; for the sun this is the same everywhere.

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


def fit_cascades(view: View, to_sun: Array, params: ShadowParams) -> tuple[Cascade, ...]:
    """Place the sun's maps for what `view` sees up to `params.distance`.

    A map holds the bounding sphere of its slice of the frustum, so that its size does not change as the viewer turns.
    Its centre moves by whole texels, so that edges of shadows do not swim, and by many at a time, so that it is seldom
    redrawn; along the light by more still, which costs no texels.

    Parameters
    ----------
    view
        The view, with near and far plane fitted to what it sees.
    to_sun
        (3,) direction towards the sun, of any length, world.
    params
        How many maps there are, how far they reach, and how fine they are.

    Returns
    -------
    tuple of Cascade
        The nearest first; none where everything in sight is beyond the distance.
    """
    near, far = view.depth_range
    distance = min(params.distance, _stepped(far, np.ceil, 2**0.5))
    if near >= distance:
        return ()
    axes = light_axes(to_sun)
    begin = max(_stepped(near, np.floor, 4.0), _NEAREST_SPLIT * distance)
    ends = split_distances(begin, distance, params.cascades, params.split)
    spread = float(np.square(view.half_extent).sum())
    light_from_world, forward = glm.dmat3(axes), glm.dvec3(view.axes[2])
    cascades = []
    for first, last in zip([0.0, *ends[:-1].tolist()], ends.tolist(), strict=True):
        along = min(last, (first + last) / 2 * (1 + spread))
        radius = float(np.sqrt(max((last - along) ** 2 + spread * last**2, (along - first) ** 2 + spread * first**2)))
        step = radius / _STEPS_PER_RADIUS
        half = radius + step / 2
        texel = 2 * half / params.resolution
        sideways = max(np.floor(step / texel), 1.0) * texel
        steps = glm.dvec3(sideways, sideways, 2 * (DEPTH * half - radius))
        middle = light_from_world * (glm.dvec3(view.position) + forward * along)
        centre = (glm.round(middle / steps) * steps) * light_from_world  # a row vector is turned back
        cascades.append(Cascade(centre=centre.to_tuple(), half=half, axes=axes, resolution=params.resolution))
    return tuple(cascades)


def split_distances(near: float, far: float, count: int, share: float) -> NDArray[np.float64]:
    """Return where slices of the view end: the practical split scheme of Zhang et al. 2006.

    Parameters
    ----------
    near
        Distance from the viewer at which the first slice begins, metres.
    far
        Distance from the viewer at which the last slice ends, metres.
    count
        How many slices.
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


def _stepped(distance: float, rounding: np.ufunc, base: float) -> float:
    """Return a distance rounded to a power of `base`: so maps keep their size while the view's range changes little."""
    return float(base ** rounding(np.log(distance) / np.log(base)))
