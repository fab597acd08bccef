"""Read the depth buffer back to the CPU, reduced to cells."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program, Variants
from depthwalk.render.targets import Targets

MOST_CELLS = 1 << 19  # 2 × 2 pixels each at 1920 × 1080: rows of objects a few pixels high must hide each other


class DepthReadback:
    """Reduce the depth buffer to the farthest depth of each cell of pixels.

    What is behind the farthest depth of a cell is hidden in all pixels of the cell.

    Parameters
    ----------
    device : the GPU that draws and is read from.
    size : width and height of the picture, pixels.

    Attributes
    ----------
    side : width and height of a cell, pixels.
    """

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        self.gl = device.scope("occlusion")
        self.side = cell_side(size)
        cells = -(-size[0] // self.side), -(-size[1] // self.side)
        shaders = "common/fullscreen.vert", "occlusion/farthest.frag"
        self._programs = Variants(lambda defines: Program(self.gl, *shaders, defines))
        self._texture = self.gl.texture(cells, 1, "f4")
        self._framebuffer = self.gl.framebuffer([self._texture])
        self._farthest = np.empty(cells[::-1], np.float32)  # reused: touching new memory is slower than the copy

    def reduce(self, targets: Targets) -> None:
        """Find the farthest depth of each cell in the depth of `targets`, on the GPU."""
        targets.drawn.depth.use(0)
        program = self._programs[f"SIDE={self.side}", *targets.defines]
        program.set(depth_texture=0, **({"samples": targets.samples} if targets.defines else {}))
        with self.gl.state(into=self._framebuffer):
            program.fill()

    def read(self) -> NDArray[np.float32]:
        """Return what the last `reduce` found. Waits until the GPU has finished drawing.

        Returns
        -------
        (rows, columns) float32 values of the depth buffer, 0 to 1, row 0 at the bottom. The next call overwrites them.
        """
        self._texture.read_into(self._farthest, alignment=4)
        return self._farthest

    def release(self) -> None:
        """Free the textures and programs on the device."""
        self.gl.release()


def cell_side(size: tuple[int, int]) -> int:
    """Return the width and height of a cell, pixels, for a picture of `size` (width, height), pixels.

    It is an even number, since the shader gathers 2 × 2 pixels at once.
    """
    return 2 * int(np.ceil(np.sqrt(size[0] * size[1] / MOST_CELLS) / 2))
