"""Deferred Phong lighting by sun and ambient light, and the sky behind everything."""

import moderngl
import numpy as np

from depthwalk.colour import linear_from_srgb
from depthwalk.gpu.program import Program
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.view import matrix_bytes


class LightPass(Pass):
    name = "light"
    reads = ("gbuffer",)
    writes = ("lit",)

    def setup(self) -> None:
        self._program = Program(self.gl, "common/fullscreen.vert", "light/light.frag")
        self._array = self.gl.vertex_array(self._program.gl, [])

    def draw(self, frame: Frame) -> None:
        targets, world = frame.targets, frame.environment
        targets.lit.use()
        self.gl.device.context.enable_only(moderngl.NOTHING)
        for unit, texture in enumerate((targets.albedo, targets.surface, targets.depth)):
            texture.use(unit)
        to_sun = -np.asarray(world.sun.direction, float)
        sun = linear_from_srgb(world.sun.colour) * world.sun.intensity
        ambient = linear_from_srgb(world.ambient.colour) * world.ambient.intensity
        background = linear_from_srgb(world.background)
        sky = (background, background) if world.sky is None else linear_from_srgb([world.sky.zenith, world.sky.horizon])
        self._program.set(
            albedo_texture=0,
            surface_texture=1,
            depth_texture=2,
            eye_from_clip=matrix_bytes(np.linalg.inv(frame.view.clip_from_eye)),
            to_sun=tuple(to_sun / np.linalg.norm(to_sun)),
            sun=tuple(sun.tolist()),
            ambient=tuple(ambient.tolist()),
            zenith=tuple(sky[0].tolist()),
            horizon=tuple(sky[1].tolist()),
            transparent=int(frame.transparent),
        )
        self._array.render(moderngl.TRIANGLES, vertices=3)
