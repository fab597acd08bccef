"""Colour and normal of the depth-image objects that are visible, once per pixel, into the G-buffer."""

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import ALWAYS
from depthwalk.gpu.instances import RecordTexture
from depthwalk.gpu.program import Program, Variants
from depthwalk.render.antialiasing import covering
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.lighting import lighting
from depthwalk.render.records import SURFACE_RECORD
from depthwalk.render.shading import CLOSED, Shading


class ShadePass(Pass):
    name = "shade"
    per_sample = True
    reads = ("visible", "sun_maps")
    writes = ("gbuffer",)

    def setup(self) -> None:
        self._levels = Program(self.gl, "common/rectangle.vert", "shade/levels.frag")
        self._programs = Variants(
            lambda defines: Program(self.gl, "common/rectangle.vert", "shade/shade.frag", defines)
        )
        self._objects = RecordTexture(self.gl, SURFACE_RECORD)

    def draw(self, frame: Frame) -> None:
        shading = frame.shading
        if shading is None or not len(shading.assets):
            return
        self._objects.upload(shading.records)
        self._objects.use(0)
        frame.targets.visible_texture.use(1)
        if _alone(frame, shading):
            self._shade(frame, shading, frame.targets.gbuffer, ">", np.ones((1, 1)))
            return
        self._draw_levels(frame, shading)
        lit = frame.settings.light.mode == "forward"
        levels = [shading.level, shading.level - CLOSED] if covering(frame.settings) else [shading.level]
        target = frame.targets.shaded_lit if lit else frame.targets.shaded
        self._shade(frame, shading, target, "==", np.stack(levels, -1))

    def _draw_levels(self, frame: Frame, shading: Shading) -> None:
        context = self.gl.device.context
        frame.targets.levels.use()
        context.enable_only(moderngl.DEPTH_TEST)
        context.depth_func = ALWAYS
        low, high = shading.low.min(0), shading.high.max(0)
        self._levels.set(low=tuple(low), high=tuple(high), objects=0, visible_texture=1)
        self._levels.rectangles()

    def _shade(
        self, frame: Frame, shading: Shading, target: moderngl.Framebuffer, test: str, levels: NDArray[np.floating]
    ) -> None:
        """Draws each asset's rectangle into `target` at its `levels` (a, n), where these pass the depth `test`."""
        context = self.gl.device.context
        defines, light = _light(frame)
        if frame.settings.composite.show_tiles:
            defines += ("SHOW_TILES",)
        target.use()
        target.depth_mask = False
        context.enable_only(moderngl.DEPTH_TEST)
        context.depth_func = test
        common = {
            "objects": 0,
            "visible_texture": 1,
            **light,
        }
        columns = (each.tolist() for each in (shading.assets, levels, shading.low, shading.high))
        for number, depths, low, high in zip(*columns, strict=True):
            asset = frame.assets.depth_object(number)
            variant = *asset.surface_defines, *defines
            program = self._programs[variant]
            asset.use_surface(program, 2, frame.settings.lod)
            program.set(**common, low=tuple(low), high=tuple(high))
            for depth in depths:
                program.set(level=depth)
                program.rectangles()
        context.depth_func = "<"


def _light(frame: Frame) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Defines and uniforms of the light that is added up here."""
    settings, maps = frame.settings, frame.targets.sun_maps
    if settings.light.mode == "deferred":
        return (), {}
    light = lighting(frame.environment)
    defines, values = ("FORWARD", *light.defines), light.uniforms()
    if maps is None:
        return defines, values
    return (*defines, "SHADOWS"), values | maps.use(7, frame.view, settings.shadows, settings.lod)


def _alone(frame: Frame, shading: Shading) -> bool:
    """Whether all that is drawn is of one asset's depth images: then the depth buffer tells its pixels, in front of the
    far plane."""
    polygons = len(frame.plan.mesh.records) > 0 or frame.environment.ground is not None
    alone = len(shading.assets) == 1 and not polygons and frame.settings.light.mode == "deferred"
    return alone and not covering(frame.settings)  # which wants to know what is covered in part
