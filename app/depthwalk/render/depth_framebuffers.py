"""Keep framebuffers of pictures that others own, with a depth to test against beside."""

import moderngl

from depthwalk.gpu.device import Scope
from depthwalk.render.image import only_texture


class DepthFramebuffers:
    """Keep one for each name, until its picture or its depth is another.

    Parameters
    ----------
    gl : the owner of all that are made.
    """

    def __init__(self, gl: Scope) -> None:
        self._gl = gl
        self._kept: dict[str, tuple[moderngl.Framebuffer, moderngl.Texture, moderngl.Framebuffer]] = {}

    def of(self, name: str, picture: moderngl.Framebuffer, depth: moderngl.Texture) -> moderngl.Framebuffer:
        """Return the framebuffer of the texture of `picture`, its only one, and of `depth`.

        Parameters
        ----------
        name : what the picture is, of which there is one at a time.
        picture : draws into the texture.
        depth : as large.
        """
        drawn, tested, framebuffer = self._kept.get(name, (None, None, None))
        if framebuffer is None or drawn is not picture or tested is not depth:
            if framebuffer is not None:
                self._gl.free(framebuffer)
                del self._kept[name]
            framebuffer = self._gl.framebuffer([only_texture(picture)], depth)
            self._kept[name] = picture, depth, framebuffer
        return framebuffer
