"""Show normals, distances, albedo or how objects are drawn in place of the lit picture, to find faults and to explain.

It reads the G-buffer, the depth buffer and the visibility buffer, and overwrites all of `lit`; where nothing is, that
is black.
"""

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import RecordTexture
from depthwalk.render.draw.object_colours import COLOUR_RECORD, object_colours
from depthwalk.render.frame import Frame
from depthwalk.render.pixel_pass import PixelInputs, PixelPass
from depthwalk.scene.effect_settings import InspectionParams


class InspectionPass(PixelPass[InspectionParams]):
    """Draw what the G-buffer holds, or how objects are drawn, over `lit`; see `reference.inspection`."""

    name = "inspection"
    per_sample = True
    reads = ("visibility", "surface", "depth")
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        """Create the texture of the objects' colours; `gl` owns it."""
        super().setup(gl)
        self._colours = RecordTexture(gl, COLOUR_RECORD)

    def enabled(self, frame: Frame, params: InspectionParams) -> bool:
        """Return whether `params` ask for another picture than the lit one; `frame` does not matter."""
        return params.show != "picture"

    def inputs(self, frame: Frame, params: InspectionParams) -> PixelInputs:
        """Return what to show of `frame`, as `params` say."""
        if params.how_drawn is not None:
            colours = object_colours(frame.plan, params.how_drawn)
            self._colours.upload(colours.records)
            return PixelInputs(
                defines=("HOW_DRAWN",),
                textures={"visibility_texture": frame.targets.visibility_texture, "object_colours": self._colours},
                uniforms={
                    "captured_colour": colours.captured,
                    "first_mesh": colours.first_mesh,
                    "first_clustered": colours.first_clustered,
                },
                even_sky=True,
            )
        uniforms = {"half_distance": params.half_distance} if params.show == "distance" else {}
        return PixelInputs(defines=(params.show.upper(),), uniforms=uniforms, even_sky=True)
