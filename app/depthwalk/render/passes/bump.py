"""Draw planar depth images as what they are without their depth: the picture's plane, lit by its normals.

Blinn 1978, "Simulation of wrinkled surfaces": the cheapest of all that look like a relief, as long as nobody moves.
"""

from depthwalk.params import Params
from depthwalk.render.height_field_pass import HeightFieldPass
from depthwalk.scene.arrays import Representation


class BumpPass(HeightFieldPass[Params]):
    """Draw the pictures of objects with `representation: bump`."""

    name = "bump"
    representation = Representation.BUMP
    front_only = True
