"""Show the impostors of a frame as one picture; a switch in the panel turns it on."""

import moderngl

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.targets import Targets

_SIZE = 1024, 512  # texels; the atlas is several times as large


class AtlasView:
    """Paint the used part of the impostor atlas into a texture, with near surfaces bright and far ones dark.

    Parameters
    ----------
    device
        The GPU that draws.

    Attributes
    ----------
    texture
        The picture, 1024 × 512 texels RGBA.
    aspect
        Width / height of the part of the atlas that the picture shows.
    """

    def __init__(self, device: Device) -> None:
        self.gl = device.scope("atlas view")
        self._program = Program(self.gl, "common/fullscreen.vert", "imgui/atlas.frag")
        self.texture = self.gl.texture(_SIZE, 4)
        self.texture.filter = moderngl.LINEAR, moderngl.LINEAR
        self.aspect = 1.0
        self._framebuffer = self.gl.framebuffer([self.texture])

    def draw(self, targets: Targets, plan: FrameDrawLists) -> None:
        """Paint the corner of the atlas that holds the impostors of a frame.

        Parameters
        ----------
        targets
            The render targets of the frame, which hold the atlas.
        plan
            The draw lists of the frame, which hold the positions of its impostors in the atlas.
        """
        tiles = plan.composite.records["tile"]
        right, top = (tiles[:, :2] + tiles[:, 2:]).max(0, initial=0.0).tolist()
        self.aspect = right / top if top else _SIZE[0] / _SIZE[1]
        targets.atlas_depth.use(0)
        self._program.set(atlas_depth=0, used=(right / targets.atlas_size[0], top / targets.atlas_size[1]))
        with self.gl.state(into=self._framebuffer):
            self._program.fill()

    def release(self) -> None:
        """Free the texture and the program."""
        self.gl.release()
