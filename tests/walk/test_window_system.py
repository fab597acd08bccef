"""What a window learns from the desktop: events, density, room, and whether there is a display."""

import shutil
import subprocess
import sys

import pytest

from depthwalk.walk import NoDisplayError
from depthwalk.walk.window import fitted_size, open_window
from window_program import PATIENCE, linux

pytestmark = [pytest.mark.gl, pytest.mark.window]


WAITER = """
import threading
import glfw
from depthwalk.walk.window import open_window, wait_for_event

window = open_window("waits", (64, 64))
for _ in range(20):
    wait_for_event(0.01)  # takes what opening the window brings
happens = threading.Event()

def happen():
    happens.set()
    glfw.post_empty_event()

threading.Timer(0.2, happen).start()
while not happens.is_set():
    wait_for_event(1000)
wait_for_event(0)
wait_for_event(-1)
print("awake")
window.destroy()
"""


@linux
def test_waiting_for_an_event_ends_with_it(display: None) -> None:
    """In a process of its own, since GLFW looks for the display once. Without an event it would wait for minutes."""
    done = subprocess.run([sys.executable, "-c", WAITER], capture_output=True, text=True, timeout=PATIENCE)
    assert done.stdout == "awake\n", done.stderr


DENSITY = """
from depthwalk.walk.window import desktop_density, open_window, wait_for_event

for fitted in False, True:
    window = open_window("dense", (96, 64), fitted=fitted)
    for _ in range(20):
        wait_for_event(0.01)
    print(desktop_density(window), *window.buffer_size)
    window.destroy()
"""


@linux
@pytest.mark.skipif(shutil.which("xprop") is None, reason="xprop is not installed")
@pytest.mark.parametrize(("dots", "density", "large"), [("96", "1.0", "96 64"), ("192", "2.0", "192 128")])
def test_a_dense_desktop_tells_its_density_and_enlarges_only_windows_that_ask_for_it(
    display: None, dots: str, density: str, large: str
) -> None:
    name = "RESOURCE_MANAGER"  # where settings of the desktop stand
    subprocess.run(["xprop", "-root", "-f", name, "8s", "-set", name, f"Xft.dpi:\t{dots}\n"], check=True)
    done = subprocess.run([sys.executable, "-c", DENSITY], capture_output=True, text=True, timeout=PATIENCE)
    assert done.stdout.splitlines() == [f"{density} 96 64", f"{density} {large}"], done.stderr


@pytest.mark.parametrize(
    ("factor", "room", "expected"),
    [
        (2.0, (3840, 2160), (2048, 1536)),
        (2.0, (2560, 1152), (1536, 1152)),  # as high as the screen, in the same proportions
        (1.5, (1280, 2160), (1280, 960)),
        (2.0, (800, 600), (800, 600)),
        (1.0, (1366, 700), (933, 700)),  # a small notebook, below the desktop's bar
        (0.75, (800, 900), (800, 600)),
        (0.75, (3840, 2160), (1024, 768)),
        (2.0, (-10, 0), (1024, 768)),  # a desktop that tells nothing
    ],
)
def test_a_window_is_as_large_as_the_desktop_wants_it_and_the_screen_has_room(
    factor: float, room: tuple[int, int], expected: tuple[int, int]
) -> None:
    assert fitted_size((1024, 768), factor, room) == expected


@linux
def test_without_a_display_the_reason_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(NoDisplayError, match=r"cannot open a window: .*DISPLAY"):
        open_window("none", (64, 64))
