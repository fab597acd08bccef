"""Draw planar depth images by sphere tracing through a volume of distances to the surface.

Donnelly 2005, "Per-pixel displacement mapping with distance functions" (GPU Gems 2, chapter 8). The volume, 256 × 256 ×
16 texels as published, is computed when an object is first drawn in this way, which takes a second or more. Its slices
are coarse: the deeper the picture, the less exact the surface.
"""

from depthwalk.gpu.program import Program
from depthwalk.render.frame import Frame
from depthwalk.render.height_field_pass import HeightFieldPass
from depthwalk.scene.arrays import Representation
from depthwalk.scene.object_settings import DistanceParams


class DistancePass(HeightFieldPass[DistanceParams]):
    """Draw the height fields of objects with `representation: distance`."""

    name = "distance"
    representation = Representation.DISTANCE

    def defines(self, params: DistanceParams) -> tuple[str, ...]:
        """Return the number of steps in `params` as a constant of the shader."""
        return (f"STEPS={params.steps}",)

    def use(self, frame: Frame, params: DistanceParams, number: int, program: Program) -> None:
        """Bind height field and volume of the depth object with the `number` for `program`, the latter as `params` say.

        The volume is computed if `frame` is the first that needs it.
        """
        super().use(frame, params, number, program)
        frame.assets.height_fields.distances(number, params.resolution, params.slices).use(1)
        program.set(distances=1)
