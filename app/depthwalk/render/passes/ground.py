"""Draw the level ground, with colour and texture of the environment, into the G-buffer and the depth buffer.

It is drawn after the objects that may hide it, so that hidden pixels cost nothing.
"""

from pathlib import Path

import numpy as np

from depthwalk.colour import linear_colour, linear_from_srgb8
from depthwalk.gpu.device import DEPTH_CLAMP, Scope
from depthwalk.gpu.program import Program
from depthwalk.gpu.state import LESS
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.mesh_object import WHITE


class GroundPass(Pass[Params]):
    """Draw the ground of the environment into the G-buffer."""

    name = "ground"
    writes = ("surface", "visibility", "depth")

    def setup(self, gl: Scope) -> None:
        """Create the program, and a texture of one white texel until a ground has another; `gl` owns both."""
        self._program = Program(gl, "ground/ground.vert", "ground/ground.frag")
        self._texture = gl.srgb_texture(WHITE)
        self._mean = np.ones(3, np.float32)
        self._path: Path | None = None

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether the environment of `frame` has a ground; `params` is empty."""
        return frame.environment.ground is not None

    def draw(self, frame: Frame, params: Params) -> None:
        """Draw the ground of `frame`, loading its texture if that has changed; `params` is empty."""
        ground = frame.environment.ground
        assert ground is not None  # as `enabled` has checked
        if ground.texture != self._path:
            texels = frame.assets.texture(ground.texture)
            self.gl.free(self._texture)
            self._path = ground.texture
            self._texture = self.gl.srgb_texture(texels[::-1])
            if not self.gl.device.software:  # in software this costs more than the rest of the frame
                self._texture.anisotropy = 8.0
            self._mean = np.maximum(linear_from_srgb8(texels[..., :3]).mean((0, 1)), 1e-3)
        self._texture.use(0)
        self._program.set(
            ground_texture=0,
            height=ground.height,
            half_size=ground.half_size,
            colour=tuple(linear_colour(ground.colour).tolist()),
            mean=tuple(self._mean.tolist()),
            tile=ground.tile,
        )
        # Clamped, since a viewer may be so near to the ground that it begins in front of the near plane.
        with self.gl.state(into=frame.targets.polygons, depth_test=LESS, direct=(DEPTH_CLAMP,)):
            self._program.rectangles(9)  # see ground.vert
