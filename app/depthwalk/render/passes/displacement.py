"""Draw planar depth images as grids at their full resolution, whose vertices a shader displaces.

Micropolygons (Cook, Carpenter and Catmull 1987): two triangles between four texels, all of them in every frame. Unlike
`dmesh` this has no levels of detail and no samples in buffers: each vertex looks its depth up in a texture.
"""

import moderngl

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import LESS
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.scene.arrays import Representation


class DisplacementPass(Pass[Params]):
    """Draw the height fields of objects with `representation: displacement`."""

    name = "displacement"
    draws_objects = True
    representation = Representation.DISPLACEMENT
    writes = ("visibility", "depth")

    def setup(self, gl: Scope) -> None:
        """Prepare the program, whose variants are compiled when first needed; `gl` owns their GL objects."""
        shaders = "displacement/displacement.vert", "displacement/displacement.frag"
        self._programs = Variants(lambda defines: Program(gl, *shaders, defines))
        self._instances = InstanceStream(gl, PLACED_RECORD)
        self._arrays: dict[tuple[int, tuple[str, ...]], moderngl.VertexArray] = {}

    def draw(self, frame: Frame, params: Params) -> None:
        """Draw into `visibility` and `depth` what `frame` shows in this representation; `params` is empty."""
        drawn = frame.plan.height_fields[Representation.DISPLACEMENT]
        first_id = frame.plan.first_id_of(Representation.DISPLACEMENT)
        self._instances.upload(drawn.records)
        program, into = self._programs[frame.targets.defines], frame.targets.visibility
        with self.gl.state(into=into, depth_test=LESS, cull=True, wireframe=frame.common.wireframe):
            for batch in drawn.batches:
                field = frame.assets.height_fields.field(batch.asset)
                field.depth.use(0)
                program.set(height_field=0, first=first_id + batch.first, **field.uniforms)
                array = self._array(frame, batch.asset, program)
                self._instances.bind(array, batch.first)
                array.render(moderngl.TRIANGLES, instances=batch.count)

    def _array(self, frame: Frame, number: int, program: Program) -> moderngl.VertexArray:
        """Return the vertex array that draws the grid of the depth object with the `number`."""
        key = number, frame.targets.defines
        if key not in self._arrays:
            triangles = frame.assets.height_fields.triangles(number)
            self._arrays[key] = self.gl.vertex_array(program.gl, [], index_buffer=triangles)
        return self._arrays[key]

    def forget_assets(self) -> None:
        """Drop the vertex arrays over buffers of assets."""
        self.gl.free(*self._arrays.values())
        self._arrays.clear()
