"""Find, once per second, what fraction of the objects' pixels each representation drew, without waiting for the GPU.

The HUD shows these shares.
"""

from depthwalk.render.pixel_shares import PixelShares, shares
from depthwalk.render.renderer import Renderer

_EVERY = 1.0  # s from one result to the next query
_FRAMES = 3  # after which the GPU has drawn the queried frame, and reading does not wait
_FIRST = 3  # number of the first queried frame: a query compiles a shader, which must not delay the first picture


class LateShares:
    """Have the GPU count the pixels of one frame, and read the counts some frames later.

    Attributes
    ----------
    latest
        The last result of `pixel_shares.shares`, 0 to 1 by name; empty before the first one.
    """

    def __init__(self) -> None:
        self.latest: dict[str, float] = {}
        self._asked: PixelShares | None = None
        self._frames, self._seconds, self._waits = 0, _EVERY, _FIRST

    def update(self, renderer: Renderer, dt: float) -> None:
        """Begin counting a frame's pixels, read a finished count, or do neither; call this after every frame.

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
