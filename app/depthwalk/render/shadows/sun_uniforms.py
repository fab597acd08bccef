"""Hold shadow maps as shaders read them, for shaders/common/sun_maps.glsl and shaders/light."""

from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from depthwalk.render.lod.selection import error_at_a_metre
from depthwalk.render.shadows.cascades import Cascade
from depthwalk.render.view.view import View
from depthwalk.scene.effect_settings import MAX_CASCADES, ShadowParams
from depthwalk.scene.object_settings import LodParams

COLUMNS = 2  # tiles in a row of the sun's texture; shaders read it


@dataclass(frozen=True, kw_only=True)
class LampMaps:
    """Hold the shadow maps of lamps.

    Attributes
    ----------
    texture
        The depth texture, in square tiles of equal size.
    params
        The settings that the maps were drawn with.
    """

    texture: moderngl.Texture
    params: ShadowParams

    @property
    def defines(self) -> tuple[str, ...]:
        """Return the defines of the programs that look the maps up, for shaders/common/shadow_map.glsl."""
        return _defines(self.params)


@dataclass(frozen=True, kw_only=True)
class SunMaps:
    """Hold the shadow maps of the sun.

    Attributes
    ----------
    texture
        The depth texture, in square tiles of equal size, `COLUMNS` to a row.
    cascades
        What each tile shows, the nearest first; all look along one direction.
    params
        The settings that the maps were drawn with.
    """

    texture: moderngl.Texture
    cascades: tuple[Cascade, ...]
    params: ShadowParams

    @property
    def defines(self) -> tuple[str, ...]:
        """Return the defines of the programs that look the maps up, for shaders/common/shadow_map.glsl."""
        return _defines(self.params)

    def uniforms(self, view: View, lod: LodParams) -> dict[str, Any]:
        """Return the uniforms of shaders/common/sun_maps.glsl, except its sampler `sun_maps`.

        Parameters
        ----------
        view
            The view of the picture: points are looked up by world vectors from its position.
        lod
            The settings of detail, which bound the error of surfaces in the picture.

        Returns
        -------
        dict[str, Any]
            The uniforms by name.
        """
        params = self.params
        axes = self.cascades[0].axes * np.array([[1], [1], [-1]])
        places = np.zeros((MAX_CASCADES, 4), np.float32)
        for place, cascade in zip(places, self.cascades, strict=False):
            place[:3] = axes @ (view.position - cascade.centre) / (2 * cascade.half) + 0.5
            place[3] = 1 / (2 * cascade.half)
        return {
            "cascades": len(self.cascades),
            "light_from_world": tuple(axes.T.ravel().tolist()),
            "places": places.tobytes(),
            "map_resolution": self.cascades[0].resolution,
            "error": params.worst_error,
            "seen_error": error_at_a_metre(view, lod),
            "shadow_reach": params.distance,
        }


def _defines(params: ShadowParams) -> tuple[str, ...]:
    return (f"FILTER_WIDTH={params.filter_width}",)
