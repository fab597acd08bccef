"""How large widgets are on desktops that enlarge what they show, and what becomes of an error among them."""

import pytest

from depthwalk.gpu.device import Device
from depthwalk.walk.native_imgui import imgui
from depthwalk.walk.overlay import Overlay, pixels_per_unit


@pytest.mark.parametrize(
    ("buffer_size", "density", "pixels"),
    [
        ((1024, 768), 1.0, 1.0),
        ((1920, 1200), 1.5, 1.5),
        ((2048, 1536), 2.0, 2.0),  # also of a window of 1024 × 768 in coordinates of macOS or Wayland
        ((1024, 768), 2.0, 1.6),  # 640 × 480 units, for which help and panel are laid out
        ((2000, 600), 2.0, 1.25),
        ((320, 240), 2.0, 0.7),
        ((480, 400), 1.0, 0.75),
        ((300, 200), 1.0, 0.7),
        ((1024, 768), 0.75, 1.0),
    ],
)
def test_widgets_are_enlarged_as_the_desktop_is_where_the_window_has_room(
    buffer_size: tuple[int, int], density: float, pixels: float
) -> None:
    assert pixels_per_unit(buffer_size, density) == pytest.approx(pixels)


def broken_section() -> None:
    imgui.begin("panel")
    imgui.push_item_width(-100)
    imgui.begin_table("table", 2)
    raise ValueError("what is really wrong")


def test_an_error_in_the_middle_of_a_section_is_told_as_it_is(gl_device: Device) -> None:
    """Not as what imgui misses after it, and the next overlay begins without anything of it."""
    gl = gl_device.scope("screen")
    screen = gl.framebuffer([gl.texture((64, 48), 4)])
    broken = Overlay(gl_device, lambda: 1.0)
    with pytest.raises(ValueError, match="what is really wrong"):
        broken.draw(screen, screen.size, 0.1, broken_section)
    broken.release()
    whole = Overlay(gl_device, lambda: 1.0)
    whole.draw(screen, screen.size, 0.1, lambda: imgui.text("whole"))
    whole.release()
    gl.release()
