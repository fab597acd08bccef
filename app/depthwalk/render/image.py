"""Hold a texture together with the framebuffer that draws into it."""

from typing import NamedTuple

import moderngl

from depthwalk.gpu.device import Scope


class Image(NamedTuple):
    """Hold a texture that is drawn into, and read later.

    Attributes
    ----------
    texture : the texture.
    framebuffer : draws into it, whole.
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
