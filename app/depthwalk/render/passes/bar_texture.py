"""Draw planar depth images by bars: to each texel a straight piece from its surface down to its deepest neighbour.

Bar texture mapping (Li, Wang and Wu 2004, which Liu, Liu and Wu 2007 compare with in §4): every texel is a bar, and all
bars together are a surface without gaps. Where each bar ends is found once, so that drawing fills no holes.
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


class BarTexturePass(Pass[Params]):
    """Draw the height fields of objects with `representation: bar-texture`."""

    name = "bar_texture"
    draws_objects = True
    representation = Representation.BAR_TEXTURE
    writes = ("visibility", "depth")

    def setup(self, gl: Scope) -> None:
        """Prepare the program, whose variants are compiled when first needed; `gl` owns their GL objects."""
        shaders = "bar_texture/bar_texture.vert", "bar_texture/bar_texture.frag"
        self._programs = Variants(lambda defines: Program(gl, *shaders, defines))
        self._instances = InstanceStream(gl, PLACED_RECORD)
        self._arrays: dict[tuple[int, tuple[str, ...]], moderngl.VertexArray] = {}

    def draw(self, frame: Frame, params: Params) -> None:
        """Draw into `visibility` and `depth` what `frame` shows in this representation; `params` is empty."""
        drawn = frame.plan.height_fields[Representation.BAR_TEXTURE]
        first_id = frame.plan.first_id_of(Representation.BAR_TEXTURE)
        self._instances.upload(drawn.records)
        program, into = self._programs[frame.targets.defines], frame.targets.visibility
        with self.gl.state(into=into, depth_test=LESS, wireframe=frame.common.wireframe):
            for batch in drawn.batches:
                fields = frame.assets.height_fields
                bars = fields.bars(batch.asset)
                bars.ends.use(0)
                uniforms = fields.field(batch.asset).uniforms
                program.set(bars=0, first=first_id + batch.first, **uniforms)
                key = batch.asset, frame.targets.defines
                if key not in self._arrays:
                    self._arrays[key] = self.gl.vertex_array(program.gl, [], index_buffer=bars.triangles)
                array = self._arrays[key]
                self._instances.bind(array, batch.first)
                array.render(moderngl.TRIANGLES, instances=batch.count)

    def forget_assets(self) -> None:
        """Drop the vertex arrays over buffers of assets."""
        self.gl.free(*self._arrays.values())
        self._arrays.clear()
