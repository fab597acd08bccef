"""How coarse a setting may be until its pictures are no longer good enough."""

from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from depthwalk.bench.equal import SUPERSAMPLING, TOLERANCE, coarsened, path_flip, supersampled
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.types import Picture

CAMERA = Camera((0, 0, 1), (0, 0, 0), 1)


def test_the_coarsest_setting_that_meets_the_target_is_found() -> None:
    setting, flip = coarsened(lambda to: to / 10, 0.0, 8.0, 0.3)
    assert flip == setting / 10
    assert 0.29 < flip <= 0.3 * (1 + TOLERANCE)


def test_where_all_settings_are_good_the_coarsest_is_taken_at_once() -> None:
    asked = []
    assert coarsened(lambda to: asked.append(to) or 0.1, 0.0, 8.0, 0.1) == (8.0, 0.1)
    assert asked == [8.0]


def test_where_no_other_setting_is_good_the_finest_stays() -> None:
    setting, flip = coarsened(lambda to: 0.1 if to == 0 else 1.0, 0.0, 8.0, 0.1)
    assert (setting, flip) == (0.0, 0.1)


class Painter:
    """A renderer whose pictures are of one colour each, by the frame's number."""

    size = (24, 16)

    def __init__(self, *greys: int) -> None:
        self.greys, self.drawn = greys, -1

    def draw(self, view: View, linear: bool = False) -> None:
        self.drawn += 1

    def pixels(self) -> Picture:
        return np.full((*self.size[::-1], 4), self.greys[self.drawn], np.uint8)


def test_the_last_frame_of_each_moment_is_compared() -> None:
    references = [np.full((16, 24, 3), grey, np.uint8) for grey in (100, 200)]
    with ThreadPoolExecutor(1) as pool:
        moments = [[CAMERA, CAMERA], [CAMERA]]
        assert path_flip(cast(HeadlessRenderer, Painter(0, 100, 200)), moments, references, pool) == 0
        one_off = path_flip(cast(HeadlessRenderer, Painter(0, 100, 150)), moments, references, pool)
        both_off = path_flip(cast(HeadlessRenderer, Painter(0, 50, 150)), moments, references, pool)
    assert 0 < one_off < both_off <= 1


def test_references_are_means_in_linear_light() -> None:
    side = SUPERSAMPLING
    colour = np.zeros((side, 2 * side, 4), np.float32)
    colour[: side // 2, :side] = 1  # half white
    colour[:, side:] = 7  # brighter than white
    image = SimpleNamespace(colour=colour)
    headless = SimpleNamespace(size=(2 * side, side), draw=lambda view, linear: None, linear_image=lambda: image)
    (picture,) = supersampled(cast(HeadlessRenderer, headless), [CAMERA])
    assert picture.shape == (1, 2, 3)
    assert picture[0, 0] == pytest.approx(188, abs=1)  # sRGB of half the light
    assert (picture[0, 1] == 255).all()
