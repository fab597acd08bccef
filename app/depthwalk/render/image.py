"""Pair a texture with the framebuffer that draws into it; find the texture of a framebuffer; read its pixels."""

from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Scope


class Image(NamedTuple):
    """Hold a texture that is drawn into, and read later.

    Attributes
    ----------
    texture : the texture.
    framebuffer : draws into all of it.
    """

    texture: moderngl.Texture
    framebuffer: moderngl.Framebuffer

    @classmethod
    def make(cls, gl: Scope, size: tuple[int, int], components: int = 4, dtype: str = "f1") -> "Image":
        """Create an image, which `gl` owns.

        Parameters
        ----------
        gl : the owner.
        size : width and height, pixels.
        components : numbers per texel.
        dtype : how moderngl names the type of these numbers.

        Returns
        -------
        The image, unfiltered.

        Raises
        ------
        GpuError
            Where the driver refuses the texture.
        """
        texture = gl.texture(size, components, dtype)
        return cls(texture, gl.framebuffer([texture]))

    def free(self, gl: Scope) -> None:
        """Free texture and framebuffer, which `gl` owns."""
        gl.free(self.framebuffer, self.texture)


def has_texture(framebuffer: moderngl.Framebuffer, size: tuple[int, int]) -> bool:
    """Return whether `framebuffer` draws into the whole of one texture of `size`; that of a window does not."""
    attached, whole = framebuffer.color_attachments or (), (0, 0, *size)
    return len(attached) == 1 and isinstance(attached[0], moderngl.Texture) and framebuffer.viewport == whole


def only_texture(framebuffer: moderngl.Framebuffer) -> moderngl.Texture:
    """Return the only texture that `framebuffer` draws into; `has_texture` must be true of it."""
    (texture,) = framebuffer.color_attachments
    assert isinstance(texture, moderngl.Texture)  # as `has_texture` has checked
    return texture


def read_pixels(framebuffer: moderngl.Framebuffer) -> NDArray[np.uint8]:
    """Return the picture in a framebuffer. Waits until it is drawn.

    Parameters
    ----------
    framebuffer : what the picture was drawn into.

    Returns
    -------
    (H, W, 4) uint8, top row first.
    """
    width, height = framebuffer.size
    data = framebuffer.read(components=4, alignment=1)
    return np.frombuffer(data, np.uint8).reshape(height, width, 4)[::-1]
