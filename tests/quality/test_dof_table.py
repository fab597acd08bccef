from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from depthwalk.gpu.device import Device
from depthwalk.quality import dof
from depthwalk.quality.dof import TimedPicture
from depthwalk.quality.rows import Row
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.effect_settings import DofParams
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene


def quietly(name: str, stage: str) -> None:
    """Nobody listens."""


@pytest.fixture
def rows(tiny_scene: Path, monkeypatch: pytest.MonkeyPatch, gl_device: Device) -> Callable[..., Any]:
    """Of the ball, in focus before nothing."""
    monkeypatch.setattr(dof, "TRUTH", 24)
    monkeypatch.setattr(dof, "REPEATS", 1)
    monkeypatch.setattr(dof, "FOCAL_LENGTH", 400)

    def measure(**settings: int) -> tuple[Scene, dict[str, Row]]:
        scene = load_scene(tiny_scene, overrides={f"render.dof.{key}": str(value) for key, value in settings.items()})
        return scene, {row.name: row for row in dof.examine([scene], (80, 60), quietly)}

    return measure


def test_modes_are_measured_against_many_frames(rows: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dof, "NEAREST_FOCUS", 2.0)
    monkeypatch.setattr(dof, "FARTHEST_FOCUS", 2.0)  # before the ball, which is all blurred
    _, found = rows(max_blur=25)
    none, gather = found["none, dB"], found["gather, dB"]
    assert none.measured + 3 < gather.measured < 60 and gather.reached and none.goal is None
    assert gather.details["FLIP"] < none.details["FLIP"]
    assert found["gather: time, × 24 frames"].measured > 0  # what it is depends on what else the machine does
    assert len(gather.pictures) == 3 and len(found) == 7


def test_what_is_in_the_middle_is_in_focus(rows: Callable[..., Any]) -> None:
    scene, found = rows()
    assert scene.render.dof.focus_distance == pytest.approx(3, abs=0.02)  # the ball's near side
    assert found["gather: changed in focus, of 255"].measured <= 1
    assert found["gather: changed in focus, of 255"].reached


def test_all_is_compared_with_one_anti_aliasing_but_pixels_in_focus_without(
    rows: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn, draw = [], dof._draw

    def noted(headless: HeadlessRenderer, view: View, lens: DofParams, mode: str, *rest: Any) -> TimedPicture:
        drawn.append((mode, headless.renderer.settings.aa))
        return draw(headless, view, lens, mode, *rest)

    monkeypatch.setattr(dof, "_draw", noted)
    rows()
    assert drawn == [(mode, "none") for mode in dof.MODES[:-1]] + [(mode, "ssaa") for mode in dof.MODES]
