"""Keep the surfaces around a viewer, until the viewer leaves them or objects change."""

import numpy as np

from depthwalk.types import Array
from depthwalk.walk.collision.body import FOOT, Body
from depthwalk.walk.collision.footing import Footing, footing
from depthwalk.walk.collision.outlines import Outlines, outlines
from depthwalk.walk.collision.placed_collider import Placed, PlacedCollider

_NOTHING = np.zeros((0, 3, 3))
_SURFACES = 0.3  # metres beyond the reach that is asked for, within which surfaces are gathered
_DROP = 3.0  # metres below the feet in which surfaces are looked for
_STALE = 0.03  # metres that the feet may rise or sink before surfaces are cut again


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
        self.forget()

    def forget(self) -> None:
        """Forget everything: the viewer is elsewhere now."""
        self.footing: Footing = footing(_NOTHING)
        self._objects: dict[int, PlacedCollider] = {}  # by row
        self._passed: set[int] = set()  # rows of objects that the viewer is in
        self._version: tuple[int, ...] = ()
        self._gathered = _Box(np.full(3, np.nan), 0.0)  # where all surfaces are known
        self._solid = _NOTHING  # the surfaces of objects that the viewer is not in
        self._outlines: Outlines | None = None
        self._cut_at = np.nan

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
            Whether other objects may be known now.
        """
        version = self._placed.version
        if version == self._version and self._gathered.holds(feet, reach):
            return False
        box = _Box(feet.copy(), reach + _SURFACES)
        near = self._placed.near(*box.corners(body))
        if near is None:
            return False
        self._version = version
        self._take_over(near, box, body)
        return True

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
            self._outlines, self._cut_at = outlines(self._solid, feet + body.step, feet + body.top), feet
        return self._outlines

    def _take_over(self, near: list[PlacedCollider], box: "_Box", body: Body) -> None:
        """Gather the surfaces in a box around a viewer, of the objects `near` it.

        Of those that are new, or have moved, the viewer may be in some, and may have left others meanwhile.
        """
        line, before = _line(box.feet, body), self._objects
        self._objects = {placed.row: placed for placed in near}
        self._passed = {
            row
            for row, placed in self._objects.items()
            if (row in self._passed or not placed.is_same(before.get(row))) and placed.holds(*line)
        }
        corners = {row: placed.near(*box.corners(body)) for row, placed in self._objects.items()}
        solid = [surface for row, surface in corners.items() if row not in self._passed]
        self._solid = np.concatenate([_NOTHING, *solid])
        self.footing = footing(np.concatenate([_NOTHING, *corners.values()]) if self._passed else self._solid)
        self._gathered, self._outlines = box, None


class _Box:
    """Describe a box about a viewer: where the feet are, (3,) metres, world, and how far it reaches, metres."""

    def __init__(self, feet: Array, reach: float) -> None:
        self.feet, self.reach = feet, reach

    def holds(self, feet: Array, reach: float) -> bool:
        """Return whether it holds what is within `reach` of other feet."""
        (x, y, z), (u, v, w) = self.feet.tolist(), feet.tolist()
        return bool(max(abs(x - u), abs(y - v), abs(z - w)) + reach <= self.reach)

    def corners(self, body: Body) -> tuple[Array, Array]:
        """Return its least and greatest corner, (3,) metres, world."""
        down, up = (self.reach, _DROP, self.reach), (self.reach, body.top + self.reach, self.reach)
        return self.feet - down, self.feet + up


def _line(feet: Array, body: Body) -> tuple[Array, Array]:
    """Return a point (3,) of the body's axis, and heights (3,) along it, metres, world."""
    return feet, feet[1] + np.linspace(body.step, body.top, 3)


def reach_of(body: Body, motion: float) -> float:
    """Return how far around a viewer surfaces matter for a motion of `motion` metres."""
    return max(body.radius, FOOT) + motion
