"""What `fuzz.judge` finds wrong with readers that do wrong on purpose."""

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from depthwalk.errors import InputError
from fuzz import budget
from fuzz.case import Target
from fuzz.judge import Fault, judge


def fault_of(folder: Path, read: Callable[[Path], object], data: bytes = b"data") -> Fault | None:
    target = Target(name="planted", seeds=list, read=read, modules=(), megabytes=64)
    return judge(target, {"x.txt": data}, folder)


class _RawError(InputError):
    """An error whose message is as it was given, as if nobody had made it printable."""

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.message = message

    def __str__(self) -> str:
        return self.message


def refuse(message: str) -> Callable[[Path], object]:
    def read(path: Path) -> None:
        raise _RawError(message.replace("PATH", str(path)))

    return read


@pytest.mark.parametrize("read", [Path.read_bytes, refuse("PATH:1: no number"), refuse("PATH: a\nPATH: b")])
def test_what_is_read_or_refused_is_in_order(tmp_path: Path, read: Callable[[Path], object]) -> None:
    assert fault_of(tmp_path, read) is None


@pytest.mark.parametrize(
    ("message", "kind"),
    [
        ("no number", "a message without a place"),
        ("PATH: a\nforged", "a message without a place"),
        ("PATH: \x1b[2J", "a message that cannot be printed"),
        ("PATH: " + "x" * 2000, "a message too long to be read"),
    ],
)
def test_messages(tmp_path: Path, message: str, kind: str) -> None:
    fault = fault_of(tmp_path, refuse(message))
    assert fault is not None and fault.kind == kind


def test_other_exceptions_and_where_they_come_from(tmp_path: Path) -> None:
    def read(path: Path) -> None:
        from fuzz.properties import holds

        holds(np.array([True, False]), "numbers rise")

    fault = fault_of(tmp_path, read)
    assert fault is not None and fault.kind == "AssertionError in properties.py holds: numbers rise"


def test_numbers_that_become_none(tmp_path: Path) -> None:
    fault = fault_of(tmp_path, lambda path: np.float32(1e30) * np.ones(1, np.float32) * np.float32(1e30))
    assert fault is not None and fault.kind.startswith("a warning in test_judge.py")


def test_readers_may_ignore_warnings(tmp_path: Path) -> None:
    def read(path: Path) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            warnings.warn("known", RuntimeWarning, stacklevel=1)

    assert fault_of(tmp_path, read) is None


def test_seconds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "SECONDS", 0.01)
    monkeypatch.setattr(budget, "SECONDS_PER_BYTE", 0.0)
    fault = fault_of(tmp_path, lambda path: sum(range(3_000_000)))
    assert fault is not None and fault.kind == "too many seconds"


def test_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    before = budget.used()
    assert before.peak > 10 << 20
    grown = budget.Cost(seconds=before.seconds, peak=before.peak + (65 << 20))
    monkeypatch.setattr(budget, "used", lambda: grown)
    assert budget.overdrawn(before, 10, megabytes=64) == "memory"
    assert budget.overdrawn(before, 1000, megabytes=64) is None  # a larger file may take more
