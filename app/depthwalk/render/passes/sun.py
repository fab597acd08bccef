"""Compute what part of the sun's light reaches each pixel, by its shadow maps."""

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass


class SunPass(Pass[Params]):
    """Look up in the shadow maps what part of the sun's light reaches each pixel."""

    name = "sun"
    per_sample = True
    reads = ("surface", "depth", "sun_maps")
    writes = ("shadow",)

    def setup(self, gl: Scope) -> None:
        """Create the program, which `gl` owns."""
        self._program = Program(gl, "common/far_plane.vert", "sun/sun.frag")

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether the sun casts shadows in `frame`; `params` is empty."""
        return frame.targets.sun_maps is not None

    def draw(self, frame: Frame, params: Params) -> None:
        """Draw into `shadow` what part of the sun's light reaches each pixel of `frame`; `params` is empty."""
        targets, view, maps = frame.targets, frame.view, frame.targets.sun_maps
        assert maps is not None  # as `enabled` found
        targets.depth.use(0)
        targets.surface.use(1)
        self._program.set(
            depth_texture=0,
            surface_texture=1,
            **maps.use(2, view, frame.common.lod),
        )
        with self.gl.state(into=targets.shadow):
            self._program.fill()
