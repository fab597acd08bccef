"""Draw planar depth images as grids at their full resolution, whose vertices a shader displaces.

Micropolygons (Cook, Carpenter and Catmull 1987): two triangles between four texels, all of them in every frame. Unlike
`dmesh` this has no levels of detail and no samples in buffers: each vertex looks its depth up in a texture.
"""

import moderngl

from depthwalk.render.height_field_grid_pass import HeightFieldGridPass
from depthwalk.render.resources.height_field import HeightFields
from depthwalk.scene.arrays import Representation


class DisplacementPass(HeightFieldGridPass):
    """Draw the height fields of objects with `representation: displacement`."""

    name = "displacement"
    representation = Representation.DISPLACEMENT
    sampler = "height_field"
    one_sided = True

    def texture(self, fields: HeightFields, number: int) -> moderngl.Texture:
        """Return the depths of its texels."""
        return fields.field(number).depth

    def indices(self, fields: HeightFields, number: int) -> moderngl.Buffer:
        """Return the triangles between its texels."""
        return fields.triangles(number)
