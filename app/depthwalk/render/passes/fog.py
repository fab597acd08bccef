"""Blend surfaces and sky with fog, by distance and height.

Fog without a colour of its own takes that of the sky at the horizon.
"""

import moderngl

from depthwalk.colour import linear_from_srgb
from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program, Variants
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass


class FogPass(Pass[Params]):
    """Draw the fog of the environment over `lit`."""

    name = "fog"
    per_sample = True
    reads = ("depth",)
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        """Prepare the program, whose variants are compiled when first needed; `gl` owns their GL objects."""
        shaders = "common/far_plane.vert", "fog/fog.frag"
        self._programs = Variants(lambda defines: Program(gl, *shaders, defines=defines))

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether the environment of `frame` has fog; `params` is empty."""
        fog = frame.environment.fog
        return fog is not None and fog.density > 0

    def draw(self, frame: Frame, params: Params) -> None:
        """Blend the fog of `frame` into `lit`, by the part of the light that it takes away; `params` is empty."""
        fog, sky = frame.environment.fog, frame.light.sky
        assert fog is not None  # as `enabled` found
        defines, values = sky.defines, sky.uniforms()
        if fog.colour is not None:
            defines, values = ("COLOUR",), {"colour": tuple(linear_from_srgb(fog.colour).tolist())}
        frame.targets.depth.use(0)
        self._programs[defines].set(
            depth_texture=0,
            density=fog.density,
            height=fog.height,
            falloff=fog.falloff,
            transparent=int(frame.transparent),
            **values,
        )
        blend = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
        with self.gl.state(into=frame.targets.lit, blend=blend, colour_mask=(True, True, True, False)):
            self._programs[defines].fill()
