"""Failures of the GPU, one after another."""

from types import SimpleNamespace

import moderngl
import pytest

from depthwalk.walk import recovery
from depthwalk.walk.recovery import GpuRecovery


class Restarts:
    """Fails so many times before it succeeds."""

    def __init__(self, failures: int) -> None:
        self.left, self.count = failures, 0

    def __call__(self) -> None:
        self.count += 1
        if self.left:
            self.left -= 1
            raise moderngl.Error(f"restart {self.count}")


def test_what_fails_while_it_restarts_is_tried_again() -> None:
    restart = Restarts(2)
    assert str(GpuRecovery(restart).recover(moderngl.Error("first"))) == "restart 2"
    assert restart.count == 3


def test_too_many_failures_end_it_with_the_last() -> None:
    restart = Restarts(9)
    with pytest.raises(moderngl.Error, match="restart 3"):
        GpuRecovery(restart).recover(moderngl.Error("first"))
    assert restart.count == 3


def test_failures_long_ago_do_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(range(0, 100, 5))
    monkeypatch.setattr(recovery, "time", SimpleNamespace(perf_counter=lambda: float(next(clock))))
    restart = Restarts(0)
    gpu = GpuRecovery(restart)
    for number in range(6):
        gpu.recover(moderngl.Error(f"failure {number}"))
    assert restart.count == 6


def test_other_errors_are_not_caught() -> None:
    def broken() -> None:
        raise ValueError("not of the GPU")

    with pytest.raises(ValueError, match="not of the GPU"):
        GpuRecovery(broken).recover(moderngl.Error("first"))
