"""Find, once a second, which part of the objects' pixels each representation drew, without waiting for the GPU.

The HUD shows the parts.
"""

from depthwalk.render.pixel_shares import PixelShares, shares
from depthwalk.render.renderer import Renderer

_EVERY = 1.0  # s from one answer to the next question
_FRAMES = 3  # after which the GPU has drawn the frame that was asked about, and reading does not wait
_FIRST = 3  # frame that is asked about first: asking compiles a shader, for which the first picture should not wait


class LateShares:
    """Have the GPU count the pixels of one frame, and read the counts some frames later.

    Attributes
    ----------
    latest
        What `pixel_shares.shares` returned last, 0 to 1 by name; empty before the first answer.
    """

    def __init__(self) -> None:
        self.latest: dict[str, float] = {}
        self._asked: PixelShares | None = None
        self._frames, self._seconds, self._waits = 0, _EVERY, _FIRST

    def update(self, renderer: Renderer, dt: float) -> None:
        """Begin to count a frame's pixels, read a count that is finished, or do neither; call this after every frame.

        `renderer` has just drawn the frame, `dt` seconds after the last one.
        """
        if self._waits > 0:
            self._waits -= 1
            return
        self._frames, self._seconds = self._frames + 1, self._seconds + dt
        if self._asked is not None and self._frames >= _FRAMES:
            self.latest, self._asked, self._seconds = shares(self._asked.count()), None, 0.0
        elif self._asked is None and self._seconds >= _EVERY:
            self._asked, self._frames = renderer.sample_shares(), 0
