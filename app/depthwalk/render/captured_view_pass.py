"""Draw objects by captured views: the base of passes that show pictures taken beforehand, from fixed directions.

They are rivals of the impostors that are warped for the present viewer. Each draws a rectangle about the object's box,
and looks up colour, normal and depth in views of the object. No second lookup is needed, so they write the G-buffer as
polygons do, with the true depth of each pixel.
"""

from abc import abstractmethod
from typing import ClassVar, TypeVar

import moderngl

from depthwalk.bake.captured_views import CaptureParams
from depthwalk.gpu.device import DEPTH_CLAMP, Scope
from depthwalk.gpu.instances import InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import LESS
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.placed_records import CAPTURED_RECORD
from depthwalk.render.resources.reflections import REFLECTS
from depthwalk.scene.arrays import Representation

P = TypeVar("P", bound=Params)
_RECTANGLE = 6  # vertices


class CapturedViewPass(Pass[P]):
    """Draw the objects of `frame.plan.captured` in one representation, a rectangle each.

    Attributes
    ----------
    representation : which objects are drawn.
    """

    draws_objects = True
    writes = ("surface", "visibility", "depth")
    representation: ClassVar[Representation]

    def setup(self, gl: Scope) -> None:
        """Prepare the program, whose variants are compiled when first needed; `gl` owns their GL objects."""
        shaders = f"{self.name}/{self.name}.vert", f"{self.name}/{self.name}.frag"
        self._programs = Variants(lambda defines: Program(gl, *shaders, defines))
        self._instances = InstanceStream(gl, CAPTURED_RECORD)

    @abstractmethod
    def capture(self, params: P) -> CaptureParams:
        """Return how the views that `params` ask for are captured."""

    def defines(self, params: P) -> tuple[str, ...]:
        """Return the defines by which further `params` become constants of the shader; by default none."""
        return ()

    def draw(self, frame: Frame, params: P) -> None:
        """Draw what `frame` shows in this representation into surfaces, visibility and depth.

        params: which views are drawn. Objects whose views are still being captured are left out.
        """
        drawn = frame.plan.captured[self.representation]
        capture = self.capture(params)
        defines = (
            f"VIEWS={capture.count}",
            *self.defines(params),
            *(("HEMISPHERE",) if capture.directions == "hemisphere" else ()),
        )
        defines += frame.targets.defines
        # Unclamped, the rectangle may be nearer than the near plane while the surface behind it is not.
        with self.gl.state(into=frame.targets.polygons, depth_test=LESS, direct=(DEPTH_CLAMP,)):
            for batch in drawn.batches:
                views = frame.assets.captured_views(batch.asset, capture)
                if views is None or views.params != capture:
                    continue
                reflects = views.reflects and frame.light.reflected is not None
                light = ("UNLIT",) if views.is_unlit else (REFLECTS,) if reflects else ()
                program = self._programs[*defines, *light]
                views.colour.use(0)
                views.surface.use(1)
                program.set(colour_views=0, surface_views=1, **views.uniforms)
                self._instances.upload(drawn.records_of(batch))
                self._instances.bind(program.array)
                program.array.render(moderngl.TRIANGLES, vertices=_RECTANGLE, instances=batch.count)
