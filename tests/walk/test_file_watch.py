"""Noticing that files have been saved."""

import os
import time
from pathlib import Path

import pytest

from depthwalk.walk import file_watch
from depthwalk.walk.file_watch import FileWatch, OwnChange, WatchThread, state_of


def looks(watch: FileWatch, start: float, count: int = 4) -> list[bool]:
    """What looks at intervals of a second say, beginning at `start` seconds."""
    return [watch.has_news(start + number) for number in range(count)]


def touch(file: Path, content: str = "") -> None:
    """Write a file, later than anything before."""
    later = file.stat().st_mtime_ns + 10**9 if file.exists() else None
    file.write_text(content)
    if later is not None:
        os.utime(file, ns=(later, later))


@pytest.fixture
def files(tmp_path: Path) -> list[Path]:
    found = [tmp_path / name for name in ("scene.yaml", "mesh.ply")]
    for file in found:
        file.write_text("")
    return found


def test_what_stays_the_same_is_no_news(files: list[Path]) -> None:
    assert not any(looks(FileWatch(files), 0)) and not any(looks(FileWatch([]), 0))


@pytest.mark.parametrize("number", [0, 1])
def test_a_file_that_is_saved_is_news_once(files: list[Path], number: int) -> None:
    watch = FileWatch(files)
    touch(files[number])
    assert looks(watch, 0) == [False, True, False, False]


def test_a_change_of_the_programs_own_is_no_news(files: list[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    watch = FileWatch(files)
    before = state_of(files[0])
    touch(files[0], "own")
    assert not watch.has_news(-1)  # between the change and its report
    monkeypatch.chdir(files[0].parent)
    watch.accept(OwnChange(Path(files[0].name), before, state_of(files[0])))
    assert not any(looks(watch, 0))
    touch(files[0], "another's")
    assert looks(watch, 10) == [False, True, False, False]


def test_a_change_of_the_programs_own_hides_none_of_others(files: list[Path]) -> None:
    watch = FileWatch(files)
    touch(files[0], "another's")
    touch(files[1], "another's")
    before = state_of(files[0])
    touch(files[0], "own")
    watch.accept(OwnChange(files[0], before, state_of(files[0])))
    assert looks(watch, 0) == [False, True, False, False]
    before = state_of(files[0])
    touch(files[0], "own")
    touch(files[1], "another's again")
    watch.accept(OwnChange(files[0], before, state_of(files[0])))
    assert looks(watch, 10) == [False, True, False, False]


def test_a_file_that_is_still_being_written_is_waited_for(files: list[Path]) -> None:
    watch = FileWatch(files)
    found = []
    for number in range(4):
        touch(files[1], "x" * number)
        found.append(watch.has_news(number))
    assert not any(found) and looks(watch, 10) == [True, False, False, False]


def test_files_that_go_and_come_back_are_news(files: list[Path]) -> None:
    watch = FileWatch(files)
    files[0].unlink()
    assert looks(watch, 0) == [False, True, False, False]
    files[0].write_text("again")
    assert looks(watch, 10) == [False, True, False, False]


def test_what_was_saved_while_the_scene_was_read_is_news(files: list[Path]) -> None:
    saved = files[0].stat().st_mtime_ns
    assert looks(FileWatch(files, saved - 1), 0) == [True, False, False, False]
    assert not any(looks(FileWatch(files, saved + 10**9), 0))
    os.utime(files[0], ns=(saved, saved + 10**15))  # by a clock that is wrong
    os.utime(files[1], ns=(saved, saved - 10**9))
    assert not any(looks(FileWatch(files, saved - 1), 0))


def test_files_are_not_looked_at_in_every_frame(files: list[Path]) -> None:
    watch = FileWatch(files)
    assert not watch.has_news(0.0)
    touch(files[0])
    assert not any(watch.has_news(number / 100) for number in range(30))


def test_a_thread_watches_until_it_is_ended(files: list[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file_watch, "_SECONDS", 0.1)
    watch = WatchThread(lambda: files)
    assert not watch.take_news()
    time.sleep(0.6)
    touch(files[0], "new")
    end = time.monotonic() + 10
    while not (found := watch.take_news()) and time.monotonic() < end:
        time.sleep(0.05)
    assert found and not watch.take_news()
    watch.end()
    touch(files[0], "again")
    time.sleep(0.4)
    assert not watch.take_news()
