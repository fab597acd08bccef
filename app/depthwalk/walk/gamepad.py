"""Move the viewer by a gamepad, and call the actions of keys by its buttons."""

from collections.abc import Callable, Mapping
from enum import IntEnum

from depthwalk.walk.controls import RADIANS_PER_PIXEL, Move
from depthwalk.walk.state import State
from depthwalk.walk.window import PadState

_DEAD_ZONE = 0.15  # part of its way by which a stick may be off when nobody touches it
_TURN = 2.4  # radians per second at which a stick that is pushed to its end turns the viewer
_LONGEST_TURN = 0.1  # seconds of one turn at most: after a pause the view must not jump
_TRIGGER_REST = -1.0  # value of a trigger that is not pulled
_POLL_SECONDS = 1 / 30  # between looks at a gamepad while the window rests, as it sends no events
CONNECTED = "Gamepad: the sticks move and look, Start shows the keys"


class Axis(IntEnum):
    """Number the axes of `PadState`: −1 to 1, to the right and down; triggers −1 to 1, pulled."""

    LEFT_X = 0
    LEFT_Y = 1
    RIGHT_X = 2
    RIGHT_Y = 3
    LEFT_TRIGGER = 4
    RIGHT_TRIGGER = 5


class Button(IntEnum):
    """Number the buttons of `PadState`, named as on an Xbox controller."""

    A = 0
    B = 1
    X = 2
    Y = 3
    LEFT_BUMPER = 4
    RIGHT_BUMPER = 5
    BACK = 6
    START = 7
    LEFT_STICK = 9
    UP = 11
    RIGHT = 12
    DOWN = 13


# The keys whose actions buttons call, by moderngl-window's names.
KEYS = {
    Button.A: "G",
    Button.B: "O",
    Button.X: "I",
    Button.Y: "P",
    Button.BACK: "Z",
    Button.START: "H",
    Button.UP: "HOME",
    Button.RIGHT: "F12",
    Button.DOWN: "F",
}
_NOTCHES = {Button.LEFT_BUMPER: -1.0, Button.RIGHT_BUMPER: 1.0}  # of the wheel


class Gamepad:
    """Apply what a gamepad does to a walk.

    Parameters
    ----------
    read
        Returns the state of the gamepad; None while there is none.
    actions
        Actions of keys, by moderngl-window's name of the key.
    before_change
        Called before an action, which may change the scene.
    """

    def __init__(
        self,
        read: Callable[[], PadState | None],
        actions: Mapping[str, Callable[[], None]],
        before_change: Callable[[], None],
    ) -> None:
        self._read, self._actions, self._before_change = read, actions, before_change
        self._held: frozenset[int] = frozenset()  # buttons
        self._is_there: bool | None = None  # None before the first look

    def advance(self, state: State, dt: float) -> bool:
        """Move the viewer for `dt` seconds, and call the actions of buttons that were pressed since the last call.

        Returns
        -------
        bool
            Whether the gamepad did anything that the window may have to show.
        """
        pad = self._read()
        if pad is not None and self._is_there is False:
            state.tell(CONNECTED)
        self._is_there = pad is not None
        held = frozenset() if pad is None else frozenset(number for number, down in enumerate(pad.buttons) if down)
        pressed, changed, self._held = held - self._held, held ^ self._held, held
        if Button.LEFT_STICK in changed:
            state.fast = Button.LEFT_STICK in held
        for number in sorted(pressed):
            if number in _NOTCHES:
                state.wheel(_NOTCHES[Button(number)])
            elif number in KEYS:
                self._before_change()
                self._actions[KEYS[Button(number)]]()
        return (pad is not None and _move(state, pad, dt)) or bool(changed)

    def patience(self, seconds: float) -> float:
        """Return for how long the window may wait for an event instead of `seconds`."""
        return min(seconds, _POLL_SECONDS) if self._is_there else seconds


def _move(state: State, pad: PadState, dt: float) -> bool:
    """Move and turn the viewer by sticks and triggers; return whether any of them is away from rest."""
    right, down = _stick(pad.axes[Axis.LEFT_X], pad.axes[Axis.LEFT_Y])
    lift = _pulled(pad.axes[Axis.RIGHT_TRIGGER]) - _pulled(pad.axes[Axis.LEFT_TRIGGER])
    for move, share in ((Move.RIGHT, right), (Move.BACK, down), (Move.UP, lift)):
        if share:
            state.held.lean(move if share > 0 else move.opposite, abs(share))
    turn_right, turn_down = _stick(pad.axes[Axis.RIGHT_X], pad.axes[Axis.RIGHT_Y])
    if turn_right or turn_down:
        pixels = _TURN * min(dt, _LONGEST_TURN) / RADIANS_PER_PIXEL
        state.look(turn_right * pixels, turn_down * pixels)
    return bool(right or down or lift or turn_right or turn_down)


def _stick(x: float, y: float) -> tuple[float, float]:
    """Return how far a stick is pushed to the right and down, each −1 to 1; finer near its middle."""
    length = (x * x + y * y) ** 0.5
    if length <= _DEAD_ZONE:
        return 0.0, 0.0
    pushed = (min(length, 1.0) - _DEAD_ZONE) / (1 - _DEAD_ZONE)
    return x / length * pushed * pushed, y / length * pushed * pushed


def _pulled(axis: float) -> float:
    """Return how far a trigger is pulled, 0 to 1."""
    pulled = (axis - _TRIGGER_REST) / 2
    return max(pulled - _DEAD_ZONE, 0.0) / (1 - _DEAD_ZONE)
