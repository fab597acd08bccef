"""Where the sun's shadow maps lie: one for each of several slices of the view, each seen along the light."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View, matrix_array
from depthwalk.scene.render_settings import ShadowParams
from depthwalk.types import Array

DEPTH = 1.5  # of a map, in widths: along the light it need not move as often
_STEPS = 4  # a map's centre moves by this part of the radius of its slice, sideways
_FIRST = 1 / 64  # of the distance: what logarithms take for the near plane, which would have slices of centimetres


@dataclass(frozen=True, kw_only=True)
class Cascade:
    """The view of a shadow map, orthographic. centre: world, metres; half: half its width and height, metres; axes:
    rows right, up and towards the sun (3, 3), world, unit; resolution: texels along an edge."""

    centre: tuple[float, float, float]
    half: float
    axes: Array
    resolution: int

    @property
    def texel(self) -> float:
        """Metres."""
        return 2 * self.half / self.resolution

    @property
    def light(self) -> tuple[float, float, float, float]:
        """Where the light is, homogeneous: infinitely far, in this direction."""
        x, y, z = self.axes[2].tolist()
        return x, y, z, 0.0

    @cached_property
    def clip_from_centre(self) -> glm.dmat4:
        """The orthographic projection of world vectors from the centre to clip coordinates."""
        return glm.scale(glm.dvec3(1, 1, -1 / DEPTH) / self.half) * glm.dmat4(glm.dmat3(self.axes))

    def meets(self, bounds: Bounds) -> NDArray[np.bool_]:
        """Which spheres (n,) may cast a shadow within the map: those that meet the prism from its far side towards the
        sun."""
        right, up, toward = ((bounds.centre - np.array(self.centre, np.float32)) @ self.axes.T.astype(np.float32)).T
        across = np.maximum(np.abs(right), np.abs(up)) < self.half + bounds.bounding_radius
        return np.asarray(across & (toward > -(DEPTH * self.half + bounds.bounding_radius)))

    def texels(self, bounds: Bounds) -> tuple[Array, Array]:
        """What a texel covers, metres (n,), where spheres come nearest to the light, and about their middle."""
        texel = np.full(len(bounds.bounding_radius), self.texel)
        return texel, texel


def light_axes(to_sun: Array) -> NDArray[np.float64]:
    """Return the axes in which a light's shadow map lies: rows right, up and towards the light (3, 3), unit, world.

    The coordinate axis farthest from the light's direction points up in the map. to_sun: (3,), of any length.
    """
    up = glm.dvec3()
    up[int(np.argmin(np.abs(to_sun)))] = 1
    return matrix_array(glm.dmat3(glm.lookAt(glm.dvec3(), -glm.dvec3(*to_sun), up)))


def fit_cascades(view: View, to_sun: Array, params: ShadowParams) -> tuple[Cascade, ...]:
    """The maps, nearest first, for what `view` sees up to `params.distance`. to_sun: (3,), of any length, world.

    A map holds the bounding sphere of its slice of the frustum, so that its size does not change as the viewer turns.
    Its centre moves by whole texels, so that edges of shadows do not swim, and by many, so that it is seldom redrawn;
    along the light by more still, which costs no texels.
    """
    near, far = view.depth_range
    distance = min(params.distance, _stepped(far, np.ceil, 2**0.5))
    if near >= distance:
        return ()
    axes = light_axes(to_sun)
    begin = max(_stepped(near, np.floor, 4.0), _FIRST * distance)
    ends = split_distances(begin, distance, params.cascades, params.split)
    spread = float(np.square(view.half_extent).sum())
    light_from_world, forward = glm.dmat3(axes), glm.dvec3(view.axes[2])
    cascades = []
    for first, last in zip([0.0, *ends[:-1].tolist()], ends.tolist(), strict=True):
        along = min(last, (first + last) / 2 * (1 + spread))
        radius = float(np.sqrt(max((last - along) ** 2 + spread * last**2, (along - first) ** 2 + spread * first**2)))
        step = radius / _STEPS
        half = radius + step / 2
        texel = 2 * half / params.resolution
        sideways = max(np.floor(step / texel), 1.0) * texel
        steps = glm.dvec3(sideways, sideways, 2 * (DEPTH * half - radius))
        middle = light_from_world * (glm.dvec3(view.position) + forward * along)
        centre = (glm.round(middle / steps) * steps) * light_from_world  # a row vector is turned back
        cascades.append(Cascade(centre=centre.to_tuple(), half=half, axes=axes, resolution=params.resolution))
    return tuple(cascades)


def split_distances(near: float, far: float, count: int, share: float) -> NDArray[np.float64]:
    """Where `count` slices of near … far end (count,), metres: Zhang et al. 2006, "Parallel-Split Shadow Maps for
    Large-scale Virtual Environments", the practical split. share: of the logarithmic one."""
    part = np.arange(1, count + 1) / count
    return share * near * (far / near) ** part + (1 - share) * (near + (far - near) * part)


def _stepped(distance: float, rounding: np.ufunc, base: float) -> float:
    """Rounded to a power of `base`, so that maps keep their size while the range of the view changes little."""
    return float(base ** rounding(np.log(distance) / np.log(base)))
