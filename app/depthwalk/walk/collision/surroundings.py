"""Keep the surfaces around a viewer, until the viewer leaves them or objects change."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array
from depthwalk.walk.collision.body import FOOT, Body
from depthwalk.walk.collision.footing import Footing, footing
from depthwalk.walk.collision.outlines import Outlines, outlines
from depthwalk.walk.collision.placed_collider import Placed, PlacedCollider

_MARGIN = 1.0  # metres beyond the reach that is asked for: the way until surfaces are gathered again
_DROP = 3.0  # metres below the feet in which surfaces are looked for
_STALE = 0.03  # metres that the feet may rise or sink before surfaces are cut anew
_CHECK = 0.2  # metres between checks whether the viewer has left an object


class Surroundings:
    """Hold the surfaces that a viewer may touch.

    Objects that the viewer is in when they first appear are left out until the viewer has left them: so nobody who
    starts inside a statue, or whom a moving wall overtakes, is trapped.

    Parameters
    ----------
    placed
        Knows the objects near the viewer.

    Attributes
    ----------
    footing
        What can be stood on.
    """

    def __init__(self, placed: Placed) -> None:
        self._placed = placed
        self.footing: Footing = footing(np.zeros((0, 3, 3)))
        self._corners: list[NDArray[np.float64]] = []  # of each near object
        self._near: dict[int, PlacedCollider] = {}  # by row
        self._passed: set[int] = set()  # rows of objects that the viewer is in
        self._version: tuple[int, ...] = ()
        self._centre = np.full(3, np.nan)
        self._reach = 0.0
        self._checked = np.full(3, np.nan)
        self._outlines: Outlines | None = None
        self._cut_at = np.nan

    def forget(self) -> None:
        """Forget everything: the viewer is elsewhere now."""
        self._near, self._corners, self._outlines = {}, [], None
        self._passed.clear()
        self._version = ()
        self.footing = footing(np.zeros((0, 3, 3)))

    @property
    def is_waiting(self) -> bool:
        """Return whether surfaces around the viewer may still be unknown."""
        return self._placed.is_waiting

    def update(self, feet: Array, reach: float, body: Body) -> bool:
        """Gather the surfaces around a viewer, unless they are known.

        Parameters
        ----------
        feet
            (3,) where the viewer stands, metres, world.
        reach
            How far around the viewer surfaces are needed, metres.
        body
            The viewer's body.

        Returns
        -------
        bool
            Whether other surfaces may be known now.
        """
        away = np.abs(feet - self._centre).max() if self._version == self._placed.version else np.inf
        if not away + reach <= self._reach:
            return self._gather(feet, reach + _MARGIN, body)
        if self._passed and np.abs(feet - self._checked).max() > _CHECK:
            self._leave(feet, body)
        return False

    def outlines(self, feet: float, body: Body) -> Outlines:
        """Return the outlines of the surfaces at the height of a body.

        Parameters
        ----------
        feet
            Height of the feet, metres, world y.
        body
            The viewer's body.
        """
        if self._outlines is None or not abs(feet - self._cut_at) <= _STALE:
            solid = [corners for row, corners in zip(self._near, self._corners, strict=True) if row not in self._passed]
            corners = np.concatenate(solid) if solid else np.zeros((0, 3, 3))
            self._outlines, self._cut_at = outlines(corners, feet + body.step, feet + body.top), feet
        return self._outlines

    def _gather(self, feet: Array, reach: float, body: Body) -> bool:
        """Gather the surfaces within `reach`, metres, if they are known; return whether they are."""
        down, up = np.array([reach, _DROP, reach]), np.array([reach, body.top + reach, reach])
        version = self._placed.version
        near = self._placed.near(feet - down, feet + up)
        if near is None:
            return False
        before, self._near = self._near, {placed.row: placed for placed in near}
        self._corners = [placed.near(feet - down, feet + up) for placed in near]
        self._version, self._centre, self._reach = version, feet.copy(), reach
        self.footing = footing(np.concatenate([np.zeros((0, 3, 3)), *self._corners]))
        line = _line(feet, body)
        new = {placed.row for placed in near if not placed.is_same(before.get(placed.row)) and placed.holds(*line)}
        self._passed = {row for row in self._passed if row in self._near} | new
        self._outlines = None
        self._leave(feet, body)
        return True

    def _leave(self, feet: Array, body: Body) -> None:
        """Note which objects the viewer is no longer in."""
        self._checked, line = feet.copy(), _line(feet, body)
        left = {row for row in self._passed if not self._near[row].holds(*line)}
        if left:
            self._passed -= left
            self._outlines = None


def _line(feet: Array, body: Body) -> tuple[Array, Array]:
    """Return a point (3,) of the body's axis, and heights (3,) along it, metres, world."""
    return feet, feet[1] + np.linspace(body.step, body.top, 3)


def reach_of(body: Body, motion: float) -> float:
    """Return how far around a viewer surfaces matter for a motion of `motion` metres."""
    return max(body.radius, FOOT) + motion
