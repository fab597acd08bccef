"""Pass 2: each intermediate image as one rectangle with true depth per pixel; what is in front."""

from typing import ClassVar

import moderngl

from depthwalk.gpu.device import DEPTH_CLAMP
from depthwalk.gpu.instances import InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.params import Params, param
from depthwalk.render.antialiasing import covering
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.records import COMPOSITE_RECORD


class CompositeParams(Params):
    parallax: int = param(
        1,
        "Steps by which the surface is sought along the rays of a viewer who moved since the warp; 0: flat",
        ge=0,
        le=8,
    )
    show_tiles: bool = param(False, "Paint each intermediate image in a colour of its own")


class CompositePass(Pass):
    name = "composite"
    draws_objects = True
    reads = ("atlas",)
    writes = ("visible",)
    Params: ClassVar[type[Params]] = CompositeParams

    def setup(self) -> None:
        shaders = "composite/composite.vert", "composite/composite.frag"
        self._programs = Variants(lambda defines: Program(self.gl, *shaders, defines=defines))
        self._instances = InstanceStream(self.gl, COMPOSITE_RECORD)

    def draw(self, frame: Frame) -> None:
        context = self.gl.device.context
        records, aligned = frame.plan.composite.records, frame.plan.composite.aligned
        frame.targets.visible.use()
        context.enable_only(moderngl.DEPTH_TEST)
        context.enable_direct(DEPTH_CLAMP)  # the plane may be nearer than the near plane while its object is not
        frame.targets.atlas_depth.use(0)
        frame.targets.atlas_owner.use(1)
        self._instances.upload(records)
        self._draw(frame, ("ALIGNED",), 0, aligned)
        # A loop of known length is none: software rasterisers take a tenth longer for one.
        defines = (f"STEPS={frame.settings.composite.parallax}", *frame.targets.defines)
        defines += ("PARTIAL",) if covering(frame.settings) else ()
        self._draw(frame, defines, aligned, len(records) - aligned)
        context.disable_direct(DEPTH_CLAMP)

    def _draw(self, frame: Frame, defines: tuple[str, ...], first: int, count: int) -> None:
        if count:
            program = self._programs[defines]
            program.set(atlas_depth=0, atlas_owner=1, first=frame.plan.first_number)
            self._instances.bind(program.array, first)
            program.rectangles(count)
