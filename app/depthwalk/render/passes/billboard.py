"""Draw billboards: the nearest of the views captured all around, on a rectangle that turns about the object's y axis.

Rohlf and Helman 1994, "IRIS Performer": axial billboards, the cheapest method, without a view along the axis. It stands
upright as the object does, and leans with it. Pixels have the depth of the view (Schaufler 1997, "Nailboards"), though
they are looked up on a plane.
"""

from depthwalk.bake.captured_views import CaptureParams
from depthwalk.render.captured_view_pass import CapturedViewPass
from depthwalk.scene.arrays import Representation
from depthwalk.scene.object_settings import BillboardParams


class BillboardPass(CapturedViewPass[BillboardParams]):
    """Draw objects with `representation: billboard`."""

    name = "billboard"
    representation = Representation.BILLBOARD

    def capture(self, params: BillboardParams) -> CaptureParams:
        """Return the capture of as many views from all around as `params` say."""
        return CaptureParams(directions="azimuths", count=params.views, resolution=params.resolution)
