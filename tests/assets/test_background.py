"""Preparing assets beside the frames: nothing waits, and nothing is left behind."""

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest

from depthwalk.assets.background import BackgroundLibrary, Progress
from depthwalk.assets.library import SceneLibrary
from depthwalk.cook.cook import CookOptions
from depthwalk.scene.loader import load_scene

OPTIONS = CookOptions()


@pytest.fixture
def library(tiny_scene: Path) -> Iterator[BackgroundLibrary]:
    """A library of the tiny scene, whose ball has no depth images yet."""
    library = BackgroundLibrary(load_scene(tiny_scene).assets, processes=1)
    yield library
    library.close()


def wait_until(library: BackgroundLibrary, done: Callable[[], bool], seconds: float = 60) -> list[Progress]:
    """Polls as frames do; what was told of progress meanwhile."""
    told, end = [], time.monotonic() + seconds
    while not done():
        assert time.monotonic() < end, "it never came"
        library.poll()
        if (progress := library.progress) is not None:
            told.append(progress)
        time.sleep(0.005)
    return told


def empty_cache(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))


@pytest.mark.slow
def test_what_is_cached_is_found(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: BackgroundLibrary
) -> None:
    empty_cache(monkeypatch, tmp_path / "cache")
    made = SceneLibrary(load_scene(tiny_scene).assets).cooked(0, OPTIONS)
    assert not library.is_cooked(0, OPTIONS) and library.is_searching  # a thread looks it up
    assert wait_until(library, lambda: library.is_cooked(0, OPTIONS)) == []  # no process was needed
    found = library.cooked(0, OPTIONS)
    assert found[0].outline.key == made[0].outline.key and not library.is_searching


@pytest.mark.slow
def test_an_asset_is_baked_beside_the_frames(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: BackgroundLibrary
) -> None:
    """Also where the cache can keep nothing, since it is a file."""
    (tmp_path / "file").touch()
    empty_cache(monkeypatch, tmp_path / "file")
    asked = time.perf_counter()
    assert not library.is_cooked(0, OPTIONS)
    assert time.perf_counter() - asked < 0.5
    told = wait_until(library, lambda: library.is_cooked(0, OPTIONS))
    assert (told[0].done, told[0].total) == (0, 1) and all(0 <= now.fraction <= 1 for now in told)
    assert library.progress is None and library.failures == []
    geometry, _ = library.cooked(0, OPTIONS)[0].load()
    assert geometry.count[0].sum() > 0
    (spill,) = (folder for folder in [library._spill] if folder)
    library.close()
    assert not Path(spill).exists()


@pytest.mark.slow
def test_a_mesh_that_cannot_be_baked_is_told_of_once(
    tmp_path: Path, tiny_scene: Path, monkeypatch: pytest.MonkeyPatch, library: BackgroundLibrary
) -> None:
    empty_cache(monkeypatch, tmp_path / "cache")
    tiny_scene.with_name("ball.ply").write_bytes(b"ply\nnothing else\n")
    assert not library.is_cooked(0, OPTIONS)
    wait_until(library, lambda: bool(library.failures))
    assert "ball.ply" in library.failures[0] and len(library.failures) == 1
    assert not library.is_cooked(0, OPTIONS) and not library.poll() and library.progress is None


@pytest.mark.slow
def test_cancelling_ends_the_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: BackgroundLibrary
) -> None:
    empty_cache(monkeypatch, tmp_path / "cache")
    library.is_cooked(0, OPTIONS)
    wait_until(library, lambda: library.progress is not None)
    assert isinstance(library._pool, ProcessPoolExecutor)
    processes = list((library._pool._processes or {}).values())
    library.cancel()
    end = time.monotonic() + 60
    # The pool's own thread joins them, too: whoever comes second learns the exit code a moment later.
    while any(process.exitcode is None for process in processes):
        assert time.monotonic() < end, "a process goes on"
        time.sleep(0.005)
    assert not library.poll() and library.progress is None and not library.is_cooked(0, OPTIONS)
