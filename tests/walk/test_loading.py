import threading
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import pytest

from depthwalk.render.renderer import Renderer
from depthwalk.scene.arrays import Representation
from depthwalk.walk.loading import LoadingScreen, StoppedError
from depthwalk.walk.overlay import Overlay
from depthwalk.walk.scene_loader import SceneLoader


class FakeWindow(SimpleNamespace):
    """Counts what it shows."""

    def __init__(self) -> None:
        screen = SimpleNamespace(use=lambda: None, clear=lambda *colour: None)
        super().__init__(size=(64, 48), buffer_size=(64, 48), fbo=screen, is_closing=False, shown=0)

    def swap_buffers(self) -> None:
        self.shown += 1


def loading(drawn: Sequence[Any]) -> tuple[FakeWindow, list[Any], LoadingScreen]:
    told: list[Any] = []
    window = FakeWindow()
    overlay = SimpleNamespace(draw=lambda *arguments: drawn.append(threading.current_thread()))
    return window, told, LoadingScreen(window, cast(Overlay, overlay), lambda *line: told.append(line))


def test_each_stage_is_told_and_shown() -> None:
    window, told, screen = loading(drawn := [])
    screen.begin("scene.yaml")
    screen.report("bust", "reading")
    assert told == [("bust", "reading")] and window.shown == 2 and drawn


def test_who_closes_the_window_ends_the_loading() -> None:
    window, _, screen = loading([])
    window.is_closing = True
    with pytest.raises(StoppedError):
        screen.report("bust", "reading")


def test_what_is_stopped_ends_at_its_next_stage() -> None:
    _, told, screen = loading([])
    screen.begin("scene.yaml")
    screen.report("bust", "reading")
    screen.stop()
    with pytest.raises(StoppedError):
        screen.report("bust", "side")
    screen.end()
    assert not screen.busy
    screen.begin("other.yaml")
    screen.report("bust", "reading")
    assert screen.busy and len(told) == 3


def test_what_begins_without_a_title_can_be_stopped_too() -> None:
    _, _, screen = loading([])
    screen.report("bust", "side")  # a bake for another representation
    assert screen.busy
    screen.stop()
    with pytest.raises(StoppedError):
        screen.report("bust", "caps")


def test_a_thread_that_reads_beside_the_frames_touches_no_window() -> None:
    window, told, screen = loading(drawn := [])
    window.is_closing = True
    thread = threading.Thread(target=screen.report, args=("bust", "reading"))
    thread.start()
    thread.join()
    assert told == [("bust", "reading")] and window.shown == 0 and not drawn


def test_a_stopped_bake_leads_back_to_what_was_shown() -> None:
    """However impatient its user is, a window that showed meshes shows them again, and stays open."""
    window, _, screen = loading([])
    baked, told = [], []

    def table() -> None:
        if world.representation is None:
            baked.append("bust")
            screen.report("bust", "side")
            screen.stop()
            screen.report("bust", "caps")

    world = SimpleNamespace(representation=None, table=table)
    renderer = SimpleNamespace(world=world, settings=SimpleNamespace(aa="none"))
    loader = SceneLoader(None, window, screen)
    loader._usable = Representation.MESH
    loader.load_missing(cast(Renderer, renderer), told.append)
    assert world.representation is Representation.MESH and baked == ["bust"]
    assert told == ["Loading was stopped"] and not screen.busy
