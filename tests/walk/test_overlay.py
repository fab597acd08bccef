"""How large widgets are on desktops that enlarge what they show."""

import pytest

from depthwalk.walk.overlay import pixels_per_unit


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
