import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.scene.arrays import Camera
from depthwalk.scene.path import CameraPath, load_path, path_text
from depthwalk.types import Array
from depthwalk.walk.recorder import LONGEST_STEP, Recorder, Tolerance, save_path, thinned

TOLERANCE = Tolerance(0.005)

Samples = NDArray[np.float64]


def walk(seconds: float = 20.0, rate: float = 60.0, uneven: float = 0.0) -> tuple[Samples, Samples, Samples]:
    """A walk that curves, turns its head now and then and zooms: times, views, angles."""
    times = np.arange(0, seconds, 1 / rate)
    times[1:] += uneven / rate * np.random.default_rng(1).uniform(-0.5, 0.5, len(times) - 1)
    yaw = 0.3 * times + 0.8 * np.tanh(4 * np.sin(0.7 * times))
    position = np.column_stack((4 * np.sin(0.3 * times), 1.7 + 0 * times, 6 * np.cos(0.2 * times)))
    look = np.column_stack((-np.sin(yaw), 0.2 * np.sin(times), -np.cos(yaw)))
    return times, np.hstack((position, position + look)), 1.0 + 0.2 * np.sin(0.5 * times)


def errors(path: CameraPath, times: Array, views: Array, fovs: Array) -> tuple[Array, Array, Array]:
    """Metres, radians and radians that each sample of the path is off."""
    found = [path.sample(time) for time in times]
    looks = np.array([np.subtract(camera.target, camera.position) for camera in found])
    looks /= np.linalg.norm(looks, axis=1)[:, None]
    true = views[:, 3:] - views[:, :3]
    cosine = np.einsum("nk,nk->n", looks, true / np.linalg.norm(true, axis=1)[:, None])
    moved = np.linalg.norm([camera.position for camera in found] - views[:, :3], axis=1)
    return moved, np.arccos(np.minimum(cosine, 1)), np.abs([camera.fov for camera in found] - fovs)


@pytest.mark.slow
@pytest.mark.parametrize("uneven", [0.0, 0.8])
def test_few_keyframes_show_the_same(uneven: float) -> None:
    samples = walk(uneven=uneven)
    path = thinned(*samples, TOLERANCE)
    moved, turned, zoomed = errors(path, *samples)
    assert moved.max() <= TOLERANCE.position and max(turned.max(), zoomed.max()) <= 1.001 * TOLERANCE.angle
    assert len(path.times) < 0.15 * len(samples[0])
    between = walk(rate=600.0)  # what nobody saw, while it was recorded at 60 Hz, is smooth too
    inside = between[0] <= path.times[-1]
    moved, turned, _ = errors(path, *(each[inside] for each in between))
    assert moved.max() < 1.5 * TOLERANCE.position and turned.max() < 3 * TOLERANCE.angle


def test_finer_tolerances_take_more_keyframes() -> None:
    counts = [len(thinned(*walk(), Tolerance(each, each / 5)).times) for each in (0.1, 0.01, 0.001)]
    assert counts[0] < counts[1] < counts[2]


def test_who_stands_or_goes_straight_needs_two_keyframes() -> None:
    times = np.linspace(0, 9, 500)
    views = np.array([1.0, 2, 3, 4, 5, 6]) + np.outer(times, (1, 0, 0, 1, 0, 0))
    assert len(thinned(times, views, np.ones(500), TOLERANCE).times) == 2


@pytest.mark.gl
@given(st.lists(st.floats(-100, 100), min_size=1, max_size=30), st.integers(0, 2**32 - 1))
def test_any_samples_are_met_and_read_again(
    tmp_path_factory: pytest.TempPathFactory, places: Sequence[float], seed: int
) -> None:
    random = np.random.default_rng(seed)
    times = np.cumsum(random.uniform(0.02, 1, len(places)))
    position = np.column_stack((places, random.uniform(-3, 3, (len(places), 2))))
    samples = (
        times,
        np.hstack((position, position + random.normal(size=position.shape))),
        random.uniform(0.5, 2, len(times)),
    )
    path = load_path(save_path(thinned(*samples, TOLERANCE), tmp_path_factory.getbasetemp()))
    moved, turned, zoomed = errors(path, *samples)
    assert moved.max() <= 1.001 * TOLERANCE.position and max(turned.max(), zoomed.max()) <= 1.01 * TOLERANCE.angle


def recorded(count: int, dt: float = 0.1) -> Recorder:
    recorder = Recorder()
    for k in range(count):
        recorder.add(dt, Camera((0.1 * k, 1, math.sin(k)), (0.1 * k, 1, -5), 1.0))
    return recorder


def test_time_starts_with_the_first_camera_and_stops_run_on() -> None:
    recorder = recorded(3)
    assert recorder.seconds == pytest.approx(0.2)
    recorder.add(60.0, Camera((0, 0, 0), (0, 0, -1), 1.0))
    assert recorder.seconds == pytest.approx(0.2 + LONGEST_STEP)
    path = recorder.path(TOLERANCE)
    assert path.times[0] == 0 and path.times[-1] == recorder.seconds


def test_frames_of_no_length_are_no_samples() -> None:
    path = recorded(1000, dt=0.001).path(Tolerance(1e-9))
    assert len(path.times) < 40 and np.diff(path.times).min() > 0.02


def test_a_recording_of_one_frame_is_a_path(tmp_path: Path) -> None:
    file = save_path(recorded(1).path(TOLERANCE), tmp_path)
    assert load_path(file).sample(0).position == (0, 1, 0)


def test_it_is_full_where_path_files_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.walk.recorder.MAX_KEYFRAMES", 5)
    recorder = recorded(4)
    assert not recorder.full
    recorder.add(0.1, Camera((0, 0, 0), (0, 0, -1), 1.0))
    assert recorder.full
    recorder.add(0.1, Camera((0, 0, 0), (0, 0, -1), 1.0))
    assert len(recorder.path(Tolerance(1e-9)).times) == 5


def test_it_is_saved_whole_under_a_new_name(tmp_path: Path) -> None:
    path = thinned(*walk(), TOLERANCE)
    files = [save_path(path, tmp_path) for _ in range(2)]
    assert sorted(tmp_path.iterdir()) == sorted(files) and files[0] != files[1]
    read = load_path(files[0])
    assert (read.fps, read.interpolation) == (30, "smooth")
    for name in ("times", "views", "fovs"):
        np.testing.assert_allclose(getattr(read, name), getattr(path, name), rtol=1e-8, atol=1e-12)


def test_what_no_path_file_may_hold_is_not_written(tmp_path: Path) -> None:
    far = CameraPath(
        fps=30.0,
        interpolation="smooth",
        times=np.zeros(1),
        views=np.array([(2e6, 0, 0, 2e6, 0, -1)], float),
        fovs=np.ones(1),
    )
    with pytest.raises(InputError, match="position"):
        save_path(far, tmp_path)
    assert not list(tmp_path.iterdir())
    assert "2000000" in path_text(far)
