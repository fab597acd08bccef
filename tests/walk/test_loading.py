import threading
from typing import cast

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.walk.loading import LoadingScreen, StoppedError
from depthwalk.walk.overlay import Overlay
from depthwalk.walk.window import Window
from walks import FakeWindow, loading


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


@pytest.mark.gl
def test_progress_is_shown_over_the_last_picture(gl_device: Device) -> None:
    """However large the window has become; without one it is dark."""
    gl = gl_device.scope("test")
    overlay = Overlay(gl_device, lambda: 1.0)
    try:
        window = FakeWindow()
        window.size = window.buffer_size = (640, 480)
        window.fbo = gl.framebuffer([gl.texture((640, 480), 4)])
        rows = np.zeros((48, 64, 3), np.uint8)
        rows[24:] = 200, 100, 50  # the upper half
        screen = LoadingScreen(cast(Window, window), overlay, lambda *_: None)
        for backdrop, above in ((None, [13, 14, 17]), (gl.texture((64, 48), 3, data=rows.tobytes()), [200, 100, 50])):
            screen.backdrop = backdrop
            screen.begin("scene.yaml")
            shown = np.frombuffer(window.fbo.read(components=3), np.uint8).reshape(480, 640, 3)
            assert np.abs(shown[-1, 0].astype(int) - above).max() <= 1
            assert np.ptp(shown[210:270, 100:540].astype(int)) > 150  # the text
        assert not shown[0, 0].any()
    finally:
        overlay.release()
        gl.release()
