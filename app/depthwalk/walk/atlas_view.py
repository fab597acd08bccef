"""Show the impostors of a frame, or a single one, as a picture."""

import moderngl

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.targets import Targets

_SIZE = 1024, 512  # texels; the atlas is several times as large
_TILE_SIZE = 256, 256  # of the picture of one tile


class AtlasView:
    """Paint parts of the impostor atlas into textures, with near surfaces bright and far ones dark.

    Parameters
    ----------
    device
        The GPU that draws.

    Attributes
    ----------
    texture
        The picture of the used part of the atlas, 1024 × 512 texels RGBA.
    aspect
        Width / height of that part.
    tile_texture
        The picture of a single tile, 256 × 256 texels RGBA.
    """

    def __init__(self, device: Device) -> None:
        self.gl = device.scope("atlas view")
        self._program = Program(self.gl, "common/fullscreen.vert", "imgui/atlas.frag")
        self.texture, self.tile_texture = self.gl.texture(_SIZE, 4), self.gl.texture(_TILE_SIZE, 4)
        self.aspect = 1.0
        for texture in (self.texture, self.tile_texture):
            texture.filter = moderngl.LINEAR, moderngl.LINEAR
        self._framebuffer = self.gl.framebuffer([self.texture])
        self._tile_framebuffer = self.gl.framebuffer([self.tile_texture])

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
        self._paint(targets, (0.0, 0.0, right, top), self._framebuffer)

    def draw_tile(self, targets: Targets, tile: tuple[int, int, int, int]) -> None:
        """Paint one tile of a frame.

        Parameters
        ----------
        targets
            The render targets of the frame, which hold the atlas.
        tile
            x, y, width and height of the tile in the atlas, texels.
        """
        self._paint(targets, tile, self._tile_framebuffer)

    def _paint(self, targets: Targets, part: tuple[float, float, float, float], into: moderngl.Framebuffer) -> None:
        """Paint a part of the atlas, x, y, width and height in texels."""
        columns, rows = targets.atlas_size
        x, y, width, height = part
        targets.atlas_depth.use(0)
        self._program.set(atlas_depth=0, part=(x / columns, y / rows, width / columns, height / rows))
        with self.gl.state(into=into):
            self._program.fill()

    def release(self) -> None:
        """Free the texture and the program."""
        self.gl.release()
