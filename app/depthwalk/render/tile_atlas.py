"""Own the textures of the atlas that holds the impostor tiles, and compute its size."""

from functools import cached_property

import moderngl

from depthwalk.gpu.device import Device
from depthwalk.render.target_table import TARGETS

ATLAS_TEXELS = 1 << 23  # smallest atlas: 4096 × 2048, 50 MB


class TileAtlas:
    """Hold the textures of the tile atlas, which outlive the other targets when the picture's size changes.

    Each is created when it is first used: a scene of meshes alone needs none of their 64 MB and more.

    Parameters
    ----------
    device : the owner of the GL context.
    size : width and height, texels, see `atlas_size`.
    lit : whether tiles hold lit colours too.

    Attributes
    ----------
    size : width and height, texels.
    lit : whether tiles hold lit colours too.
    """

    def __init__(self, device: Device, size: tuple[int, int], lit: bool = False) -> None:
        self.size, self.lit, self._gl = size, lit, device.scope("atlas")

    @cached_property
    def owner(self) -> moderngl.Texture:
        """Return the texture `atlas_owner` of the target `atlas`. Raises GpuError where the driver refuses it."""
        return TARGETS["atlas"].textures["atlas_owner"].create(self._gl, self.size)

    @cached_property
    def depth(self) -> moderngl.Texture:
        """Return the texture `atlas_depth` of the target `atlas`. Raises GpuError where the driver refuses it."""
        return TARGETS["atlas"].textures["atlas_depth"].create(self._gl, self.size)

    @cached_property
    def light(self) -> moderngl.Texture:
        """Return the texture of the target `atlas_light`, of lit tiles. Raises GpuError where the driver refuses it."""
        return TARGETS["atlas_light"].textures["atlas_light"].create(self._gl, self.size)

    @cached_property
    def framebuffer(self) -> moderngl.Framebuffer:
        """Return the framebuffer of owner and depth. Raises GpuError where the driver refuses it."""
        return self._gl.framebuffer([self.owner], self.depth)

    @cached_property
    def lit_framebuffer(self) -> moderngl.Framebuffer:
        """Return the framebuffer of owner, light and depth, of lit tiles. Raises GpuError if the driver refuses it."""
        return self._gl.framebuffer([self.owner, self.light], self.depth)

    def release(self) -> None:
        """Free the textures."""
        self._gl.release()


def atlas_size(size: tuple[int, int], limit: int) -> tuple[int, int]:
    """Return how large an atlas is: four pictures' worth of texels in powers of two, at least `ATLAS_TEXELS`.

    Parameters
    ----------
    size : width and height of the picture, pixels.
    limit : the largest width and height of a texture, texels.

    Returns
    -------
    Width and height, texels.
    """
    texels = max(ATLAS_TEXELS, 4 * size[0] * size[1])
    width = 1 << (int(texels**0.5) - 1).bit_length()
    height = 1 << (-(-texels // width) - 1).bit_length()
    return min(width, limit), min(height, limit)
