"""Colour and normal of the depth-image objects that are visible, once per pixel, into the G-buffer."""

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import RecordTexture
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import ALWAYS
from depthwalk.params import Params
from depthwalk.render.draw.material_depth import FULL_COVERAGE, SURFACE_RECORD, MaterialRecords
from depthwalk.render.frame import Frame, Pass


class MaterialResolvePass(Pass[Params]):
    name = "shade"
    per_sample = True
    reads = ("visible", "depth", "sun_maps")
    writes = ("levels", "albedo", "surface", "lit")

    def setup(self, gl: Scope) -> None:
        self._levels = Program(gl, "common/rectangle.vert", "shade/levels.frag")
        self._programs = Variants(lambda defines: Program(gl, "common/rectangle.vert", "shade/shade.frag", defines))
        self._objects = RecordTexture(gl, SURFACE_RECORD)

    def enabled(self, frame: Frame, params: Params) -> bool:
        return frame.shading is not None and len(frame.shading.assets) > 0

    def draw(self, frame: Frame, params: Params) -> None:
        shading = frame.shading
        assert shading is not None  # says `enabled`
        self._objects.upload(shading.records)
        self._objects.use(0)
        frame.targets.visibility_texture.use(1)
        if _alone(frame, shading):
            self._shade(frame, shading, frame.targets.gbuffer, ">", np.ones((1, 1)))
            return
        self._draw_levels(frame, shading)
        levels = [shading.level, shading.level - FULL_COVERAGE] if frame.common.aa.covering else [shading.level]
        target = frame.targets.shaded_lit if frame.common.forward else frame.targets.shaded
        self._shade(frame, shading, target, "==", np.stack(levels, -1))

    def _draw_levels(self, frame: Frame, shading: MaterialRecords) -> None:
        low, high = shading.low.min(0), shading.high.max(0)
        self._levels.set(low=tuple(low), high=tuple(high), objects=0, visibility_texture=1)
        with self.gl.state(into=frame.targets.levels, depth_test=ALWAYS):
            self._levels.rectangles()

    def _shade(
        self,
        frame: Frame,
        shading: MaterialRecords,
        target: moderngl.Framebuffer,
        test: str,
        levels: NDArray[np.floating],
    ) -> None:
        """Draws each asset's rectangle into `target` at its `levels` (a, n), where these pass the depth `test`."""
        defines, light = _light(frame)
        if frame.common.show_tiles:
            defines += ("SHOW_TILES",)
        common = {
            "objects": 0,
            "visibility_texture": 1,
            **light,
        }
        columns = (each.tolist() for each in (shading.assets, levels, shading.low, shading.high))
        for number, depths, low, high in zip(*columns, strict=True):
            asset = frame.assets.depth_object(number)
            variant = *asset.surface_defines, *defines
            program = self._programs[variant]
            asset.use_surface(program, 2, frame.common.lod)
            program.set(**common, low=tuple(low), high=tuple(high))
            with self.gl.state(into=target, depth_test=test, depth_write=False):
                for depth in depths:
                    program.set(level=depth)
                    program.rectangles()


def _light(frame: Frame) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Defines and uniforms of the light that is added up here."""
    if not frame.common.forward:
        return (), {}
    light, maps = frame.light, frame.targets.sun_maps
    defines, values = ("FORWARD", *light.defines), light.uniforms()
    if maps is None:
        return defines, values
    return (*defines, "SHADOWS"), values | maps.use(7, frame.view, frame.common.lod)


def _alone(frame: Frame, shading: MaterialRecords) -> bool:
    """Whether all that is drawn is of one asset's depth images: then the depth buffer tells its pixels, in front of the
    far plane."""
    polygons = len(frame.plan.mesh.records) > 0 or frame.environment.ground is not None
    alone = len(shading.assets) == 1 and not polygons and not frame.common.forward
    return alone and not frame.common.aa.covering  # which wants to know what is covered in part
