"""Route the window's events: to imgui while the mouse is over a widget, otherwise to the walk."""

import time
from collections.abc import Callable
from typing import Any, Literal

from depthwalk.walk.controls import Move
from depthwalk.walk.native_imgui import imgui
from depthwalk.walk.panel import Area
from depthwalk.walk.state import State
from depthwalk.walk.viewer import Mode
from depthwalk.walk.window import RIGHT_CTRL, Window

_MOVES = {"D": Move.RIGHT, "A": Move.LEFT, "E": Move.UP, "Q": Move.DOWN, "W": Move.FORWARD, "S": Move.BACK} | {
    "RIGHT": Move.RIGHT,
    "LEFT": Move.LEFT,
    "UP": Move.FORWARD,
    "DOWN": Move.BACK,
}
_IMGUI_KEYS = {
    "TAB": imgui.Key.tab,
    "LEFT": imgui.Key.left_arrow,
    "RIGHT": imgui.Key.right_arrow,
    "UP": imgui.Key.up_arrow,
    "DOWN": imgui.Key.down_arrow,
    "HOME": imgui.Key.home,
    "END": imgui.Key.end,
    "DELETE": imgui.Key.delete,
    "BACKSPACE": imgui.Key.backspace,
    "ENTER": imgui.Key.enter,
    "ESCAPE": imgui.Key.escape,
    "A": imgui.Key.a,
    "C": imgui.Key.c,
    "V": imgui.Key.v,
    "X": imgui.Key.x,
    "Z": imgui.Key.z,
}
_CTRL = "CTRL_"
_NOWHERE = -3.4028234663852886e38  # −FLT_MAX, which means "no mouse" to imgui
_LEFT, _RIGHT, _MIDDLE = 1, 2, 3  # moderngl-window's mouse buttons
_DOUBLE_CLICK = 0.4  # s, most time between the presses of a double click
_STEADY = 4.0  # window coordinates, most distance between them


class Input:
    """Listen to a window's keys and mouse: pass events to widgets, move the viewer, and call the keys' actions.

    Parameters
    ----------
    window
        The window; its event functions are replaced.
    state
        The walk that the events change.
    actions
        Actions of key presses, by moderngl-window's name of the key, with `CTRL_` before it if Ctrl is held. Keys that
        move the viewer need no action.
    before_change
        Called before an action, which may change the scene.
    """

    def __init__(
        self,
        window: Window,
        state: State,
        actions: dict[str, Callable[[], None]],
        before_change: Callable[[], None] = lambda: None,
    ) -> None:
        self._before_change = before_change
        self._had_event = True  # whether anything happened that a widget may show
        self._edits = False  # whether widgets have received a press, or a key that they wait for, since they were drawn
        self._window, self._state = window, state
        self._io = imgui.get_io()
        keys = window.keys
        self._actions = {
            (getattr(keys, name.removeprefix(_CTRL)), name.startswith(_CTRL)): action
            for name, action in actions.items()
        }
        self._moves = {getattr(keys, name): move for name, move in _MOVES.items()}
        self._imgui_keys = {getattr(keys, name): key for name, key in _IMGUI_KEYS.items()}
        self._shifts = {keys.LEFT_SHIFT, keys.RIGHT_SHIFT}
        self._ctrls = {keys.LEFT_CTRL, RIGHT_CTRL}
        self._areas: list[Area] = []
        self._busy = False
        self._dismisses = False  # whether open lists and values being changed should be let go
        self._drag: tuple[int, Literal["look", "pan"]] | None = None  # the button held, and what dragging does
        self._last: tuple[float, float] | None = None  # position of the mouse; None after a jump
        self._click: tuple[float, float, float] | None = None  # position and time of the last click
        window.key_event_func = self._on_key
        window.mouse_position_event_func = self._on_mouse
        window.mouse_drag_event_func = self._on_mouse
        window.mouse_press_event_func = self._on_press
        window.mouse_release_event_func = self._on_release
        window.mouse_scroll_event_func = self._on_wheel
        window.unicode_char_entered_func = self._on_character

    @property
    def captured(self) -> bool:
        """Return whether the mouse is hidden and turns the viewer."""
        return bool(self._window.mouse_exclusivity)

    def capture(self, on: bool) -> None:
        """Hide the mouse and let it turn the viewer if `on`; otherwise show it again."""
        self._window.mouse_exclusivity = on
        self._last = None
        if on:
            self._state.tell("The mouse looks around; Esc releases it")
            self._io.add_mouse_pos_event(_NOWHERE, _NOWHERE)

    @property
    def pointer(self) -> tuple[float, float]:
        """Return the mouse position: x and y from the upper left corner, as parts of the window's width and height.

        It is the window's centre while the mouse is captured, and before it has moved.
        """
        if self.captured or self._last is None:
            return 0.5, 0.5
        width, height = self._window.size
        return self._last[0] / max(width, 1), self._last[1] / max(height, 1)

    def set_areas(self, areas: list[Area]) -> None:
        """Set the `areas` of the window that widgets cover, where the mouse belongs to imgui.

        This must be called in every frame of imgui.
        """
        self._areas = areas
        self._edits = False
        if self._dismisses:
            self._dismisses = False
            if _is_list_open():
                imgui.internal.close_popup_to_level(0, False)
            imgui.internal.clear_active_id()
        self._busy = imgui.is_any_item_active() or _is_list_open()

    def note_event(self) -> None:
        """Record that something happened that may change what the window shows."""
        self._had_event = True

    def had_events(self) -> bool:
        """Return whether anything happened since the last call that may change what the window shows."""
        had_event, self._had_event = self._had_event, False
        return had_event

    @property
    def is_editing(self) -> bool:
        """Return whether widgets may change something when they are drawn next."""
        return self._edits or self._busy

    def _over_widgets(self, x: float, y: float) -> bool:
        x, y = self._among_widgets(x, y)
        inside = (left <= x < right and top <= y < bottom for left, top, right, bottom in self._areas)
        return self._busy or any(inside)

    def _among_widgets(self, x: float, y: float) -> tuple[float, float]:
        """Return a point of the window in widget coordinates (see `overlay`)."""
        extent, (width, height) = self._io.display_size, self._window.size
        return x * extent.x / max(width, 1), y * extent.y / max(height, 1)

    def _on_key(self, key: Any, action: Any, modifiers: Any) -> None:
        self._had_event = True
        self._edits |= self._io.want_capture_keyboard  # otherwise a held key, which repeats, would end every slice
        pressed = action == self._window.keys.ACTION_PRESS
        released = action == self._window.keys.ACTION_RELEASE
        repeated = not pressed and not released
        # On X11 the modifiers are those before the event: without the Ctrl that it presses, with the one it releases.
        self._io.add_key_event(imgui.Key.mod_ctrl, not released if key in self._ctrls else modifiers.ctrl)
        self._io.add_key_event(imgui.Key.mod_shift, not released if key in self._shifts else modifiers.shift)
        if key in self._imgui_keys and not repeated:
            self._io.add_key_event(self._imgui_keys[key], pressed)
        if key in self._shifts:
            self._state.fast = pressed or (repeated and self._state.fast)
        if repeated:
            return
        if not pressed:  # even if the key was pressed before imgui took the keyboard
            if key in self._moves:
                self._state.held.release(self._moves[key])
        elif key == self._window.keys.ESCAPE and self._busy:  # imgui closes an unfocused list by no key
            self._dismisses = True
        elif not (self._io.want_text_input or modifiers.alt):
            if key in self._moves and not modifiers.ctrl:
                self._state.held.press(self._moves[key])
            elif action_of_key := self._actions.get((key, bool(modifiers.ctrl))):
                self._before_change()
                action_of_key()

    def _on_character(self, character: str) -> None:
        self._had_event = True
        self._edits |= self._io.want_capture_keyboard
        self._io.add_input_character(ord(character))

    def _on_mouse(self, x: float, y: float, dx: float, dy: float) -> None:
        self._had_event = True
        # Computed here, since the differences from moderngl-window jump when the mouse is released.
        if self._last is not None and (self.captured or self._drag):
            right, down = x - self._last[0], y - self._last[1]
            if self._drag and self._drag[1] == "pan":
                height = max(self._window.size[1], 1)
                self._state.pan(right / height, down / height)
            else:
                self._state.look(right, down)
        self._last = x, y
        if not self.captured:
            self._io.add_mouse_pos_event(*self._among_widgets(x, y))

    def _on_press(self, x: float, y: float, button: int) -> None:
        self._had_event = True
        if self.captured:
            return
        # The position of the last motion: on X11, GLFW gives the present one, several events later at 3 fps.
        self._last = self._last or (x, y)
        self._io.add_mouse_pos_event(*self._among_widgets(*self._last))
        self._io.add_mouse_button_event(button - 1, True)
        if self._over_widgets(*self._last):
            self._edits = True
            return
        if self._state.mode is not Mode.ORBIT:
            if button == _RIGHT:
                self._drag = button, "look"
            elif button == _LEFT:
                self.capture(True)
        elif button == _LEFT and self._is_double(*self._last):
            self._state.turn_about(*self.pointer)
        elif button == _LEFT and not self._state.fast:  # Shift is not held
            self._drag = button, "look"
        elif button in (_LEFT, _MIDDLE, _RIGHT):
            self._drag = button, "pan"

    def _is_double(self, x: float, y: float) -> bool:
        """Return whether a click at this position, now, is the second of a double click."""
        before, now = self._click, time.monotonic()
        if before is None or now - before[2] > _DOUBLE_CLICK or abs(x - before[0]) + abs(y - before[1]) > _STEADY:
            self._click = x, y, now
            return False
        self._click = None
        return True

    def _on_release(self, x: float, y: float, button: int) -> None:
        self._had_event = True
        self._edits |= self._busy
        self._io.add_mouse_button_event(button - 1, False)
        if self._drag and self._drag[0] == button:
            self._drag = None

    def _on_wheel(self, right: float, up: float) -> None:
        self._had_event = True
        if not self.captured and self._over_widgets(*(self._last or (0.0, 0.0))):
            self._edits = True
            self._io.add_mouse_wheel_event(right, up)
        else:
            self._state.wheel(up)


def _is_list_open() -> bool:
    return bool(imgui.is_popup_open("", imgui.PopupFlags_.any_popup))
