"""Light what the G-buffer holds by sun, ambient light and lamps (Phong 1975), and draw the sky behind it."""

from typing import Any

import numpy as np

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import RecordTexture
from depthwalk.render.frame import Frame
from depthwalk.render.lighting.light_clusters import LAMP_RECORD, NUMBERS_RECORD, LightClusters, visible_lamps
from depthwalk.render.lod.selection import error_at_a_metre
from depthwalk.render.pixel_pass import PixelInputs, PixelPass
from depthwalk.render.shadows.sun_uniforms import LampMaps
from depthwalk.scene.effect_settings import LightParams

_MAX_RADIANCE = 1e4  # of the sun's disc: half floats end at 65504
_STRIP_PIXELS = 1 << 17  # that are lit by lamps in one part of the pass


class LightPass(PixelPass[LightParams]):
    """Compute linear light from albedo, normals and shadows: deferred lighting."""

    name = "light"
    per_sample = True
    reads = ("albedo", "surface", "depth", "shadow", "sun_maps", "lamp_maps")
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        """Create the textures that hold lamps; `gl` owns them."""
        super().setup(gl)
        self._records = RecordTexture(gl, LAMP_RECORD)
        self._lists = RecordTexture(gl, NUMBERS_RECORD)
        self._cells = RecordTexture(gl, NUMBERS_RECORD)

    def fuses_with_next(self, frame: Frame, params: LightParams) -> bool:
        """Return whether all of `frame` is lit here; in forward mode depth images are lit already."""
        return not frame.common.forward

    def inputs(self, frame: Frame, params: LightParams) -> PixelInputs:
        """Return the light of `frame`, its sky and the lamps; `params` do not matter: `frame.common` has the mode."""
        light, lamps = frame.light, self._lamps(frame) if frame.environment.lights else None
        defines, values = _background(frame)
        defines += light.defines
        values |= light.uniforms()
        if frame.common.forward:
            defines += ("FORWARD",)
        if frame.targets.sun_maps is not None:
            defines += ("SHADOWS",)
        even_sky = _even_background(frame) and not frame.common.forward
        if lamps is None:
            return PixelInputs(defines=defines, uniforms=values, even_sky=even_sky)
        textures: dict[str, Any] = {"lamps": self._records, "lamp_lists": self._lists, "lamp_cells": self._cells}
        defines += ("LAMPS",)
        values["squares"] = lamps.across
        if (maps := frame.targets.lamp_maps) is not None:
            defines += ("LAMP_SHADOWS",)
            textures["lamp_maps"] = maps.texture
            values |= _map_uniforms(maps) | {"seen_error": error_at_a_metre(frame.view, frame.common.lod)}
        return PixelInputs(
            defines=defines, textures=textures, uniforms=values, strip_pixels=_STRIP_PIXELS, even_sky=even_sky
        )

    def _lamps(self, frame: Frame) -> LightClusters | None:
        """Upload the lamps that reach what is in sight, and return them; None where none does."""
        lamps = visible_lamps(frame.view, frame.environment.lights, frame.shadows.tiles)
        if not len(lamps.records):
            return None
        for texture, records in (
            (self._records, lamps.records),
            (self._lists, lamps.lists),
            (self._cells, lamps.cells),
        ):
            texture.upload(records)
        return lamps


def _background(frame: Frame) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Return defines and uniforms of the sky, of the sun's disc in it, or of the plain background."""
    light, params = frame.light, frame.environment.sky
    if params is None or params.sun_size == 0:
        return light.sky.defines, light.sky.uniforms()
    radius = np.radians(params.sun_size / 2)
    disc = np.minimum(light.sun / radius**2, _MAX_RADIANCE)  # π · sun over the solid angle π · radius²
    return (*light.sky.defines, "DISC"), light.sky.uniforms() | {"disc": tuple(disc.tolist()), "disc_radius": radius}


def _even_background(frame: Frame) -> bool:
    """Return whether what is behind everything has one colour, or none in a transparent picture."""
    return frame.transparent or frame.environment.sky is None


def _map_uniforms(maps: LampMaps) -> dict[str, Any]:
    """Return the uniforms by which the shadow maps of lamps are looked up."""
    params = maps.params
    return {
        "lamp_map_columns": maps.texture.width // params.lamp_resolution,
        "lamp_map_resolution": params.lamp_resolution,
        "filter_width": params.filter_width,
        "error": params.worst_error,
    }
