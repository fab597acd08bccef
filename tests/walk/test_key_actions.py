"""What keys do once when they are pressed."""

import re
from types import SimpleNamespace
from typing import cast

from depthwalk.scene.arrays import Camera
from depthwalk.walk.hud import HELP
from depthwalk.walk.key_actions import Walk, key_actions
from walks import HOME, state


def walk(**parts: object) -> Walk:
    """A walk of only these parts, in a window of 3:2."""
    return cast(Walk, SimpleNamespace(state=state(), aspect=1.5, want_screenshot=lambda: None, **parts))


def test_the_help_names_every_key() -> None:
    told = {word.replace("+", "_").upper() for keys, _ in HELP for word in re.findall(r"[\w+]+", keys)} | {"ESCAPE"}
    assert {name.removeprefix("NUMBER_") for name in key_actions(walk())} <= told


def test_home_is_fitted_to_the_window_where_it_shows_all_objects() -> None:
    viewer = walk()
    go_home = key_actions(viewer)["HOME"]
    go_home()
    assert viewer.state.camera.position == HOME.position  # as given
    viewer.state.home_is_framed = True
    go_home()
    assert viewer.state.camera.position == viewer.state.home.position == (0, 1, 9)


def test_a_turned_model_is_seen_from_home_and_others_are_not_turned() -> None:
    turned = iter(["z points upward", None])
    viewer = walk(model_turn=SimpleNamespace(turn=lambda: next(turned)))
    turn_up = key_actions(viewer)["U"]
    turn_up()
    assert viewer.state.toast == "z points upward" and viewer.state.camera.position == (0, 1, 9)
    viewer.state.home = Camera((1, 2, 3), (0, 0, 0), 1.0)
    turn_up()
    assert "scene file" in viewer.state.toast and viewer.state.camera.position == (0, 1, 9)


def test_what_loads_is_not_reloaded() -> None:
    viewer = walk(loading=SimpleNamespace(busy=True), next_files=())
    key_actions(viewer)["R"]()
    assert not viewer.next_files
    viewer.loading.busy = False
    key_actions(viewer)["R"]()
    assert viewer.next_files == viewer.state.scene.files


def test_escape_closes_what_is_in_front() -> None:
    """Loading, the captured mouse, the help and the panel come before the window."""
    closed: list[str] = []
    mouse = SimpleNamespace(captured=True, capture=lambda on: closed.append("mouse"))
    viewer = walk(
        loading=SimpleNamespace(busy=True, stop=lambda: closed.append("loading")),
        input=mouse,
        window=SimpleNamespace(close=lambda: closed.append("window")),
    )
    shown, escape = viewer.state, key_actions(viewer)["ESCAPE"]
    shown.help = shown.panel = True
    escape()
    viewer.loading.busy = False
    escape()
    assert closed == ["loading", "mouse"]
    mouse.captured = False
    escape()
    assert (shown.help, shown.panel) == (False, True)
    escape()
    assert not shown.panel and closed == ["loading", "mouse"]
    escape()
    assert closed == ["loading", "mouse", "window"]


def test_the_panel_releases_the_mouse_when_it_opens() -> None:
    """Which may be captured again beside it."""
    mouse = SimpleNamespace(captured=True)
    mouse.capture = lambda on: setattr(mouse, "captured", on)
    viewer = walk(input=mouse)
    toggle = key_actions(viewer)["TAB"]
    toggle()
    assert (viewer.state.panel, mouse.captured) == (True, False)
    mouse.captured = True
    toggle()
    assert (viewer.state.panel, mouse.captured) == (False, True)


def test_escape_warns_before_values_are_lost() -> None:
    """Once: pressed again it closes; and neither of false colours nor of what no file can hold."""
    closed: list[bool] = []
    viewer = walk(
        loading=SimpleNamespace(busy=False),
        input=SimpleNamespace(captured=False),
        window=SimpleNamespace(close=lambda: closed.append(True)),
    )
    escape, settings = key_actions(viewer)["ESCAPE"], viewer.state.scene.render
    settings.inspection.show = "level"
    escape()
    assert closed.pop()
    settings.warp.reuse_error = 3.0
    settings.shadows.enabled = not settings.shadows.enabled
    escape()
    assert not closed and viewer.state.toast.startswith("Not in scene.yaml: 2 values.")
    escape()
    assert closed.pop()
    viewer.state.tell("Something else, so that the warning is not on the screen any more")
    escape()
    assert not closed
    viewer.state.saved_to = "nowhere"
    escape()
    assert closed
