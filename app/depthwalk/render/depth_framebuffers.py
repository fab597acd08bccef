"""Keep framebuffers that combine a picture's texture, owned elsewhere, with a depth texture to test against."""

import moderngl

from depthwalk.gpu.device import Scope
from depthwalk.render.image import only_texture


class DepthFramebuffers:
    """Keep one framebuffer per name, until its picture or its depth is replaced.

    Parameters
    ----------
    gl : owns the framebuffers.
    """

    def __init__(self, gl: Scope) -> None:
        self._gl = gl
        self._kept: dict[str, tuple[moderngl.Framebuffer, moderngl.Texture, moderngl.Framebuffer]] = {}

    def of(self, name: str, picture: moderngl.Framebuffer, depth: moderngl.Texture) -> moderngl.Framebuffer:
        """Return a framebuffer that draws into the texture of `picture` and tests against `depth`.

        Parameters
        ----------
        name : the key, by which one framebuffer at a time is kept.
        picture : a framebuffer with a single colour texture.
        depth : a depth texture of the same size.
        """
        drawn, tested, framebuffer = self._kept.get(name, (None, None, None))
        if framebuffer is None or drawn is not picture or tested is not depth:
            if framebuffer is not None:
                self._gl.free(framebuffer)
                del self._kept[name]
            framebuffer = self._gl.framebuffer([only_texture(picture)], depth)
            self._kept[name] = picture, depth, framebuffer
        return framebuffer
