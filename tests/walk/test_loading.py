import threading
from types import SimpleNamespace

import pytest

from depthwalk.scene.arrays import Representation
from depthwalk.walk.loading import LoadingScreen, StoppedError
from depthwalk.walk.scene_loader import SceneLoader


class FakeWindow(SimpleNamespace):
    """Counts what it shows."""

    def __init__(self):
        screen = SimpleNamespace(use=lambda: None, clear=lambda *colour: None)
        super().__init__(size=(64, 48), buffer_size=(64, 48), fbo=screen, is_closing=False, shown=0)

    def swap_buffers(self):
        self.shown += 1


def loading(drawn):
    told = []
    window = FakeWindow()
    overlay = SimpleNamespace(draw=lambda *arguments: drawn.append(threading.current_thread()))
    return window, told, LoadingScreen(window, overlay, lambda *line: told.append(line))


def test_each_stage_is_told_and_shown():
    window, told, screen = loading(drawn := [])
    screen.begin("scene.yaml")
    screen.report("bust", "reading")
    assert told == [("bust", "reading")] and window.shown == 2 and drawn


def test_who_closes_the_window_ends_the_loading():
    window, _, screen = loading([])
    window.is_closing = True
    with pytest.raises(StoppedError):
        screen.report("bust", "reading")


def test_what_is_stopped_ends_at_its_next_stage():
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


def test_what_begins_without_a_title_can_be_stopped_too():
    _, _, screen = loading([])
    screen.report("bust", "side")  # a bake for another representation
    assert screen.busy
    screen.stop()
    with pytest.raises(StoppedError):
        screen.report("bust", "caps")


def test_a_thread_that_reads_beside_the_frames_touches_no_window():
    window, told, screen = loading(drawn := [])
    window.is_closing = True
    thread = threading.Thread(target=screen.report, args=("bust", "reading"))
    thread.start()
    thread.join()
    assert told == [("bust", "reading")] and window.shown == 0 and not drawn


def test_a_stopped_bake_leads_back_to_what_was_shown():
    """However impatient its user is, a window that showed meshes shows them again, and stays open."""
    window, _, screen = loading([])
    baked, told = [], []

    def table():
        if world.representation is None:
            baked.append("bust")
            screen.report("bust", "side")
            screen.stop()
            screen.report("bust", "caps")

    world = SimpleNamespace(representation=None, table=table)
    renderer = SimpleNamespace(world=world, settings=SimpleNamespace(aa="none"))
    loader = SceneLoader(None, window, screen)
    loader._usable = Representation.MESH
    loader.load_missing(renderer, told.append)
    assert world.representation is Representation.MESH and baked == ["bust"]
    assert told == ["Loading was stopped"] and not screen.busy


def test_time_counts_as_loading_also_where_it_fails():
    """And the loading screen goes, so that the walk's next frames are not reported to it."""
    ended = []
    loader = SceneLoader(None, FakeWindow(), SimpleNamespace(end=lambda: ended.append(True)))
    with pytest.raises(StoppedError), loader.clock_stopped():
        raise StoppedError
    assert ended and loader.seconds > 0
