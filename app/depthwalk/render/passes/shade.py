"""Colour and normal of the depth-image objects that are visible, once per pixel, into the G-buffer."""

import moderngl

from depthwalk.gpu.instances import RecordTexture
from depthwalk.gpu.program import Program, Variants
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.lighting import lighting
from depthwalk.render.records import SURFACE_RECORD
from depthwalk.render.shading import Shading
from depthwalk.render.view import matrix_bytes


class ShadePass(Pass):
    name = "shade"
    per_sample = True
    reads = ("visible",)
    writes = ("gbuffer",)

    def setup(self) -> None:
        self._levels = Program(self.gl, "shade/shade.vert", "shade/levels.frag")
        self._levels_array = self.gl.vertex_array(self._levels.gl, [])
        self._programs = Variants(lambda defines: Program(self.gl, "shade/shade.vert", "shade/shade.frag", defines))
        self._arrays = Variants(lambda defines: self.gl.vertex_array(self._programs[defines].gl, []))
        self._objects = RecordTexture(self.gl, SURFACE_RECORD)

    def draw(self, frame: Frame) -> None:
        shading = frame.shading
        if shading is None or not len(shading.assets):
            return
        self._objects.upload(shading.records)
        self._objects.use(0)
        frame.targets.visible_texture.use(1)
        frame.targets.depth.use(2)
        self._draw_levels(frame, shading)
        self._shade(frame, shading)

    def _draw_levels(self, frame: Frame, shading: Shading) -> None:
        context = self.gl.device.context
        frame.targets.levels.use()
        frame.targets.levels.clear(depth=1.0)
        context.enable_only(moderngl.DEPTH_TEST)
        low, high = shading.low.min(0), shading.high.max(0)
        self._levels.set(low=tuple(low), high=tuple(high), objects=0, visible_texture=1, depth_texture=2)
        self._levels_array.render(moderngl.TRIANGLE_STRIP, vertices=4)

    def _shade(self, frame: Frame, shading: Shading) -> None:
        context, view = self.gl.device.context, frame.view
        forward = frame.settings.light.mode == "forward"
        target = frame.targets.shaded_lit if forward else frame.targets.shaded
        target.use()
        target.depth_mask = False
        context.depth_func = "=="
        common = {
            "objects": 0,
            "visible_texture": 1,
            "pixel_angle": 1 / view.focal_pixels,
            "show_tiles": int(frame.settings.composite.show_tiles),
            "ray_from_screen": matrix_bytes(view.ray_from_screen),
            **(lighting(frame.environment).uniforms() if forward else {}),
        }
        columns = (each.tolist() for each in (shading.assets, shading.level, shading.low, shading.high))
        for number, level, low, high in zip(*columns, strict=True):
            asset = frame.assets.depth_object(number)
            defines = (*asset.defines, "FORWARD") if forward else asset.defines
            program = self._programs[defines]
            asset.use_surface(program, (2, 3, 4))
            program.set(**common, level=level, low=tuple(low), high=tuple(high))
            self._arrays[defines].render(moderngl.TRIANGLE_STRIP, vertices=4)
        context.depth_func = "<"
