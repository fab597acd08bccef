"""Draw planar depth images by parallax occlusion mapping: more steps along flatter rays, then one secant.

Tatarchuk 2006, "Dynamic parallax occlusion mapping with approximate soft shadows", with the numbers of steps of the
published program. The picture's plane is drawn, not a box, so there are no silhouettes. Unlike there, the depth of the
surface is written, because colours are looked up by it.
"""

from depthwalk.render.height_field_pass import HeightFieldPass
from depthwalk.scene.arrays import Representation
from depthwalk.scene.object_settings import ParallaxParams


class ParallaxPass(HeightFieldPass[ParallaxParams]):
    """Draw the height fields of objects with `representation: parallax`."""

    name = "parallax"
    representation = Representation.PARALLAX
    front_only = True

    def defines(self, params: ParallaxParams) -> tuple[str, ...]:
        """Return the numbers of steps in `params` as constants of the shader."""
        return f"MIN_STEPS={params.min_steps}", f"MAX_STEPS={params.max_steps}"
