"""Preparing assets beside the frames: nothing waits, and nothing is left behind."""

import multiprocessing.connection
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import Any, cast

import pytest

from depthwalk.assets import asset_files, worker
from depthwalk.assets.background import BackgroundLibrary
from depthwalk.assets.library import SceneLibrary
from depthwalk.assets.progress import Progress
from depthwalk.cook.cook import CookOptions, PrefetchedArrays
from depthwalk.errors import InputError
from depthwalk.ingest.mesh import Mesh
from depthwalk.scene.arrays import Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset

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


def count_readings(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the threads that read a mesh, from now on."""
    read, threads = SceneLibrary._read_mesh, []

    def counting(library: SceneLibrary, spec: MeshAsset) -> tuple[Mesh, str]:
        threads.append(threading.current_thread().name)
        return read(library, spec)

    monkeypatch.setattr(SceneLibrary, "_read_mesh", counting)
    return threads


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
    (spill,) = (folder.name for folder in [library._pool._spill] if folder)
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


@pytest.mark.parametrize(
    ("vertex", "reason"),
    [("0.5 0 1", "is flat and horizontal"), ("90000 9 1", "is 90000 m across, and depth images hold 1e-06 to 40000 m")],
)
@pytest.mark.slow
def test_what_cannot_have_depth_images_is_drawn_as_polygons(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, vertex: str, reason: str
) -> None:
    """The message says so; advice to draw polygons would be of no use."""
    empty_cache(monkeypatch, tmp_path / "cache")
    mesh = tmp_path / "floor.obj"
    mesh.write_text(f"v 0 0 0\nv {vertex}\nv 1 0 0\nf 1 2 3\n")
    with closing(BackgroundLibrary(load_scene(mesh).assets, processes=1)) as library:
        assert not library.is_cooked(0, OPTIONS)
        wait_until(library, lambda: bool(library.failures))
        assert library.failures == [f"{mesh.resolve()}: {reason}; it is drawn as polygons"]


@pytest.mark.slow
def test_cancelling_ends_the_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: BackgroundLibrary
) -> None:
    empty_cache(monkeypatch, tmp_path / "cache")
    library.is_cooked(0, OPTIONS)
    wait_until(library, lambda: library.progress is not None)
    assert isinstance(library._pool.executor, ProcessPoolExecutor)
    processes = list((library._pool.executor._processes or {}).values())
    library.cancel()
    end = time.monotonic() + 60
    # The pool's own thread joins them, too: whoever comes second learns the exit code a moment later.
    while any(process.exitcode is None for process in processes):
        assert time.monotonic() < end, "a process goes on"
        time.sleep(0.005)
    assert not library.poll() and library.progress is None and not library.is_cooked(0, OPTIONS)


def test_what_the_first_picture_shows_is_read_before_there_is_a_window(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: BackgroundLibrary
) -> None:
    empty_cache(monkeypatch, tmp_path / "cache")
    scene = load_scene(tiny_scene)
    SceneLibrary(scene.assets).cooked(0, OPTIONS)
    threads = count_readings(monkeypatch)
    library.prefetch(scene, None)
    wait_until(library, lambda: library.is_cooked(0, OPTIONS))
    load = library.cooked(0, OPTIONS)[0].load
    assert isinstance(load, PrefetchedArrays) and load()[0].count[0].sum() > 0
    assert threads == []  # no mesh is needed


@pytest.mark.parametrize("forced", [None, Representation.MESH])
def test_the_first_mesh_is_read_once_and_by_a_thread(
    tiny_scene: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    library: BackgroundLibrary,
    forced: Representation | None,
) -> None:
    """Whether it stands in for depth images that are missing, or is what is to be drawn."""
    empty_cache(monkeypatch, tmp_path / "cache")
    library.baking_waits = True
    threads = count_readings(monkeypatch)
    library.prefetch(load_scene(tiny_scene), forced)
    wait_until(library, lambda: bool(threads))
    assert library.mesh(0) is library.mesh(0) is not None
    assert len(threads) == 1 and threads[0].startswith("depth-images")


def test_of_a_large_file_only_a_coarse_mesh_is_read_ahead(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: BackgroundLibrary
) -> None:
    """It is drawn until the whole mesh, which the process that bakes reads for itself, is asked for here, too."""
    empty_cache(monkeypatch, tmp_path / "cache")
    monkeypatch.setattr(asset_files, "PREVIEWED", 0)
    threads = count_readings(monkeypatch)
    library.baking_waits = True
    assert not library.is_cooked(0, OPTIONS)
    wait_until(library, lambda: 0 in library._previews)
    preview = library.preview(0)
    assert preview is not None and library.drawn_mesh(0) is preview and threads == []
    whole = library.mesh(0)
    assert whole is not None and library.drawn_mesh(0) is preview and library.preview(0) is None
    library.forget_preview(0)
    assert library.drawn_mesh(0) is whole and len(threads) == 1


def test_a_mesh_that_cannot_be_read_ahead_is_complained_about_by_who_needs_it(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: BackgroundLibrary
) -> None:
    empty_cache(monkeypatch, tmp_path / "cache")
    tiny_scene.with_name("ball.ply").write_bytes(b"ply\nnothing else\n")
    library.prefetch(load_scene(tiny_scene), Representation.MESH)
    with pytest.raises(InputError, match=r"ball\.ply: "):
        library.mesh(0)


def test_baking_waits_until_it_may_begin(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: BackgroundLibrary
) -> None:
    empty_cache(monkeypatch, tmp_path / "cache")
    library.baking_waits = True
    assert not library.is_cooked(0, OPTIONS)
    assert wait_until(library, lambda: not library.is_searching) == []
    library.poll()
    assert not library._making and not library.is_cooked(0, OPTIONS) and not library.is_searching
    library.baking_waits = False
    wait_until(library, lambda: library.progress is not None)


@pytest.mark.slow
def test_a_mesh_that_was_read_is_handed_to_who_bakes_it(
    tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    empty_cache(monkeypatch, tmp_path / "cache")
    library = BackgroundLibrary(load_scene(tiny_scene).assets, processes=0)
    threads = count_readings(monkeypatch)
    assert library.mesh(0) is not None and len(threads) == 1
    wait_until(library, lambda: library.is_cooked(0, OPTIONS))
    library.close()
    assert len(threads) == 1


def test_the_process_that_will_bake_is_started_at_once_and_ends_with_the_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: BackgroundLibrary
) -> None:
    empty_cache(monkeypatch, tmp_path / "cache")
    library.baking_waits = True
    library.is_cooked(0, OPTIONS)
    wait_until(
        library,
        lambda: isinstance(library._pool.executor, ProcessPoolExecutor) and bool(library._pool.executor._processes),
    )
    assert isinstance(library._pool.executor, ProcessPoolExecutor)
    (process,) = (library._pool.executor._processes or {}).values()
    library.close()
    # Not `join`: the pool's own thread waits for the process too, and only one of the two is told how it ended.
    assert multiprocessing.connection.wait([process.sentinel], 60)
    library._pool.begin(1)  # as the thread that searches may do late
    assert library._pool.executor is None


@pytest.mark.parametrize("name", worker._IMPORTS)
def test_what_is_imported_ahead_exists(name: str) -> None:
    assert find_spec(name) is not None


def test_what_was_read_ahead_is_handed_over_once() -> None:
    calls: list[str] = []
    with ThreadPoolExecutor(1, "ahead") as threads:
        load = PrefetchedArrays(lambda: cast(Any, calls.append(threading.current_thread().name)), threads)
    load()
    assert calls == ["ahead_0"]
    load()
    assert calls == ["ahead_0", threading.current_thread().name]


def test_who_needs_what_no_thread_has_come_to_reads_it() -> None:
    """So that a frame never waits for what others need."""
    begun, calls = threading.Event(), []
    with ThreadPoolExecutor(1) as threads:
        threads.submit(begun.wait)
        load = PrefetchedArrays(lambda: cast(Any, calls.append(threading.current_thread())), threads)
        load()
        begun.set()
    assert calls == [threading.current_thread()]


def test_what_goes_wrong_in_a_thread_is_raised_where_it_is_needed() -> None:
    def damaged() -> Any:
        raise InputError("bust.dpci.npz: damaged")

    with ThreadPoolExecutor(1) as threads:
        load = PrefetchedArrays(damaged, threads)
    with pytest.raises(InputError, match=r"^bust\.dpci\.npz: damaged$"):
        load()
