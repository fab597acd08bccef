from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from depthwalk.render.renderer import Renderer
from depthwalk.scene.arrays import Camera
from depthwalk.scene.effect_settings import DofParams
from depthwalk.scene.environment import Environment, WalkParams
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from depthwalk.walk.controls import Walker
from depthwalk.walk.focus import FocusPull
from depthwalk.walk.state import State

HOME = Camera((0.0, 1.0, 5.0), (0.0, 1.0, 0.0), 1.0)


def test_focus_moves_evenly_in_blur_and_arrives() -> None:
    lens, pull = DofParams(focus_distance=2.0), FocusPull()
    pull.start(20.0)
    passed = []
    while pull.target is not None:
        pull.advance(lens, 0.05)
        passed.append(lens.focus_distance)
    assert passed == sorted(passed) and 5 < len(passed) < 60
    assert lens.focus_distance == 20.0
    left = [1 / each - 1 / 20 for each in passed[:4]]
    assert [b / a for a, b in pairwise(left)] == pytest.approx([left[1] / left[0]] * 3)


def test_frames_of_any_length_come_to_the_same() -> None:
    ends = []
    for count in (1, 10):
        lens, pull = DofParams(focus_distance=2.0), FocusPull()
        pull.start(8.0)
        for _ in range(count):
            pull.advance(lens, 0.3 / count)
        ends.append(lens.focus_distance)
    assert ends[0] == pytest.approx(ends[1])


@pytest.mark.parametrize(("distance", "reached"), [(float("inf"), 10000.0), (0.01, 0.5)])
def test_a_lens_has_ends(distance: float, reached: float) -> None:
    lens, pull = DofParams(), FocusPull()
    pull.start(distance)
    pull.advance(lens, 60.0)
    assert lens.focus_distance == reached


def walk(distance: float, **dof: Any) -> State:
    settings = RenderSettings(dof=DofParams(**dof))
    renderer = SimpleNamespace(settings=settings, distance_at=lambda across, down: distance)
    scene = SimpleNamespace(
        environment=Environment(), walk=WalkParams(), render=settings, path=Path("scene.yaml"), camera=None
    )
    return State(cast(Scene, scene), cast(Renderer, renderer), Walker.at(HOME), HOME)


def test_the_key_focuses_once_and_autofocus_always() -> None:
    by_key, always, off = walk(3.0, mode="gather"), walk(3.0, mode="gather", autofocus=True), walk(3.0, autofocus=True)
    by_key.focus()
    for state in (by_key, always, off):
        state.pull_focus(60.0)
    assert "3 m" in by_key.toast
    found = [state.renderer.settings.dof.focus_distance for state in (by_key, always, off)]
    assert found == [3.0, 3.0, DofParams().focus_distance]


def test_the_key_says_that_nothing_is_blurred() -> None:
    state = walk(3.0)
    state.focus()
    assert "depth of field is off" in state.toast
