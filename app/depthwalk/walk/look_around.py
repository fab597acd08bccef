"""Draw the surroundings of a viewer in advance, at low resolution, so that a quick turn finds something there.

Finished frames are stored in a map of the surroundings (`render.reprojection.surround`). If the viewer is about to see
something that no frame showed from nearby, one side of a cube around the viewer is drawn between two frames, with so
few pixels that it takes about one slice.
"""

from collections.abc import Iterator

import numpy as np

from depthwalk.render.frame_memory import SURROUNDING
from depthwalk.render.renderer import Renderer
from depthwalk.render.reprojection.surround import Surround, surround_views
from depthwalk.render.view.field_of_view import spread_rays
from depthwalk.render.view.view import View
from depthwalk.walk.slices import Slices

_RAYS = 8  # along either edge of a view, to test how much of it is known
_MOST_UNKNOWN = 0.1  # of a side or an upcoming view: if more is unknown, it is drawn
_MOST_REDRAWN = 30  # sides that are drawn again: with little memory, assets may come and go


class LookAround:
    """Draw the sides of a cube around the viewer, one at a time, in steps.

    Parameters
    ----------
    renderer
        Draws them; no frame may be in progress meanwhile.
    surround
        Stores them.

    Attributes
    ----------
    knows_all
        Whether enough is known of the surroundings of a viewer at rest; set this to False when the viewer moves.
    """

    def __init__(self, renderer: Renderer, surround: Surround) -> None:
        self._renderer, self._surround = renderer, surround
        self._slices = Slices(renderer.device)
        self.knows_all = False
        self._knew_all = False  # whether `knows_all` was true at some time since the scene changed
        self._redrawn = 0  # sides since then that lacked something
        self._is_due = False  # whether a frame has been finished since the last side for a moving viewer

    @property
    def is_drawing(self) -> bool:
        """Return whether a side is in progress."""
        return self._slices.is_drawing

    def drop(self) -> None:
        """Discard the side in progress."""
        self._slices.drop()

    def note_change(self) -> None:
        """Discard what is known of the surroundings: the scene or its settings have changed."""
        self._surround.forget()
        self.knows_all = self._knew_all = False
        self._redrawn = 0

    def note_frame(self) -> None:
        """Record that a frame is finished: a moving viewer gets one side per frame, so that frames are not late."""
        self._is_due = True

    def begin_for_moving_viewer(self, coming: list[View]) -> bool:
        """Begin the side that covers most of the unknown parts of some views, if these are large.

        If they are small, begin any side of which too little is known, until all have been known once.

        Parameters
        ----------
        coming
            The views of the viewer now and soon.

        Returns
        -------
        bool
            Whether a side was begun.
        """
        if not self._is_due:
            return False
        self._is_due = False
        now, position = coming[0], coming[0].position
        rays = np.concatenate([spread_rays(view, _RAYS, _RAYS) for view in coming])
        unknown = rays[~self._surround.holds(rays, position)]
        if len(unknown) > _MOST_UNKNOWN * _RAYS**2:
            sides = surround_views(position, now.camera.time)
            shown = [(unknown @ side.axes[2] > np.abs(unknown @ side.axes[:2].T).max(-1)).sum() for side in sides]
            self._slices.begin(self._draw(sides[int(np.argmax(shown))], waits=False))
        elif not self._knew_all:
            self._knew_all = not self._begin_first_unknown(now, waits=False)
        return self.is_drawing

    def begin_for_resting_viewer(self, view: View) -> bool:
        """Begin a side of which too little is known from where `view` stands; return whether there is one.

        If there is none, `knows_all` becomes True.
        """
        self.knows_all = self.knows_all or not self._begin_first_unknown(view, waits=True)
        self._knew_all |= self.knows_all
        return self.is_drawing

    def _begin_first_unknown(self, view: View, waits: bool) -> bool:
        for side in surround_views(view.position, view.camera.time):
            if self._surround.holds(spread_rays(side, _RAYS, _RAYS), view.position).mean() < 1 - _MOST_UNKNOWN:
                self._slices.begin(self._draw(side, waits))
                return True
        return False

    def advance(self, seconds: float) -> bool:
        """Continue with the side for about `seconds`; return whether it is finished."""
        return self._slices.advance(seconds)

    def _draw(self, side: View, waits: bool) -> Iterator[str]:
        """Draw a side. waits: whether to draw it again if it lacks assets that are still being uploaded."""
        yield from self._renderer.auxiliary_steps(SURROUNDING, side, self._surround.canvas())
        targets, fitted = self._renderer.targets, self._renderer.auxiliary_view
        assert targets is not None and fitted is not None  # the last step has set them
        again = waits and self._renderer.assets.is_waiting and self._redrawn < _MOST_REDRAWN
        self._redrawn += again
        self._surround.keep_canvas(targets, fitted, counts=not again)
