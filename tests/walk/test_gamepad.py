"""A viewer who is moved by a gamepad."""

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import glfw
import pytest

from depthwalk.walk.controls import Move
from depthwalk.walk.gamepad import CONNECTED, KEYS, Axis, Button, Gamepad
from depthwalk.walk.hud import HELP
from depthwalk.walk.key_actions import key_actions
from depthwalk.walk.state import State
from depthwalk.walk.viewer import Mode
from depthwalk.walk.window import PadState, read_gamepad
from walks import state


class Hands:
    """A gamepad and whoever holds it."""

    def __init__(self) -> None:
        self.pad: PadState | None = PadState.resting()
        self.called: list[str] = []
        self.walk: State = state()
        actions: dict[str, Callable[[], None]] = {key: lambda key=key: self.called.append(key) for key in KEYS.values()}  # type: ignore[misc]
        self.gamepad = Gamepad(lambda: self.pad, actions, lambda: self.called.append("before"))

    def hold(self, *buttons: Button, **axes: float) -> None:
        rest = PadState.resting()
        pushed = tuple(axes.get(axis.name.lower(), rest.axes[axis]) for axis in Axis)
        self.pad = PadState(pushed, tuple(number in buttons for number in range(15)))

    def spend(self, seconds: float, dt: float = 0.02) -> bool:
        """Whether the last of the frames was one in which the gamepad did something."""
        did = False
        for _ in range(round(seconds / dt)):
            did = self.gamepad.advance(self.walk, dt)
            self.walk.advance(dt)
        return did


@pytest.fixture
def hands() -> Hands:
    return Hands()


def test_nobody_s_gamepad_does_nothing(hands: Hands) -> None:
    before = hands.walk.camera
    hands.hold(left_x=0.1, right_y=-0.1, left_trigger=-0.9)  # worn out
    assert not hands.spend(1.0) and hands.walk.camera == before
    hands.pad = None
    assert not hands.spend(1.0) and hands.walk.camera == before and not hands.called


def test_the_left_stick_moves_by_as_much_as_it_is_pushed(hands: Hands) -> None:
    ways = []
    for pushed in (0.5, 1.0):
        hands.walk = state()
        start = hands.walk.walker.position
        hands.hold(left_y=-pushed)  # ahead
        assert hands.spend(2.0)
        way = hands.walk.walker.position - start
        assert way.z < 0 and way.x == pytest.approx(0, abs=1e-6)
        ways.append(-way.z)
    assert ways[1] == pytest.approx(2 * hands.walk.walker.speed, rel=0.1)
    assert 0.1 < ways[0] / ways[1] < 0.3  # finer near the middle


def test_the_stick_and_keys_do_not_add_up(hands: Hands) -> None:
    hands.walk.held.press(Move.FORWARD)
    hands.hold(left_y=-1.0)
    hands.gamepad.advance(hands.walk, 0.02)
    assert hands.walk.held.take(0.02) == {Move.FORWARD: 0.02}
    hands.hold(left_x=-1.0)
    hands.gamepad.advance(hands.walk, 0.02)
    assert hands.walk.held.take(0.02)[Move.LEFT] == pytest.approx(0.02)
    assert hands.walk.held.take(0.02) == {Move.FORWARD: 0.02}  # a stick is asked anew in each frame


@pytest.mark.parametrize("dt", [0.01, 0.05])
def test_the_right_stick_turns_as_quickly_at_any_frame_rate(hands: Hands, dt: float) -> None:
    hands.hold(right_x=1.0)
    hands.spend(0.5, dt)
    assert hands.walk.walker.yaw == pytest.approx(-2.4 * 0.5, rel=0.02)  # to the right
    hands.hold(right_y=1.0)
    hands.spend(0.1, dt)
    assert hands.walk.walker.pitch < -0.1  # down


def test_after_a_pause_the_view_does_not_jump(hands: Hands) -> None:
    hands.hold(right_x=1.0)
    hands.gamepad.advance(hands.walk, 5.0)
    assert abs(hands.walk.walker.yaw) < math.radians(20)


def test_triggers_lift_off_and_sink(hands: Hands) -> None:
    hands.walk.set_mode(Mode.WALK)
    height = hands.walk.walker.position.y
    hands.hold(right_trigger=1.0)
    hands.spend(0.5)
    assert hands.walk.mode is Mode.FLY and hands.walk.walker.position.y > height + 0.5
    top = hands.walk.walker.position.y
    hands.hold(left_trigger=1.0)
    hands.spend(1.0)
    assert hands.walk.walker.position.y < top


def test_buttons_call_the_actions_of_keys_once(hands: Hands) -> None:
    hands.hold(Button.A, Button.START)
    assert hands.gamepad.advance(hands.walk, 0.02)
    assert not hands.gamepad.advance(hands.walk, 0.02)  # still held
    assert hands.called == ["before", "G", "before", "H"]
    hands.hold()
    assert hands.gamepad.advance(hands.walk, 0.02)  # released
    hands.hold(Button.A)
    hands.gamepad.advance(hands.walk, 0.02)
    assert hands.called[4:] == ["before", "G"]


def test_bumpers_change_the_speed_and_the_left_stick_runs(hands: Hands) -> None:
    speed = hands.walk.walker.speed
    hands.hold(Button.RIGHT_BUMPER)
    hands.gamepad.advance(hands.walk, 0.02)
    assert hands.walk.walker.speed > speed
    hands.hold(Button.LEFT_STICK)
    hands.gamepad.advance(hands.walk, 0.02)
    assert hands.walk.fast
    hands.pad = None  # unplugged
    hands.gamepad.advance(hands.walk, 0.02)
    assert not hands.walk.fast
    hands.walk.fast = True  # Shift
    hands.gamepad.advance(hands.walk, 0.02)
    assert hands.walk.fast


def test_who_plugs_one_in_is_told_and_who_had_one_is_not(hands: Hands) -> None:
    hands.gamepad.advance(hands.walk, 0.02)
    assert hands.walk.toast != CONNECTED and hands.gamepad.patience(0.5) < 0.1
    hands.pad = None
    hands.gamepad.advance(hands.walk, 0.02)
    assert hands.gamepad.patience(0.5) == 0.5
    hands.pad = PadState.resting()
    hands.gamepad.advance(hands.walk, 0.02)
    assert hands.walk.toast == CONNECTED


def test_every_button_s_key_has_an_action_and_the_help_names_the_gamepad() -> None:
    walk: Any = SimpleNamespace(state=state(), aspect=1.5, want_screenshot=lambda: None)
    assert set(KEYS.values()) <= set(key_actions(walk))
    assert "Gamepad" in dict(HELP)


def test_its_numbers_are_glfw_s() -> None:
    for axis in Axis:
        assert getattr(glfw, f"GAMEPAD_AXIS_{axis.name}") == axis
    names = {Button.LEFT_STICK: "LEFT_THUMB", **{Button[way]: f"DPAD_{way}" for way in ("UP", "RIGHT", "DOWN")}}
    for button in Button:
        assert getattr(glfw, f"GAMEPAD_BUTTON_{names.get(button, button.name)}") == button


def test_the_first_gamepad_is_read_while_the_window_has_the_focus(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: Any = SimpleNamespace(_window=None)
    focused = [True]
    told = SimpleNamespace(axes=[0.5] * 6, buttons=[1] + [0] * 14)
    monkeypatch.setattr(glfw, "joystick_is_gamepad", lambda number: number == 3)
    monkeypatch.setattr(glfw, "get_gamepad_state", lambda number: told)
    monkeypatch.setattr(glfw, "get_window_attrib", lambda *_: focused[0])
    found = read_gamepad(shown)
    assert found is not None and found.axes == (0.5,) * 6 and found.buttons == (True, *[False] * 14)
    focused[0] = False
    assert read_gamepad(shown) == PadState.resting()
    monkeypatch.setattr(glfw, "joystick_is_gamepad", lambda number: False)
    assert read_gamepad(shown) is None
