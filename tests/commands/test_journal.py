"""A journal holds what was written to it as a whole, and nothing else."""

import os
import time
from pathlib import Path

import pytest

from depthwalk.commands.journal import Journal, file_states


@pytest.fixture
def journal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Journal:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return Journal("a trial")


def test_entries_are_found_again(journal: Journal) -> None:
    assert journal.read() == {}
    journal.add("a", b'{"x": 1}')
    Journal("a trial").add("b", b"[]")
    assert Journal("a trial").read() == {"a": b'{"x": 1}', "b": b"[]"}
    assert Journal("another").read() == {}
    journal.remove()
    assert journal.read() == {} and not journal.path.exists()


def test_a_kill_at_any_byte_costs_one_entry_at_most(journal: Journal) -> None:
    journal.add("a", b"[1, 2]")
    first = journal.path.stat().st_size
    journal.add("b", b"[3, 4]")
    whole = journal.path.read_bytes()
    for size in range(first, len(whole)):
        journal.path.write_bytes(whole[:size])
        assert journal.read() == {"a": b"[1, 2]"}
        journal.add("c", b"[5]")
        assert journal.read() == {"a": b"[1, 2]", "c": b"[5]"}


def test_damage_is_left_out(journal: Journal) -> None:
    journal.add("a", b"[1, 2]")
    journal.add("b", b"[3, 4]")
    journal.path.write_bytes(journal.path.read_bytes().replace(b"[1, 2]", b"[1, 7]"))
    assert journal.read() == {"b": b"[3, 4]"}


def test_what_is_old_is_measured_again(journal: Journal) -> None:
    journal.add("a", b"[1, 2]")
    os.utime(journal.path, (time.time() - 8 * 86_400,) * 2)
    assert journal.read() == {} and not journal.path.exists()


def test_a_cache_that_cannot_be_written_is_told_of_once(
    journal: Journal, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "cache").write_text("a file, no folder")
    journal.add("a", b"[]")
    journal.add("b", b"[]")
    assert [record.levelname for record in caplog.records] == [
        "WARNING"
    ] and "if this run is interrupted, it cannot be continued" in caplog.text


def test_files_that_change_are_told_apart(tmp_path: Path) -> None:
    file = tmp_path / "a.ply"
    states = [file_states([file])]
    file.write_bytes(b"one")
    states.append(file_states([file]))
    file.write_bytes(b"two, longer")
    states.append(file_states([file, tmp_path / "none"]))
    assert len({repr(state) for state in states}) == 3
