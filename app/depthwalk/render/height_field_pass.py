"""Draw height fields pixel by pixel: the base of passes that search for the surface along each view ray.

They are the rivals that Liu, Liu and Wu 2007 (Table 2) measured the warp of planar depth images against, and others of
their kind. Each draws a box about the height field, and differs from the others only in how its fragment shader finds
the surface behind a pixel. The result goes to the visibility buffer, so that all are coloured and lit alike.
"""

from typing import ClassVar, TypeVar

import moderngl

from depthwalk.gpu.device import DEPTH_CLAMP, Scope
from depthwalk.gpu.instances import InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import LESS
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.scene.arrays import Representation

P = TypeVar("P", bound=Params)
_BOX, _FRONT = 30, 6  # vertices of the box without its back, which cannot be seen from in front; of its front alone


class HeightFieldPass(Pass[P]):
    """Draw the objects of `frame.plan.height_fields` in one representation, by boxes or by their front faces.

    Attributes
    ----------
    representation : which objects are drawn.
    front_only : whether the front face alone is drawn, so that there is no silhouette but the picture's frame.
    """

    draws_objects = True
    writes = ("visibility", "depth")
    representation: ClassVar[Representation]
    front_only: ClassVar[bool] = False

    def setup(self, gl: Scope) -> None:
        """Prepare the program, whose variants are compiled when first needed; `gl` owns their GL objects."""
        fragment = f"{self.name}/{self.name}.frag"
        self._programs = Variants(lambda defines: Program(gl, "common/height_field.vert", fragment, defines))
        self._instances = InstanceStream(gl, PLACED_RECORD)

    def defines(self, params: P) -> tuple[str, ...]:
        """Return the defines by which `params` become constants of the shader; by default none."""
        return ()

    def use(self, frame: Frame, params: P, number: int, program: Program) -> None:
        """Bind what `program` reads of the depth object with the `number`: by default its depths, to texture unit 0.

        `frame` has the assets; `params` are for passes that need more.
        """
        field = frame.assets.height_fields.field(number)
        field.depth.use(0)
        program.set(height_field=0, **field.uniforms)

    def draw(self, frame: Frame, params: P) -> None:
        """Draw into `visibility` and `depth` what `frame` shows in this representation, as `params` say."""
        drawn = frame.plan.height_fields[self.representation]
        first_id = frame.plan.first_id_of(self.representation)
        program = self._programs[*self.defines(params), *frame.targets.defines]
        vertices = _FRONT if self.front_only else _BOX
        # Unclamped, the box may be nearer than the near plane while the surface in it is not.
        into = frame.targets.visibility
        with self.gl.state(into=into, depth_test=LESS, cull=True, direct=(DEPTH_CLAMP,)):
            for batch in drawn.batches:
                self.use(frame, params, batch.asset, program)
                program.set(first=first_id + batch.first)
                self._instances.upload(drawn.records_of(batch))
                self._instances.bind(program.array)
                program.array.render(moderngl.TRIANGLES, vertices=vertices, instances=batch.count)
