"""Fog over surfaces and sky, by distance and height; it takes the colour of the sky at the horizon."""

import moderngl

from depthwalk.colour import linear_from_srgb
from depthwalk.gpu.program import Program, Variants
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.sky import sky_of


class FogPass(Pass):
    name = "fog"
    per_sample = True
    reads = ("gbuffer",)
    writes = ("lit",)

    def setup(self) -> None:
        shaders = "common/far_plane.vert", "fog/fog.frag"
        self._programs = Variants(lambda defines: Program(self.gl, *shaders, defines=defines))

    def draw(self, frame: Frame) -> None:
        fog = frame.environment.fog
        if fog is None or fog.density == 0:
            return
        context, sky = self.gl.device.context, sky_of(frame.environment)
        defines, values = sky.defines, sky.uniforms()
        if fog.colour is not None:
            defines, values = ("COLOUR",), {"colour": tuple(linear_from_srgb(fog.colour).tolist())}
        frame.targets.depth.use(0)
        frame.targets.lit.color_mask = True, True, True, False
        frame.targets.lit.use()
        context.enable_only(moderngl.BLEND)
        context.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
        self._programs[defines].set(
            depth_texture=0,
            density=fog.density,
            height=fog.height,
            falloff=fog.falloff,
            transparent=int(frame.transparent),
            **values,
        )
        self._programs[defines].fill()
        frame.targets.lit.color_mask = True, True, True, True
