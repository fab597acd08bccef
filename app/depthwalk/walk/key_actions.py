"""Define what each key does once when it is pressed; `hud.HELP` describes the keys to the user.

Keys that are held to move the viewer are in `input`.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

from depthwalk.render.up_axis import ModelTurn
from depthwalk.scene.arrays import Representation
from depthwalk.scene.saved_values import count_text
from depthwalk.walk.background_work import BackgroundWork
from depthwalk.walk.camera_text import camera_yaml
from depthwalk.walk.file_watch import OwnChange
from depthwalk.walk.input import Input
from depthwalk.walk.keeping import keep
from depthwalk.walk.legend import next_shown
from depthwalk.walk.loading import LoadingScreen
from depthwalk.walk.orbit import Side
from depthwalk.walk.state import Keeping, State
from depthwalk.walk.window import Window, copy_text


class Walk(Protocol):
    """Describe what keys act on; `app.Walk` explains each part. Any of them may be replaced during a walk."""

    window: Window
    state: State
    input: Input
    loading: LoadingScreen
    background: BackgroundWork
    model_turn: ModelTurn
    next_files: tuple[Path, ...]

    @property
    def aspect(self) -> float:
        """Return width / height of the window."""
        ...

    def want_screenshot(self) -> None:
        """Save the next picture to a file."""
        ...

    def inspect(self, across: float, down: float) -> None:
        """Inspect the object that the window shows at a place."""
        ...

    def note_own_change(self, change: OwnChange) -> None:
        """Take a change of a file for the walk's own."""
        ...


def key_actions(walk: Walk) -> dict[str, Callable[[], None]]:
    """Return the actions of the keys in a walk that has started, by moderngl-window's names of the keys."""
    state = walk.state

    def toggle(name: str) -> Callable[[], None]:
        return lambda: setattr(state, name, not getattr(state, name))

    return {
        "ESCAPE": lambda: _escape(walk),
        "B": lambda: state.tell(walk.background.stop_baking()),
        "C": lambda: walk.input.capture(not walk.input.captured),
        "F": lambda: state.frame_all(walk.aspect),
        "F12": walk.want_screenshot,
        "I": lambda: walk.inspect(*walk.input.pointer),
        "V": lambda: _copy_camera(walk),
        "CTRL_S": lambda: keep(walk, Keeping.SAVE),
        "N": state.toggle_turntable,
        "G": state.toggle_walking,
        "H": toggle("help"),
        "HOME": lambda: _go_home(walk),
        "K": state.toggle_recording,
        "L": state.focus,
        "O": state.toggle_orbit,
        "P": state.toggle_path,
        "R": lambda: _reload(walk),
        "T": lambda: state.turn_about(*walk.input.pointer),
        "TAB": lambda: _toggle_panel(walk),
        "U": lambda: _turn_up(walk),
        "X": lambda: next_shown(state.renderer.settings.inspection),
        "Z": toggle("hud"),
        "SPACE": state.toggle_animation,
        "NUMBER_1": lambda: state.represent(None),
        "NUMBER_2": lambda: state.represent(Representation.DPCI),
        "NUMBER_3": lambda: state.represent(Representation.MESH),
        "NUMBER_4": lambda: state.frame_all(walk.aspect, Side.FRONT),
        "NUMBER_5": lambda: state.frame_all(walk.aspect, Side.RIGHT),
        "NUMBER_6": lambda: state.frame_all(walk.aspect, Side.ABOVE),
    }


def _escape(walk: Walk) -> None:
    """Stop loading, release the mouse, hide the help or the panel, or close the window: the first that there is.

    Where values would be lost that the panel has changed, the window closes only once the key is pressed again.
    """
    state = walk.state
    if walk.loading.busy:
        walk.loading.stop()
    elif walk.input.captured:
        walk.input.capture(False)
    elif state.help:
        state.help = False
    elif state.panel:
        state.panel = False
    elif (unsaved := state.unsaved) and state.toast != (warning := _warning(state, unsaved)):
        state.tell(warning)
    else:
        walk.window.close()


def _toggle_panel(walk: Walk) -> None:
    """Show the panel, and release the mouse, which is needed there; or hide the panel."""
    walk.state.panel = not walk.state.panel
    if walk.state.panel and walk.input.captured:
        walk.input.capture(False)


def _warning(state: State, unsaved: Mapping[str, Any]) -> str:
    """Return what to tell before `unsaved` values are lost."""
    return f"Not in {state.scene.path.name}: {count_text(unsaved)}. Ctrl+S saves, Esc closes without"


def _copy_camera(walk: Walk) -> None:
    """Copy the camera to the clipboard, in the notation of scene files."""
    copy_text(walk.window, text := camera_yaml(walk.state.camera))
    walk.state.tell(f"Copied {text}")


def _reload(walk: Walk) -> None:
    """Read the scene's file again before the next frame."""
    if not walk.loading.busy:  # while another scene loads, this would reload the wrong one
        walk.next_files = walk.state.scene.files


def _turn_up(walk: Walk) -> None:
    """Turn a model so that its other axis points upward."""
    if (message := walk.model_turn.turn()) is None:
        walk.state.tell("U turns only a model opened by itself; in a scene file, set the asset's key `up`")
        return
    walk.state.home_is_framed = True
    _go_home(walk)
    walk.state.tell(message)


def _go_home(walk: Walk) -> None:
    """Return to the first camera, fitted to the window's present size if it shows all objects."""
    walk.state.fit_home(walk.aspect)
    walk.state.go_home()
