"""Draw height fields texel by texel: the base of passes whose vertex shader looks up where each vertex lies.

Unlike `dmesh` these have no levels of detail and no samples in buffers: an index buffer names the vertices of all
texels, and a texture holds their depths.
"""

from abc import abstractmethod
from typing import ClassVar

import moderngl

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import LESS
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.height_field import HeightFields
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.scene.arrays import Representation


class HeightFieldGridPass(Pass[Params]):
    """Draw the objects of `frame.plan.height_fields` in one representation, by triangles without vertex buffers.

    Attributes
    ----------
    representation : which objects are drawn.
    sampler : the name of the shader's texture.
    one_sided : whether back faces are culled.
    """

    draws_objects = True
    writes = ("visibility", "depth")
    representation: ClassVar[Representation]
    sampler: ClassVar[str]
    one_sided: ClassVar[bool]

    @abstractmethod
    def texture(self, fields: HeightFields, number: int) -> moderngl.Texture:
        """Return the texture that the vertices of the depth object with the `number` are looked up in."""

    @abstractmethod
    def indices(self, fields: HeightFields, number: int) -> moderngl.Buffer:
        """Return the numbers of the vertices of its triangles, uint32."""

    def setup(self, gl: Scope) -> None:
        """Prepare the program, whose variants are compiled when first needed; `gl` owns their GL objects."""
        shaders = f"{self.name}/{self.name}.vert", f"{self.name}/{self.name}.frag"
        self._programs = Variants(lambda defines: Program(gl, *shaders, defines))
        self._instances = InstanceStream(gl, PLACED_RECORD)
        self._arrays: dict[tuple[int, tuple[str, ...]], moderngl.VertexArray] = {}

    def draw(self, frame: Frame, params: Params) -> None:
        """Draw into `visibility` and `depth` what `frame` shows in this representation; `params` is empty."""
        drawn, fields = frame.plan.height_fields[self.representation], frame.assets.height_fields
        first_id = frame.plan.first_id_of(self.representation)
        program, into = self._programs[frame.targets.defines], frame.targets.visibility
        with self.gl.state(into=into, depth_test=LESS, cull=self.one_sided, wireframe=frame.common.wireframe):
            for batch in drawn.batches:
                self.texture(fields, batch.asset).use(0)
                uniforms = fields.field(batch.asset).uniforms
                program.set(**{self.sampler: 0}, first=first_id + batch.first, **uniforms)
                array = self._array(frame, batch.asset, program)
                self._instances.upload(drawn.records_of(batch))
                self._instances.bind(array)
                array.render(moderngl.TRIANGLES, instances=batch.count)

    def _array(self, frame: Frame, number: int, program: Program) -> moderngl.VertexArray:
        """Return the vertex array that draws the triangles of the depth object with the `number`."""
        key = number, frame.targets.defines
        if key not in self._arrays:
            indices = self.indices(frame.assets.height_fields, number)
            self._arrays[key] = self.gl.vertex_array(program.gl, [], index_buffer=indices)
        return self._arrays[key]

    def forget_assets(self) -> None:
        """Drop the vertex arrays over buffers of assets."""
        self.gl.free(*self._arrays.values())
        self._arrays.clear()
