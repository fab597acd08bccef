"""Keep pictures together with the distance of the surface at each pixel."""

from dataclasses import dataclass

import moderngl

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program
from depthwalk.render.image import Image
from depthwalk.render.targets import Targets
from depthwalk.render.view.view import View


@dataclass(frozen=True, kw_only=True)
class DepthPicture:
    """Hold a picture and its distances.

    Attributes
    ----------
    colours : sRGB, filtered linearly.
    distances : metres along the view axis, negative beside nearer surfaces; see shaders/reprojection/distance.frag.
    """

    colours: Image
    distances: Image

    @property
    def size(self) -> tuple[int, int]:
        """Return width and height, pixels."""
        return self.colours.texture.size


class DepthPictures:
    """Create depth pictures, and fill in their distances.

    Parameters
    ----------
    gl : owns the pictures.
    """

    def __init__(self, gl: Scope) -> None:
        self._gl = gl
        self._distance = Program(gl, "common/fullscreen.vert", "reprojection/distance.frag")

    def make(self, size: tuple[int, int]) -> DepthPicture:
        """Create a picture of `size` (width, height), pixels. Raises GpuError where the driver refuses it."""
        picture = DepthPicture(colours=Image.make(self._gl, size), distances=Image.make(self._gl, size, 1, "f4"))
        picture.colours.texture.filter = moderngl.LINEAR, moderngl.LINEAR
        return picture

    def keep_distances(self, picture: DepthPicture, targets: Targets, view: View) -> None:
        """Fill in the distances of a picture whose colours are drawn.

        Parameters
        ----------
        picture : the picture.
        targets : those that it was drawn with, which hold its depth.
        view : its view, near and far plane fitted.
        """
        targets.depth.use(0)
        self._distance.set(depth_texture=0, planes=view.depth_range)
        with self._gl.state(into=picture.distances.framebuffer):
            self._distance.fill()

    def free(self, picture: DepthPicture) -> None:
        """Free a picture that is no longer needed."""
        picture.colours.free(self._gl)
        picture.distances.free(self._gl)
