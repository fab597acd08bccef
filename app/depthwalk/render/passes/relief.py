"""Draw planar depth images by relief mapping: linear steps along each view ray, then a binary search for the surface.

Policarpo, Oliveira and Comba 2005, "Real-time relief mapping on arbitrary polygonal surfaces". Anything thinner than a
step may be missed. There, rays that leave a polygon's texture see it repeat; here they leave the box about the picture.
"""

from depthwalk.render.height_field_pass import HeightFieldPass
from depthwalk.scene.arrays import Representation
from depthwalk.scene.object_settings import ReliefParams


class ReliefPass(HeightFieldPass[ReliefParams]):
    """Draw the height fields of objects with `representation: relief`."""

    name = "relief"
    representation = Representation.RELIEF

    def defines(self, params: ReliefParams) -> tuple[str, ...]:
        """Return the numbers of steps in `params` as constants of the shader."""
        return f"LINEAR_STEPS={params.linear_steps}", f"BINARY_STEPS={params.binary_steps}"
