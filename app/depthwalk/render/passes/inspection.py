"""Show normals, distances or albedo in place of the lit picture, to find faults of a model or its depth images.

It reads the G-buffer and the depth buffer, and overwrites all of `lit`; where nothing is, that is black.
"""

from depthwalk.render.frame import Frame
from depthwalk.render.pixel_pass import PixelInputs, PixelPass
from depthwalk.scene.effect_settings import InspectionParams


class InspectionPass(PixelPass[InspectionParams]):
    """Draw what the G-buffer holds over `lit`; see `reference.inspection` for the colours."""

    name = "inspection"
    per_sample = True
    reads = ("surface", "depth")
    writes = ("lit",)

    def enabled(self, frame: Frame, params: InspectionParams) -> bool:
        """Return whether `params` ask for another picture than the lit one; `frame` does not matter."""
        return params.show != "picture"

    def inputs(self, frame: Frame, params: InspectionParams) -> PixelInputs:
        """Return what to show, as `params` say; `frame` does not matter."""
        uniforms = {"half_distance": params.half_distance} if params.show == "distance" else {}
        return PixelInputs(defines=(params.show.upper(),), uniforms=uniforms, even_sky=True)
