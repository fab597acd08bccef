"""Pass 2: each intermediate image as one rectangle with true depth per pixel, into the G-buffer."""

from typing import ClassVar

import moderngl

from depthwalk.gpu.device import DEPTH_CLAMP
from depthwalk.gpu.instances import InstanceStream
from depthwalk.gpu.program import Program
from depthwalk.params import Params, param
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.records import COMPOSITE_RECORD
from depthwalk.render.view import matrix_bytes


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
    writes = ("gbuffer",)
    Params: ClassVar[type[Params]] = CompositeParams

    def setup(self) -> None:
        self._program = Program(self.gl, "composite/composite.vert", "composite/composite.frag")
        self._instances = InstanceStream(self.gl, COMPOSITE_RECORD)
        self._array = self.gl.vertex_array(self._program.gl, [])

    def draw(self, frame: Frame) -> None:
        context = self.gl.device.context
        frame.targets.gbuffer.use()
        context.enable_only(moderngl.DEPTH_TEST)
        context.enable_direct(DEPTH_CLAMP)  # the plane may be nearer than the near plane while its object is not
        frame.targets.atlas_depth.use(0)
        frame.targets.atlas_owner.use(1)
        self._program.set(
            atlas_depth=0,
            atlas_owner=1,
            clip_from_eye=matrix_bytes(frame.view.clip_from_eye),
            pixel_angle=1 / frame.view.focal_pixels,
            steps=frame.settings.composite.parallax,
            show_tiles=int(frame.settings.composite.show_tiles),
        )
        self._instances.upload(frame.plan.composite.records)
        for group in frame.plan.composite.groups:
            frame.assets.depth_object(group.asset).use_surface(self._program, (2, 3, 4))
            self._instances.bind(self._array, group.first)
            self._array.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=group.count)
        context.disable_direct(DEPTH_CLAMP)
