"""Draw octahedral impostors: the three captured views nearest to the viewer's direction, blended.

Brucks 2018, "Octahedral impostors": views from a grid over an octahedron, each shifted by its own depth once, and
blended by the barycentric weights of the viewer's direction.
"""

from depthwalk.bake.captured_views import CaptureParams, Directions
from depthwalk.render.captured_view_pass import CapturedViewPass
from depthwalk.scene.arrays import Representation
from depthwalk.scene.object_settings import OctahedralParams


class OctahedralPass(CapturedViewPass[OctahedralParams]):
    """Draw objects with `representation: octahedral`."""

    name = "octahedral"
    representation = Representation.OCTAHEDRAL

    def capture(self, params: OctahedralParams) -> CaptureParams:
        """Return the capture of views from all around, or from above only, as `params` say."""
        directions: Directions = "hemisphere" if params.hemisphere else "sphere"
        return CaptureParams(directions=directions, count=params.views, resolution=params.resolution)

    def defines(self, params: OctahedralParams) -> tuple[str, ...]:
        """Return how often each view is shifted by its depth, from `params`, as a constant of the shader."""
        return (f"STEPS={params.parallax_steps}",)
