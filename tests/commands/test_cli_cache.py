"""`depthwalk cache`: what is kept, how much of it, and none of it any more."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from depthwalk.bake.cache import BAKED
from depthwalk.bake.level_file import LEVELS
from depthwalk.budget import CACHE_LIMIT
from depthwalk.cache import cache_folder
from depthwalk.cook.cooked_file import COOKED


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv(CACHE_LIMIT, "")  # what an option says in this process is undone with it
    return tmp_path / "cache"


def kept() -> list[str]:
    return sorted(path.name for path in cache_folder().iterdir())


@pytest.fixture
def filled() -> Path:
    for number, cache in enumerate((BAKED, LEVELS, COOKED)):
        path = cache.keep(f"{number}{number}", lambda path: path.write_bytes(bytes(1_000_000)))
        os.utime(path, (1_700_000_000 + number * 86_400,) * 2)
    (cache_folder() / "notes.txt").write_text("mine")
    return cache_folder()


def test_info_counts_each_kind(run: Callable[..., Any], filled: Path) -> None:
    done = run("cache", "info")
    assert (done.exit_code, done.stderr) == (0, "")
    assert done.stdout.splitlines() == [
        f"folder                   {filled}",
        "depth images             1 files, 1.0 MB, last used 2023-11-14",
        "simplified meshes        1 files, 1.0 MB, last used 2023-11-15",
        "mesh clusters            0 files, 0.0 MB",
        "captured views           0 files, 0.0 MB",
        "unfinished reports       0 files, 0.0 MB",
        "cooked depth images      1 files, 1.0 MB, last used 2023-11-16",
        "in all                   3.0 MB of 4295 MB",
    ]


def test_clear_removes_what_is_its_own(run: Callable[..., Any], filled: Path) -> None:
    done = run("cache", "clear")
    assert (done.exit_code, done.stdout) == (0, f"{filled}: removed 3 files, 3.0 MB\n")
    assert kept() == ["notes.txt"]
    assert run("cache", "clear").stdout == f"{filled}: removed 0 files, 0.0 MB\n"


def test_a_limit_removes_what_was_used_longest_ago(run: Callable[..., Any], filled: Path) -> None:
    (filled / "notes.txt").unlink()
    done = run("cache", "info", "--cache-limit", "2.5MB")
    assert done.stdout.splitlines()[-1] == "in all                   2.0 MB of 2 MB"
    assert kept() == ["11.levels.npz", "22.npz"]


def test_an_empty_cache_is_no_mistake(run: Callable[..., Any], home: Path) -> None:
    for action in ("info", "clear"):
        assert run("cache", action).exit_code == 0
    assert not home.exists()


def test_a_cache_folder_that_cannot_be_is_an_empty_one(
    run: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    for action in ("info", "clear"):
        assert (run("cache", action).exit_code, run("cache", action).stderr) == (0, "")


def test_a_wrong_limit_is_told(run: Callable[..., Any], tiny_scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done = run("render", tiny_scene, "-o", tiny_scene.with_name("a.png"), "--cache-limit", "much")
    assert (done.exit_code, done.stderr) == (2, "--cache-limit much: must be a size such as 500MB or 4GB\n")
    monkeypatch.setenv(CACHE_LIMIT, "4 apples")
    done = run("cache")
    assert (done.exit_code, done.stderr) == (2, "DEPTHWALK_CACHE_LIMIT 4 apples: must be a size such as 500MB or 4GB\n")
