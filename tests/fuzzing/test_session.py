"""A planted fault is found, made short, and found again with the same seed."""

import json
import time
from pathlib import Path

import pytest

from depthwalk.errors import InputError
from depthwalk.ingest.mtl import parse_mtl
from fuzz.budget import SECONDS
from fuzz.case import Files, Target
from fuzz.judge import Fault
from fuzz.line_trace import LineTrace
from fuzz.session import Session, Tally, shortened


def read(path: Path) -> None:
    materials = parse_mtl(path.read_text("latin-1"))
    if any(material.terms.get("ns") == 90 and name != "red" for name, material in materials.items()):
        raise KeyError("planted")
    if not materials:
        raise InputError(f"{path}: none")


TARGET = Target(
    name="planted",
    seeds=lambda: [{"x.mtl": b"newmtl red\nKd 1 1 1\nmap_Kd skin.png\nNs 90\n", "beside.png": b"x"}],
    read=read,
    modules=("depthwalk.ingest.mtl",),
    words=(b"#",),
)


@pytest.fixture
def _unlimited(monkeypatch: pytest.MonkeyPatch) -> None:
    """A session limits the seconds of its process, which here runs other tests, too."""
    monkeypatch.setattr("fuzz.session.limit_seconds", lambda: None)


def run(folder: Path, seed: int) -> Tally:
    folder.mkdir()
    session = Session(TARGET, seed, folder)
    for files in TARGET.seeds():
        session.attempt(files)
    while not session.tally.faults and session.tally.inputs < 3000:
        session.attempt(session.changed())
    return session.tally


@pytest.mark.usefixtures("_unlimited")
def test_a_planted_fault_is_found_and_made_short(tmp_path: Path) -> None:
    tally = run(tmp_path / "a", 0)
    assert list(tally.faults) == ["KeyError in test_session.py read"] or "KeyError" in next(iter(tally.faults))
    assert 1 < tally.inputs < 3000 and tally.kept > 1
    found = tmp_path / "a" / "fault-1"
    assert [path.name for path in found.iterdir()] == ["x.mtl"]  # nothing needs the file beside it
    assert len((found / "x.mtl").read_bytes()) <= 24
    assert json.loads((tmp_path / "a" / "fault-1.json").read_text())["first"] == "x.mtl"
    again = run(tmp_path / "b", 0)
    assert again.inputs == tally.inputs
    assert (tmp_path / "b" / "fault-1" / "x.mtl").read_bytes() == (found / "x.mtl").read_bytes()


@pytest.mark.usefixtures("_unlimited")
@pytest.mark.parametrize("is_slow", [False, True])
def test_time_that_the_trace_takes_is_no_fault(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_slow: bool) -> None:
    def judged(
        target: Target, files: Files, folder: Path, trace: LineTrace | None = None, part: float = 1.0
    ) -> Fault | None:
        seconds = 2 * SECONDS if trace else SECONDS * (0.5 if is_slow else 0.2)
        return Fault(kind="too many seconds", detail="") if seconds > part * SECONDS else None

    monkeypatch.setattr("fuzz.session.judge", judged)
    session = Session(TARGET, 0, tmp_path)
    session.attempt({"x.mtl": b"Ns"})
    assert ("too many seconds" in session.tally.faults) == is_slow


@pytest.mark.usefixtures("_unlimited")
def test_lines_are_noted(tmp_path: Path) -> None:
    tally = Session(TARGET, 0, tmp_path).run(time.monotonic() - 1)  # the seeds alone
    (lines,) = tally.lines.values()
    assert tally.inputs == 1 and len(lines) > 10


def test_what_does_not_matter_is_left_out() -> None:
    files = {"a": b"one two three four five", "b": b"beside", "c": b"needed too"}
    short = shortened(files, lambda tried: b"three" in tried["a"] and b"too" in tried.get("c", b""))
    assert short == {"a": b"three", "c": b"too"}
