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
        self._light = Program(self.gl, "light/light.vert", "light/light.frag")
        self._sky = Program(self.gl, "light/light.vert", "light/sky.frag")
        self._light_array = self.gl.vertex_array(self._light.gl, [])
        self._sky_array = self.gl.vertex_array(self._sky.gl, [])

    def draw(self, frame: Frame) -> None:
        context = self.gl.device.context
        frame.targets.lighting.use()
        frame.targets.lighting.depth_mask = False
        context.enable_only(moderngl.DEPTH_TEST)
        self._set(frame)
        context.depth_func = ">"
        self._light_array.render(moderngl.TRIANGLES, vertices=3)
        context.depth_func = "=="
        self._sky_array.render(moderngl.TRIANGLES, vertices=3)
        context.depth_func = "<"

    def _set(self, frame: Frame) -> None:
        targets, world = frame.targets, frame.environment
        targets.albedo.use(0)
        targets.surface.use(1)
        ray_from_screen = matrix_bytes(frame.view.ray_from_screen)
        to_sun = -np.asarray(world.sun.direction, float)
        sun = linear_from_srgb(world.sun.colour) * world.sun.intensity
        ambient = linear_from_srgb(world.ambient.colour) * world.ambient.intensity
        self._light.set(
            albedo_texture=0,
            surface_texture=1,
            ray_from_screen=ray_from_screen,
            to_sun=tuple(to_sun / np.linalg.norm(to_sun)),
            sun=tuple(sun.tolist()),
            ambient=tuple(ambient.tolist()),
        )
        background = linear_from_srgb(world.background)
        sky = (background, background) if world.sky is None else linear_from_srgb([world.sky.zenith, world.sky.horizon])
        self._sky.set(
            ray_from_screen=ray_from_screen,
            zenith=tuple(sky[0].tolist()),
            horizon=tuple(sky[1].tolist()),
            transparent=int(frame.transparent),
        )
