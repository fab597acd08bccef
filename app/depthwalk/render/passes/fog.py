"""Blend the surfaces and the sky in `lit` with fog, which thins with height.

A pixel becomes mix(colour of the fog, pixel, e^(−density · metres)), by Beer and Lambert; how many metres of fog lie in
front of it follows from the depth buffer in closed form. Fog without a colour of its own takes that of the sky at the
horizon.
"""

from depthwalk.colour import linear_colour
from depthwalk.params import Params
from depthwalk.render.frame import Frame
from depthwalk.render.pixel_pass import PixelInputs, PixelPass


class FogPass(PixelPass[Params]):
    """Draw the fog of the environment over `lit`."""

    name = "fog"
    per_sample = True
    reads = ("lit", "depth")
    writes = ("lit",)

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether the environment of `frame` has fog; `params` is empty."""
        fog = frame.environment.fog
        return fog is not None and fog.density > 0

    def inputs(self, frame: Frame, params: Params) -> PixelInputs:
        """Return how thick the fog of `frame` is, and its colour or that of the sky; `params` is empty."""
        return fog_inputs(frame)


def fog_inputs(frame: Frame) -> PixelInputs:
    """Return how thick the fog of `frame` is, and its colour or that of the sky, for shaders/fog/fog.glsl."""
    fog, sky = frame.environment.fog, frame.light.sky
    assert fog is not None  # as the caller has checked
    values = {"fog_density": fog.density, "fog_height": fog.height, "fog_falloff": fog.falloff}
    if fog.colour is None:
        return PixelInputs(defines=sky.defines, uniforms=values | sky.uniforms())
    colour = {"fog_colour": tuple(linear_colour(fog.colour).tolist())}
    return PixelInputs(defines=("FOG_COLOUR",), uniforms=values | colour)
