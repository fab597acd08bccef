"""Draw the picture of a viewer at rest in slices, and show it once it is finished."""

import moderngl

from depthwalk.render.renderer import Renderer
from depthwalk.render.still_picture import StillPicture
from depthwalk.render.view.view import View
from depthwalk.walk.slices import Slices


class StillSlices:
    """Draw a still picture over several iterations of the frame loop.

    Parameters
    ----------
    renderer
        Draws it; no frame may be in progress meanwhile.

    Attributes
    ----------
    is_finished
        Whether there is a picture of the present view to show.
    """

    def __init__(self, renderer: Renderer) -> None:
        self._renderer = renderer
        self._picture = StillPicture(renderer.device)
        self._slices = Slices(renderer.device)
        self.is_finished = False

    @property
    def is_drawing(self) -> bool:
        """Return whether a picture is in progress."""
        return self._slices.is_drawing

    def advance(self, view: View, seconds: float) -> bool:
        """Begin the picture of `view`, or continue with it, for about `seconds`; return whether it is finished."""
        if not self._slices.is_drawing:
            self._slices.begin(self._picture.steps(self._renderer, view))
        self.is_finished = self._slices.advance(seconds)
        return self.is_finished

    def drop(self) -> None:
        """Discard the picture, finished or not: the viewer moves, or the scene has changed."""
        self._slices.drop()
        self.is_finished = False

    def show(self, screen: moderngl.Framebuffer) -> None:
        """Draw the finished picture into `screen`."""
        self._picture.show(screen)

    def release(self) -> None:
        """Free everything on the GPU."""
        self.drop()
        self._picture.release()
