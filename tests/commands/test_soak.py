"""The long walk: where it goes, and that it notices what grows."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from depthwalk.commands import soak
from depthwalk.commands.program import as_program
from depthwalk.commands.soak import Growth
from depthwalk.render.view.bounds import Bounds

app = as_program(soak.main)

BOUNDS = Bounds(np.array([[-20.0, 1, -5], [30, 1, 5]]), np.array([1.0, 2.0]))


@pytest.mark.slow
def test_the_walk_stays_among_the_objects_and_jumps_now_and_then() -> None:
    cameras = list(soak.random_walk(BOUNDS, 20_000))
    position = np.array([camera.position for camera in cameras])
    assert (np.abs(position[:, 0] - 5) <= 27).all() and (np.abs(position[:, 2]) <= 7).all()
    assert np.ptp(position[:, 0]) > 40 and np.ptp(position[:, 2]) > 10
    steps = np.linalg.norm(np.diff(position, axis=0), axis=1)
    assert np.median(steps) == pytest.approx(0.05)
    assert 10 < (steps > 0.06).sum() < 100
    assert cameras == list(soak.random_walk(BOUNDS, 20_000))
    assert cameras[:50] != list(soak.random_walk(BOUNDS, 50, seed=1))


def growth(gl_objects: int = 0, memory: float = 0.0, noise: int = 0) -> Growth:
    frame = np.arange(25_000, 50_000, 50)
    made = gl_objects * np.arange(len(frame))
    random = np.random.default_rng(3)
    used = 4e8 + memory * frame + noise * random.standard_normal(len(frame))
    return soak.Growth(frame=frame, gl_objects=40 + made, memory=used.astype(int))


def test_growth_is_told_from_noise() -> None:
    assert not growth().grows
    assert not growth(noise=1 << 20).grows
    assert growth(gl_objects=1).grows
    assert growth(memory=400, noise=1 << 20).grows
    assert growth(memory=400).bytes_per_frame == pytest.approx(400, abs=1)


@pytest.mark.gl
def test_a_short_soak(tiny_scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    walk = (str(tiny_scene), "--frames", "40", "--resolution", "32,24")
    assert soak.resident_bytes() > 10e6
    monkeypatch.setattr(soak, "resident_bytes", lambda: 50_000_000)
    result = CliRunner().invoke(app, walk)
    assert result.exit_code == 0, result.output
    assert "memory 50.0 to 50.0 MB" in result.stdout and "grows" not in result.stdout
    sizes = iter(range(50_000_000, 10**10, 1_000_000))
    monkeypatch.setattr(soak, "resident_bytes", lambda: next(sizes))
    result = CliRunner().invoke(app, walk)
    assert result.exit_code == 1 and "memory or the number of GL objects grows" in result.stdout
