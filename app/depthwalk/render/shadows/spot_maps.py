"""Choose which spot lights have a shadow map in a frame, and what each map sees.

Point lights have none: light in all directions would take six maps.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.colour import linear_from_srgb
from depthwalk.render.shadows.cascades import light_axes
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.scene.camera import clip_from_view
from depthwalk.types import Array, Rows

if TYPE_CHECKING:
    from depthwalk.scene.environment import LampParams

Triple = tuple[float, float, float]

NEAR = 0.01  # of a lamp's range: nearer surfaces, such as the lamp's own glass, cast no shadow; shaders read it


@dataclass(frozen=True, kw_only=True)
class Spot:
    """Describe what the shadow map of a spot light sees: a pyramid about the cone of the lamp.

    Attributes
    ----------
    centre
        The position of the lamp, metres, world.
    axes
        (3, 3) rows right, up and back towards the lamp, unit vectors, world.
    angle
        Full angle of the cone, radians.
    reach
        The lamp's range, metres.
    resolution
        Texels along an edge.
    """

    centre: tuple[float, float, float]
    axes: Array
    angle: float
    reach: float
    resolution: int

    @property
    def tangent(self) -> float:
        """Return half the width that the map covers at one metre along the axis, metres."""
        return float(np.tan(self.angle / 2))

    @property
    def texel(self) -> float:
        """Return the length that the edge of a texel covers at one metre along the axis, metres."""
        return 2 * self.tangent / self.resolution

    @property
    def light(self) -> tuple[float, float, float, float]:
        """Return the position of the lamp relative to `centre`, which it is itself, in homogeneous coordinates."""
        return 0.0, 0.0, 0.0, 1.0

    @cached_property
    def clip_from_centre(self) -> glm.dmat4:
        """Return the perspective projection of world vectors from the lamp, metres, to clip coordinates."""
        return clip_from_view(self.angle, 1.0, NEAR * self.reach, self.reach) * glm.dmat4(glm.dmat3(self.axes))

    def meets(self, bounds: Bounds) -> NDArray[np.bool_]:
        """Return which spheres reach into the map's pyramid and so may cast a shadow in it; see `Cascade.meets`."""
        right, up, back = ((bounds.centre - np.array(self.centre, np.float32)) @ self.axes.T.astype(np.float32)).T
        across = np.maximum(np.abs(right), np.abs(up)) + self.tangent * back
        ahead = (back < bounds.bounding_radius) & (-back < self.reach + bounds.bounding_radius)
        return np.asarray(ahead & (across < bounds.bounding_radius * np.hypot(1, self.tangent)))

    def rectangle(self, bounds: Bounds) -> tuple[int, int, int, int]:
        """Return where spheres may be in the map, texels, as `Cascade.rectangle` does: all of it, if there are any."""
        side = self.resolution if len(bounds.bounding_radius) else 0
        return 0, 0, side, side

    def texels(self, bounds: Bounds) -> tuple[Array, Array]:
        """Return the length that a texel of the map covers where spheres are, as `Cascade.texels` does."""
        distance = np.linalg.norm(bounds.centre - np.array(self.centre), axis=1)
        nearest = np.maximum(distance - bounds.bounding_radius, NEAR * self.reach)
        return self.texel * nearest, self.texel * np.maximum(distance, bounds.bounding_radius)


def lamp_spot(lamp: "LampParams", resolution: int) -> Spot:
    """Return what the shadow map of a spot light sees.

    Parameters
    ----------
    lamp
        The spot light, which has a `direction`.
    resolution
        Texels along an edge of the map.

    Returns
    -------
    Spot
        The pyramid that the map sees, the same object as long as the lamp does not change.
    """
    assert lamp.direction is not None
    return _spot(lamp.position, lamp.direction, lamp.angle, lamp.range, resolution)


@lru_cache(maxsize=256)
def _spot(position: Triple, direction: Triple, angle: float, reach: float, resolution: int) -> Spot:
    """Return what the shadow map of a spot light sees, which has these `LampParams`."""
    axes = light_axes(-np.array(direction, float))
    return Spot(centre=position, axes=axes, angle=float(np.radians(angle)), reach=reach, resolution=resolution)


@dataclass(frozen=True, kw_only=True)
class ShadowLamps:
    """Hold the k lamps of a scene that cast shadows and are switched on, as long as none of its lamps changes.

    Attributes
    ----------
    number
        (k,) indices among all lamps.
    position
        (k, 3) metres, world.
    cones
        The bounding spheres of their cones, world.
    strength
        (k,) the largest of linear red, green and blue at 1 m.
    """

    number: Rows
    position: Array
    cones: Bounds
    strength: Array


def shadow_lamps(lamps: Sequence["LampParams"]) -> ShadowLamps:
    """Return those of all lamps of a scene, `lamps`, that may have a shadow map."""
    number = [number for number, lamp in enumerate(lamps) if lamp.shadow and lamp.intensity > 0]
    casting = [lamps[k] for k in number]
    colour = linear_from_srgb([lamp.colour for lamp in casting]).reshape(-1, 3)
    return ShadowLamps(
        number=np.array(number, int),
        position=np.array([lamp.position for lamp in casting], float).reshape(-1, 3),
        cones=_cones(casting),
        strength=colour.max(1) * [lamp.intensity for lamp in casting],
    )


def choose_shadow_lamps(view: View, lamps: ShadowLamps) -> list[int]:
    """Choose the lamps that should have a shadow map in this frame: those whose cones the view may see.

    Parameters
    ----------
    view
        The view of the picture.
    lamps
        The lamps that may have a shadow map.

    Returns
    -------
    list[int]
        Indices among all lamps; those that light the viewer's position most come first.
    """
    if not len(lamps.number):
        return []
    seen, _ = lamps.cones.visible(view)
    square = np.square(lamps.position[seen] - view.position).sum(1)
    order = seen[np.argsort(-lamps.strength[seen] / np.maximum(square, 1e-4), kind="stable")]
    chosen: list[int] = lamps.number[order].tolist()
    return chosen


def assign_tiles(chosen: Sequence[int], lamps: Sequence["LampParams"], count: int) -> dict[int, int]:
    """Assign each chosen lamp a tile of the atlas.

    A lamp gets the same tile in every frame, so that its map need not be drawn again, unless another chosen lamp has
    that tile; then it gets the next free one.

    Parameters
    ----------
    chosen
        Indices of the lamps that get a tile, at most `count`.
    lamps
        All lamps of the scene.
    count
        Number of tiles.

    Returns
    -------
    dict
        The tile by the index of the lamp.
    """
    rank = {number: k for k, number in enumerate(n for n, lamp in enumerate(lamps) if lamp.shadow)}
    tiles: dict[int, int] = {}
    for number in sorted(chosen):
        preferred = [(rank[number] + k) % count for k in range(count)]
        tiles[number] = next(tile for tile in preferred if tile not in tiles.values())
    return tiles


def _cones(lamps: Sequence["LampParams"]) -> Bounds:
    """Return the bounding spheres of the cones of spot lights."""
    place = np.array([lamp.position for lamp in lamps], float).reshape(-1, 3)
    axis = np.array([lamp.direction for lamp in lamps], float).reshape(-1, 3)
    half, reach = np.radians([lamp.angle / 2 for lamp in lamps]), np.array([lamp.range for lamp in lamps])
    wide = half > np.pi / 4
    along = np.where(wide, reach * np.cos(half), reach / (2 * np.cos(half)))
    radius = np.where(wide, reach * np.sin(half), along)
    return Bounds(place + axis / np.linalg.norm(axis, axis=1, keepdims=True) * along[:, None], radius)
