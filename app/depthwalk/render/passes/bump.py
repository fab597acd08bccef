"""Draw planar depth images by bump mapping: the picture's plane without its depth, lit by its normals.

Blinn 1978, "Simulation of wrinkled surfaces": the cheapest method, which looks like a relief as long as the viewer
stands still. The plane goes to the visibility buffer; `material_resolve` looks up colours and normals there.
"""

from depthwalk.params import Params
from depthwalk.render.height_field_pass import HeightFieldPass
from depthwalk.scene.arrays import Representation


class BumpPass(HeightFieldPass[Params]):
    """Draw the pictures of objects with `representation: bump`."""

    name = "bump"
    representation = Representation.BUMP
    front_only = True
