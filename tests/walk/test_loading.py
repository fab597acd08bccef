import threading

import pytest

from depthwalk.walk.loading import StoppedError
from walks import loading


def test_each_stage_is_told_and_shown() -> None:
    drawn: list[threading.Thread] = []
    window, told, screen = loading(drawn)
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
    drawn: list[threading.Thread] = []
    window, told, screen = loading(drawn)
    window.is_closing = True
    thread = threading.Thread(target=screen.report, args=("bust", "reading"))
    thread.start()
    thread.join()
    assert told == [("bust", "reading")] and window.shown == 0 and not drawn
