"""Compute the part of the sun's light that reaches the surface at each pixel, 0 to 1, into the target `shadow`.

The surface's point is looked up in the cascade of shadow maps that holds it (Zhang et al. 2006), by percentage-closer
filtering (Reeves, Salesin and Cook 1987).
"""

from depthwalk.params import Params
from depthwalk.render.frame import Frame
from depthwalk.render.pixel_pass import PixelInputs, PixelPass


class SunPass(PixelPass[Params]):
    """Look up in the shadow maps which part of the sun's light reaches each pixel."""

    name = "sun"
    per_sample = True
    reads = ("surface", "depth", "sun_maps")
    writes = ("shadow",)

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether the sun casts shadows in `frame`; `params` is empty."""
        return frame.targets.sun_maps is not None

    def inputs(self, frame: Frame, params: Params) -> PixelInputs:
        """Return the shadow maps of `frame`; `params` is empty."""
        maps = frame.targets.sun_maps
        assert maps is not None  # as `enabled` has checked
        uniforms = maps.uniforms(frame.view, frame.common.lod)
        textures = {"sun_maps": maps.texture}
        return PixelInputs(defines=maps.defines, textures=textures, uniforms=uniforms, even_sky=True)
