"""Convert linear light in `lit` to the sRGB of the screen (IEC 61966-2-1), with exposure and tone mapping.

Exposure is a factor 2^exposure; the curves are those of shaders/output/tone.glsl (Reinhard et al. 2002, equation 3, and
others). With supersampling a pixel of the screen is the mean of its samples. Dithering hides that a screen has 8 bits,
see `reference.dither`.
"""

from depthwalk.render.frame import Frame
from depthwalk.render.image import has_texture
from depthwalk.render.pixel_pass import PixelInputs, PixelPass
from depthwalk.scene.effect_settings import OutputParams
from depthwalk.scene.environment import Environment

# Of the dithering, in steps of 8 bits. At ½ the mean over some pixels would be exact; this is off by a tenth at most.
# In return, colours that 8 bits hold exactly stay as they are, though the half floats of `lit`, which llvmpipe
# truncates, and the fitted curve of sRGB are off by up to 0.09.
DITHER_AMPLITUDE = 0.4
# Interleaved gradient noise (Jimenez 2014, "Next Generation Post Processing in Call of Duty: Advanced Warfare").
NOISE_ACROSS, NOISE_UP, NOISE_FACTOR = 0.06711056, 0.00583715, 52.9829189


class OutputPass(PixelPass[OutputParams]):
    """Draw the finished picture in the colours of the screen."""

    name = "output"
    reads = ("lit",)
    writes = ("screen",)
    maps_colour = True

    def fuses_with_previous(self, frame: Frame, params: OutputParams) -> bool:
        """Return whether a pixel of `frame` has one sample; `params` do not matter.

        On software rasterisers only if the screen is a texture, which can be drawn with the depth test; without that
        the pass would take longer.
        """
        if frame.common.aa.samples > 1:
            return False
        return not self.gl.device.software or has_texture(frame.targets.screen, frame.targets.size)

    def inputs(self, frame: Frame, params: OutputParams) -> PixelInputs:
        """Return exposure, tone mapping and dithering as `params` say, and how many samples a pixel of `frame` has.

        What an inspection shows is no light, and keeps its colours: they stand for normals, distances or a legend.
        """
        samples = frame.common.aa.samples
        tone_mapping, exposure = ("none", 0.0) if frame.common.inspects else (params.tone_mapping, params.exposure)
        # A loop over one sample costs software rasterisers four times as much as no loop.
        defines = (tone_mapping.upper(), *((f"SAMPLES={samples}",) if samples > 1 else ()))
        if params.dither and _has_gradients(frame.environment):
            defines += ("DITHER",)
        return PixelInputs(defines=defines, uniforms={"exposure": 2.0**exposure}, even_sky=True)


def _has_gradients(environment: Environment) -> bool:
    """Return whether light changes smoothly over wide parts of a picture: that of a sky, in fog and around lamps.

    Before a plain background, in sunlight alone, textures and curvature leave no bands that could be seen.
    """
    return environment.sky is not None or environment.fog is not None or bool(environment.lights)
