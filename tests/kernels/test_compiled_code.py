"""Compiled loops in the cache folder: who compiles them, and when they are removed."""

import os
import time
from pathlib import Path

import pytest

from depthwalk.kernels import compiled_code
from depthwalk.render import kernels

pytest.importorskip("numba")
FILES = Path(kernels.__file__).parent


def test_code_that_nobody_uses_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Folders of other states are kept for some weeks after their last use."""
    assert kernels.load()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    kernels.unload()
    compiled_code.folder(FILES).mkdir(parents=True)
    assert kernels.load()
    ages = {"new": 1, "old": 60, "unfinished": 60}
    for name, days in ages.items():
        other = compiled_code.folder(FILES).parent / name
        (other / "code").mkdir(parents=True)
        used = other if name == "unfinished" else other / "complete"
        used.touch()
        os.utime(used, (time.time() - days * 86_400,) * 2)
    own = compiled_code.folder(FILES) / "complete"
    os.utime(own, (0, 0))
    compiled_code.remove_unused(FILES)
    left = {path.name for path in compiled_code.folder(FILES).parent.iterdir()} & set(ages)
    assert left == {"new"}
    assert own.is_file()
    kernels.unload()
    assert kernels.load()
    assert own.stat().st_mtime > time.time() - 60  # counts as used


def test_one_process_at_a_time_compiles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Others wait, to read what it compiles; once all is compiled nobody waits."""
    fcntl = pytest.importorskip("fcntl")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (loops := tmp_path / "loops").mkdir()
    assert compiled_code.is_writable(loops, "nothing is done")

    def lock() -> None:
        with (compiled_code.folder(loops) / "lock").open("wb") as other:
            fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)

    with compiled_code.kept(loops), pytest.raises(BlockingIOError):
        lock()
    assert compiled_code.is_complete(loops)
    with compiled_code.kept(loops):
        lock()


def test_loops_elsewhere_or_installed_again_are_compiled_again(tmp_path: Path) -> None:
    """As numba would do it, though with the same contents: so they must not count as complete."""
    for place in (here := tmp_path / "loops", there := tmp_path / "others"):
        place.mkdir()
        (place / "loops.py").write_text("def double(x): return 2 * x")
        os.utime(place / "loops.py", (0, 1e9))
    before = compiled_code.folder(here)
    assert compiled_code.folder(there) != before == compiled_code.folder(here)
    os.utime(here / "loops.py", (0, 2e9))
    assert compiled_code.folder(here) != before
