"""Draw planar depth images by relief mapping: steps along each view ray, the last one halved about the surface.

Policarpo, Oliveira and Comba 2005, "Real-time relief mapping on arbitrary polygonal surfaces". What is thinner than a
step may be missed. The paper's rays leave a polygon's texture, which repeats; these leave the box about the picture.
"""

from depthwalk.render.height_field_pass import HeightFieldPass
from depthwalk.scene.arrays import Representation
from depthwalk.scene.rival_settings import ReliefParams


class ReliefPass(HeightFieldPass[ReliefParams]):
    """Draw the height fields of objects with `representation: relief`."""

    name = "relief"
    representation = Representation.RELIEF

    def defines(self, params: ReliefParams) -> tuple[str, ...]:
        """Return the numbers of steps in `params` as constants of the shader."""
        return f"LINEAR_STEPS={params.linear_steps}", f"BINARY_STEPS={params.binary_steps}"
