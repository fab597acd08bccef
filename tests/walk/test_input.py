"""Which events may make widgets change something: only for these a frame that is being drawn must be finished."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest

from depthwalk.walk.controls import Move
from depthwalk.walk.input import Input
from depthwalk.walk.native_imgui import imgui
from depthwalk.walk.panel import Area

PLAIN = SimpleNamespace(ctrl=False, shift=False, alt=False)
WITH_CTRL = SimpleNamespace(ctrl=True, shift=False, alt=False)
PANEL: Area = (0, 0, 100, 100)
RIGHT = 2


class Keys:
    """Every key, by its name."""

    ACTION_PRESS, ACTION_RELEASE = "press", "release"

    def __getattr__(self, name: str) -> str:
        return name


KEYS = Keys()


@pytest.fixture
def window() -> Iterator[Any]:
    """A window with a panel in its upper left corner; `frame` begins and ends a frame of its widgets."""
    context = imgui.create_context()
    io = imgui.get_io()
    io.set_ini_filename("")  # else it is written into the folder that tests run in
    io.display_size = imgui.ImVec2(480, 360)
    io.backend_flags |= imgui.BackendFlags_.renderer_has_textures
    window = SimpleNamespace(keys=KEYS, size=(480, 360), mouse_exclusivity=False)
    state = MagicMock(fast=False)
    leave, save = MagicMock(), MagicMock()
    input_ = Input(window, state, {"ESCAPE": leave, "CTRL_S": save})  # type: ignore[arg-type]

    def frame() -> None:
        imgui.new_frame()
        imgui.set_next_window_pos((0, 0))
        imgui.set_next_window_size((100, 100))
        imgui.begin("panel")
        imgui.input_text("name", "")
        imgui.combo("choice", 0, ["one", "two"])
        input_.set_areas([PANEL])
        imgui.end()
        imgui.end_frame()

    window.frame, window.input, window.state, window.leave, window.save = frame, input_, state, leave, save
    frame()
    yield window
    imgui.destroy_context(context)


def test_a_key_that_is_held_changes_no_widget(window: Any) -> None:
    """The system repeats it; each time a frame that is drawn in slices would be finished at once."""
    for action in (KEYS.ACTION_PRESS, "repeated", "repeated", KEYS.ACTION_RELEASE):
        window.key_event_func(KEYS.W, action, PLAIN)
        window.unicode_char_entered_func("w")
        assert not window.input.is_editing
        window.frame()
    assert window.input.had_events()
    window.state.held.press.assert_called_once()
    window.state.held.release.assert_called_once()


def test_keys_with_ctrl_have_actions_of_their_own(window: Any) -> None:
    for key, modifiers in (("S", PLAIN), ("ESCAPE", WITH_CTRL), ("S", WITH_CTRL)):
        window.save.assert_not_called()
        window.key_event_func(key, KEYS.ACTION_PRESS, modifiers)
        window.key_event_func(key, KEYS.ACTION_RELEASE, modifiers)
    window.save.assert_called_once()
    window.leave.assert_not_called()
    window.state.held.press.assert_called_once_with(Move.BACK)  # S alone


@pytest.mark.parametrize("name", ["CTRL", "SHIFT"])
def test_modifiers_hold_from_their_press_to_their_release(window: Any, name: str) -> None:
    """Whatever X11 says, which tells the modifiers from before the event: after Ctrl+S each click was a Ctrl+click."""
    held = SimpleNamespace(ctrl=name == "CTRL", shift=name == "SHIFT", alt=False)
    io = imgui.get_io()
    for key, action, modifiers, holds in (
        (f"LEFT_{name}", KEYS.ACTION_PRESS, PLAIN, True),
        ("S", KEYS.ACTION_PRESS, held, True),
        ("S", KEYS.ACTION_RELEASE, held, True),
        (f"LEFT_{name}", "repeated", held, True),
        (f"LEFT_{name}", KEYS.ACTION_RELEASE, held, False),
    ):
        window.key_event_func(key, action, modifiers)
        window.frame()
        assert (io.key_ctrl if name == "CTRL" else io.key_shift) == holds


@pytest.mark.parametrize(("arrow", "move"), [("UP", "FORWARD"), ("DOWN", "BACK"), ("LEFT", "LEFT"), ("RIGHT", "RIGHT")])
def test_the_arrow_keys_move_too(window: Any, arrow: str, move: str) -> None:
    window.key_event_func(arrow, KEYS.ACTION_PRESS, PLAIN)
    window.state.held.press.assert_called_once_with(Move[move])
    window.key_event_func(arrow, KEYS.ACTION_RELEASE, PLAIN)
    window.state.held.release.assert_called_once_with(Move[move])


def test_a_drag_beside_widgets_changes_none_and_a_click_on_one_may(window: Any) -> None:
    for x, edits in ((300, False), (50, True)):
        window.mouse_position_event_func(x, 50, 0, 0)
        window.mouse_press_event_func(x, 50, RIGHT)
        assert window.input.is_editing == edits
        window.frame()
        window.mouse_release_event_func(x, 50, RIGHT)
        window.frame()
        window.mouse_scroll_event_func(0, 1)
        assert window.input.is_editing == edits
        window.frame()


@pytest.mark.parametrize(("x", "edits"), [(190, True), (210, False)])
def test_presses_hit_widgets_that_are_enlarged(window: Any, x: float, edits: bool) -> None:
    """On a dense screen a widget that ends at 100 ends at 200 window coordinates, which GLFW gives."""
    imgui.get_io().display_size = imgui.ImVec2(240, 180)
    window.frame()
    window.mouse_position_event_func(x, 50, 0, 0)
    window.mouse_press_event_func(x, 50, RIGHT)
    window.frame()
    position = imgui.get_io().mouse_pos
    assert (position.x, position.y) == (x / 2, 25)
    window.mouse_scroll_event_func(0, 1)
    assert window.state.wheel.called != edits


def test_keys_go_to_a_text_that_is_edited(window: Any) -> None:
    window.mouse_position_event_func(20, 30, 0, 0)
    window.frame()
    window.mouse_press_event_func(20, 30, 1)
    window.frame()
    window.mouse_release_event_func(20, 30, 1)
    for _ in range(3):
        window.frame()
    assert imgui.get_io().want_capture_keyboard
    window.key_event_func(KEYS.W, KEYS.ACTION_PRESS, PLAIN)
    assert window.input.is_editing
    window.state.held.press.assert_not_called()


def click(window: Any, x: float, y: float) -> None:
    window.mouse_position_event_func(x, y, 0, 0)
    window.frame()
    window.mouse_press_event_func(x, y, 1)
    window.frame()
    window.mouse_release_event_func(x, y, 1)
    window.frame()


def press_escape(window: Any) -> None:
    for action in (KEYS.ACTION_PRESS, KEYS.ACTION_RELEASE):
        window.key_event_func(KEYS.ESCAPE, action, PLAIN)
        window.frame()


def test_escape_closes_an_open_list_and_only_then_the_window(window: Any) -> None:
    click(window, 20, 55)
    assert imgui.get_io().want_capture_mouse and window.input.is_editing
    press_escape(window)
    window.leave.assert_not_called()
    window.frame()
    assert not window.input.is_editing
    press_escape(window)
    window.leave.assert_called_once()


def test_escape_leaves_a_text_that_is_edited_and_not_the_window(window: Any) -> None:
    click(window, 20, 30)
    assert imgui.get_io().want_text_input
    press_escape(window)
    window.leave.assert_not_called()
    for _ in range(2):
        window.frame()
    press_escape(window)
    window.leave.assert_called_once()
