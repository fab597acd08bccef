"""Light what the G-buffer holds by sun, ambient light and lamps (Phong 1975), and draw the sky behind it."""

from typing import Any

import numpy as np

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import RecordTexture
from depthwalk.gpu.program import Program, Variants
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.lighting.light_clusters import LAMP_RECORD, NUMBERS_RECORD, visible_lamps
from depthwalk.render.lod.selection import error_at_a_metre
from depthwalk.render.shadows.sun_uniforms import LampMaps
from depthwalk.scene.render_settings import LightParams

_MAX_RADIANCE = 1e4  # of the sun's disc: half floats end at 65504


class LightPass(Pass[LightParams]):
    """Compute linear light from albedo, normals and shadows: deferred lighting."""

    name = "light"
    per_sample = True
    reads = ("albedo", "surface", "depth", "shadow", "sun_maps", "lamp_maps")
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        """Prepare the variants of the programs and the textures that hold lamps; `gl` owns them."""
        vertex = "common/far_plane.vert"
        self._light = Variants(lambda defines: Program(gl, vertex, "light/light.frag", defines))
        self._sky = Variants(lambda defines: Program(gl, vertex, "light/sky.frag", defines))
        self._records = RecordTexture(gl, LAMP_RECORD)
        self._lists = RecordTexture(gl, NUMBERS_RECORD)
        self._cells = RecordTexture(gl, NUMBERS_RECORD)

    def draw(self, frame: Frame, params: LightParams) -> None:
        """Draw sky and surfaces of `frame` into `lit`; `params` do not matter, since `frame.common` has the mode."""
        self._draw_sky(frame)
        self._draw_surfaces(frame)

    def _draw_surfaces(self, frame: Frame) -> None:
        light, into = frame.light, frame.targets.lighting
        depth_test: str | None = ">"
        defines = (*light.defines, *(("FORWARD",) if frame.common.forward else ()))
        values = self._lamps(frame) if frame.environment.lights else {}
        if values:  # lamps need the distance of a pixel: the depth buffer is read, and so cannot be tested against
            defines += ("LAMPS",)
            into, depth_test = frame.targets.lit, None
            if frame.targets.lamp_maps is not None:
                defines += ("LAMP_SHADOWS",)
                values |= self._lamp_maps(frame.targets.lamp_maps)
                values["seen_error"] = error_at_a_metre(frame.view, frame.common.lod)
        if frame.targets.sun_maps is not None:
            defines += ("SHADOWS",)
            frame.targets.shadow_texture.use(6)
            values["shadow_texture"] = 6
        frame.targets.albedo.use(0)
        frame.targets.surface.use(1)
        self._light[defines].set(
            albedo_texture=0,
            surface_texture=1,
            **light.uniforms(),
            **values,
        )
        with self.gl.state(into=into, depth_test=depth_test, depth_write=False):
            self._light[defines].fill()

    def _lamps(self, frame: Frame) -> dict[str, Any]:
        """Upload the lamps that reach what is in sight, and return their uniforms; an empty dict where none does."""
        lamps = visible_lamps(frame.view, frame.environment.lights, frame.shadows.tiles)
        if not len(lamps.records):
            return {}
        frame.targets.depth.use(2)
        textures = (self._records, lamps.records), (self._lists, lamps.lists), (self._cells, lamps.cells)
        for unit, (texture, records) in enumerate(textures, start=3):
            texture.upload(records)
            texture.use(unit)
        return {
            "depth_texture": 2,
            "lamps": 3,
            "lamp_lists": 4,
            "lamp_cells": 5,
            "squares": lamps.across,
        }

    def _lamp_maps(self, maps: LampMaps) -> dict[str, Any]:
        """Bind the shadow maps of lamps, and return their uniforms."""
        params = maps.params
        maps.texture.use(7)
        return {
            "lamp_maps": 7,
            "map_columns": maps.texture.width // params.lamp_resolution,
            "map_resolution": params.lamp_resolution,
            "filter_width": params.filter_width,
            "error": params.worst_error,
        }

    def _draw_sky(self, frame: Frame) -> None:
        """Draw the sky over the whole picture, before the surfaces.

        Testing the depth first would take software rasterisers three times as long. In forward mode `lit` holds the
        depth images already, so that the sky is then drawn at the far plane alone.
        """
        sky, params, values = frame.light.sky, frame.environment.sky, {}
        defines = (*sky.defines, "TRANSPARENT") if frame.transparent else sky.defines
        if params is not None and params.sun_size > 0:
            defines += ("DISC",)
            light, radius = frame.light, np.radians(params.sun_size / 2)
            disc = np.minimum(light.sun / radius**2, _MAX_RADIANCE)  # π · sun over the solid angle π · radius²
            values = {
                "to_sun": tuple(light.to_sun.tolist()),
                "disc": tuple(disc.tolist()),
                "disc_radius": radius,
            }
        self._sky[defines].set(**sky.uniforms(), **values)
        if frame.common.forward:
            state = self.gl.state(into=frame.targets.lighting, depth_test="==", depth_write=False)
        else:
            state = self.gl.state(into=frame.targets.lit)
        with state:
            self._sky[defines].fill()
