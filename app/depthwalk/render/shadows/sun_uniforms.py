"""Shadow maps as the shaders take them."""

from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from depthwalk.render.lod.selection import error_at_a_metre
from depthwalk.render.shadows.cascades import Cascade
from depthwalk.render.view.view import View
from depthwalk.scene.render_settings import MAX_CASCADES, LodParams, ShadowParams

COLUMNS = 2  # of tiles in the texture


@dataclass(frozen=True, kw_only=True)
class LampMaps:
    """texture: depth, tiles of equal size; params: what they were drawn by."""

    texture: moderngl.Texture
    params: ShadowParams


@dataclass(frozen=True, kw_only=True)
class SunMaps:
    """texture: depth, tiles of equal size, `COLUMNS` to a row; cascades: what each shows, the nearest first, all along
    one light; params: what they were drawn by."""

    texture: moderngl.Texture
    cascades: tuple[Cascade, ...]
    params: ShadowParams

    def use(self, unit: int, view: View, lod: LodParams) -> dict[str, Any]:
        """Binds the texture to a unit; the uniforms of shaders/common/sun_maps.glsl."""
        self.texture.use(unit)
        params = self.params
        axes = self.cascades[0].axes * np.array([[1], [1], [-1]])
        places = np.zeros((MAX_CASCADES, 4), np.float32)
        for place, cascade in zip(places, self.cascades, strict=False):
            place[:3] = axes @ (view.position - cascade.centre) / (2 * cascade.half) + 0.5
            place[3] = 1 / (2 * cascade.half)
        return {
            "sun_maps": unit,
            "cascades": len(self.cascades),
            "light_from_world": tuple(axes.T.ravel().tolist()),
            "places": places.tobytes(),
            "map_resolution": self.cascades[0].resolution,
            "filter_width": params.filter_width,
            "error": params.worst_error,
            "seen_error": error_at_a_metre(view, lod),
            "shadow_reach": params.distance,
        }
