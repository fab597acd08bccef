"""Light what the G-buffer holds by sun, ambient light and lamps (Phong 1975), and draw the sky behind it."""

from collections.abc import Iterator
from typing import Any

import moderngl
import numpy as np

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import RecordTexture
from depthwalk.gpu.program import Program, Variants
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.lighting.light_clusters import LAMP_RECORD, NUMBERS_RECORD, LightClusters, visible_lamps
from depthwalk.render.lod.selection import error_at_a_metre
from depthwalk.render.shadows.sun_uniforms import LampMaps
from depthwalk.scene.render_settings import LightParams

_MAX_RADIANCE = 1e4  # of the sun's disc: half floats end at 65504


_STRIP_PIXELS = 1 << 17  # of a strip that is lit by lamps in one part of the pass
_Inputs = dict[str, moderngl.Texture | RecordTexture]  # textures by the names that the shader has for them


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
        for _ in self.parts(frame, params):
            pass

    def parts(self, frame: Frame, params: LightParams) -> Iterator[None]:
        """Draw as `draw` does; with lamps, stop after each of several strips of the picture."""
        self._draw_sky(frame)
        light, into = frame.light, frame.targets.lighting
        depth_test: str | None = ">"
        defines = (*light.defines, *(("FORWARD",) if frame.common.forward else ()))
        inputs: _Inputs = {"albedo_texture": frame.targets.albedo, "surface_texture": frame.targets.surface}
        values = light.uniforms()
        lamps = self._lamps(frame) if frame.environment.lights else None
        if lamps is not None:  # the depth buffer is read, for distances, and so cannot be tested against
            defines += ("LAMPS",)
            into, depth_test = frame.targets.lit, None
            inputs |= {"depth_texture": frame.targets.depth, "lamps": self._records}
            inputs |= {"lamp_lists": self._lists, "lamp_cells": self._cells}
            values["squares"] = lamps.across
            if frame.targets.lamp_maps is not None:
                defines += ("LAMP_SHADOWS",)
                inputs["lamp_maps"] = frame.targets.lamp_maps.texture
                values |= _map_uniforms(frame.targets.lamp_maps)
                values["seen_error"] = error_at_a_metre(frame.view, frame.common.lod)
        if frame.targets.sun_maps is not None:
            defines += ("SHADOWS",)
            inputs["shadow_texture"] = frame.targets.shadow_texture
        self._light[defines].set(**{name: unit for unit, name in enumerate(inputs)}, **values)
        width, height = frame.view.size
        strips = 1 if lamps is None else -(-width * height // _STRIP_PIXELS)
        for strip in range(strips):
            if strip:
                yield
            for unit, texture in enumerate(inputs.values()):
                texture.use(unit)
            low, high = height * strip // strips, height * (strip + 1) // strips
            with self.gl.state(into=into, depth_test=depth_test, depth_write=False):
                into.scissor = 0, low, width, high - low
                self._light[defines].fill()
                into.scissor = None  # type: ignore[assignment]  # moderngl's "no scissor", which its stubs forget

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


def _map_uniforms(maps: LampMaps) -> dict[str, Any]:
    """Return the uniforms by which the shadow maps of lamps are looked up."""
    params = maps.params
    return {
        "map_columns": maps.texture.width // params.lamp_resolution,
        "map_resolution": params.lamp_resolution,
        "filter_width": params.filter_width,
        "error": params.worst_error,
    }
