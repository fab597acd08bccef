"""The cache keeps within its limit."""

import errno
import os
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import pytest

from depthwalk import limits
from depthwalk.bake.cache import find_baked, has_key, keep_baked, sidecar
from depthwalk.bake.images import BakedObject
from shapes import bake, model_of, sphere


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setattr("depthwalk.cache.cache_folder", lambda: folder)
    return folder


@pytest.fixture(scope="module")
def baked() -> BakedObject:
    return bake(sphere(columns=32, rows=16), resolution=16, layers=1)


def keep(baked: BakedObject, key: str, age: int = 0) -> Path:
    """Stores `baked` under `key`, last used `age` seconds ago."""
    path = keep_baked(model_of(replace(baked, key=key)))
    os.utime(path, (path.stat().st_atime, path.stat().st_mtime - age))
    return path


def test_the_files_unused_for_longest_make_room(
    cache: Path, baked: BakedObject, monkeypatch: pytest.MonkeyPatch
) -> None:
    old, middle = keep(baked, "old", 300), keep(baked, "middle", 200)
    monkeypatch.setattr(limits, "MAX_CACHE_BYTES", int(3.5 * old.stat().st_size))
    recent = keep(baked, "recent", 100)
    assert set(cache.iterdir()) == {old, middle, recent}
    new = keep(baked, "new")
    assert set(cache.iterdir()) == {middle, recent, new}


def test_use_makes_a_file_young(
    cache: Path, baked: BakedObject, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    old, other = keep(baked, "old", 300), keep(baked, "other", 200)
    found = find_baked(tmp_path / "ball.ply", "old")
    assert found is not None and found.key == "old"
    monkeypatch.setattr(limits, "MAX_CACHE_BYTES", int(2.5 * old.stat().st_size))
    new = keep(baked, "new")
    assert set(cache.iterdir()) == {old, new} and not other.exists()


def test_the_file_just_written_stays_however_large(
    cache: Path, baked: BakedObject, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "MAX_CACHE_BYTES", 1)
    keep(baked, "old", 300)
    new = keep(baked, "new")
    assert list(cache.iterdir()) == [new]


def test_what_an_interrupted_write_left_is_removed_too(
    cache: Path, baked: BakedObject, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = keep(baked, "old", 100)
    left = path.with_name(f".{path.name}.1.exr")
    left.write_bytes(bytes(1000))
    os.utime(left, (0, 0))
    monkeypatch.setattr(limits, "MAX_CACHE_BYTES", 2 * path.stat().st_size + 500)
    new = keep(baked, "new")
    assert set(cache.iterdir()) == {path, new}


@pytest.mark.parametrize("gone", [True, False])
def test_files_that_vanish_or_stay_in_spite_do_not_matter(
    cache: Path, baked: BakedObject, monkeypatch: pytest.MonkeyPatch, gone: bool
) -> None:
    old, middle, recent = (keep(baked, key, age) for key, age in (("old", 300), ("middle", 200), ("recent", 100)))
    monkeypatch.setattr(limits, "MAX_CACHE_BYTES", int(3.5 * old.stat().st_size))
    unlink = type(old).unlink

    def disturbed(path: Path, missing_ok: bool = False) -> None:
        if path == old and not gone:
            raise PermissionError("open elsewhere")
        if path == old:
            unlink(path)  # another process was first
        unlink(path, missing_ok=missing_ok)

    monkeypatch.setattr(type(old), "unlink", disturbed)
    new = keep(baked, "new")
    assert set(cache.iterdir()) == ({middle, recent, new} if gone else {old, recent, new})


@pytest.mark.parametrize("error", [OSError(errno.EMFILE, os.strerror(errno.EMFILE)), MemoryError()])
def test_what_the_machine_cannot_read_now_stays_in_the_cache(
    cache: Path, baked: BakedObject, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, error: Exception
) -> None:
    path = keep(baked, "old")

    def fail(*arguments: object, **options: object) -> NoReturn:
        raise error

    with monkeypatch.context() as patch:
        patch.setattr("OpenEXR.File", fail)
        try:
            assert find_baked(tmp_path / "ball.ply", "old") is None
        except MemoryError:
            assert isinstance(error, MemoryError)
    found = find_baked(tmp_path / "ball.ply", "old")
    assert path.is_file() and found is not None and found.key == "old"


def test_a_file_beside_the_mesh_that_cannot_be_read_now_is_passed_over(
    cache: Path, baked: BakedObject, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    mesh = tmp_path / "ball.ply"
    keep(baked, "old").rename(sidecar(mesh))

    def fail(*arguments: object, **options: object) -> NoReturn:
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    with monkeypatch.context() as patch:
        patch.setattr("OpenEXR.File", fail)
        assert not has_key(sidecar(mesh), "old") and find_baked(mesh, "old") is None
    assert has_key(sidecar(mesh), "old")
