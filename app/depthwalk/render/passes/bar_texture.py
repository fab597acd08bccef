"""Draw planar depth images by bars: to each texel a straight piece from its surface down to its deepest neighbour.

Bar texture mapping (Li, Wang and Wu 2004, which Liu, Liu and Wu 2007 compare with in §4): every texel is a bar, and all
bars together are a surface without gaps. Where each bar ends is found once, so that drawing fills no holes.
"""

import moderngl

from depthwalk.render.height_field_grid_pass import HeightFieldGridPass
from depthwalk.render.resources.height_field import HeightFields
from depthwalk.scene.arrays import Representation


class BarTexturePass(HeightFieldGridPass):
    """Draw the height fields of objects with `representation: bar-texture`."""

    name = "bar_texture"
    representation = Representation.BAR_TEXTURE
    sampler = "bars"
    one_sided = False

    def texture(self, fields: HeightFields, number: int) -> moderngl.Texture:
        """Return the depths of both ends of its bars."""
        return fields.bars(number).ends

    def indices(self, fields: HeightFields, number: int) -> moderngl.Buffer:
        """Return the triangles of its bars, two to each."""
        return fields.bars(number).triangles
