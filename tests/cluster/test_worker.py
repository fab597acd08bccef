"""What a worker process keeps from task to task, and what it refuses."""

from collections.abc import Iterator
from contextlib import ExitStack

import pytest

import depthwalk
from depthwalk.cluster import worker
from depthwalk.errors import InputError


@pytest.fixture(autouse=True)
def _nothing_kept() -> Iterator[None]:
    yield
    worker.close()


def test_one_thing_is_kept_and_closed_before_the_next() -> None:
    told: list[str] = []

    def maker(name: str) -> object:
        def make(stack: ExitStack) -> str:
            told.append(f"open {name}")
            stack.callback(told.append, f"close {name}")
            return name

        return worker.keep(name, make)

    assert [maker("a"), maker("a"), maker("b")] == ["a", "a", "b"]
    worker.close()
    worker.close()
    assert told == ["open a", "close a", "open b", "close b"]


def test_what_cannot_be_made_leaves_nothing_open() -> None:
    told: list[str] = []

    def make(stack: ExitStack) -> None:
        stack.callback(told.append, "closed")
        raise InputError("no scene")

    for _ in range(2):
        with pytest.raises(InputError):
            worker.keep("a", make)
    assert told == ["closed", "closed"]


def test_a_worker_of_another_version_does_nothing() -> None:
    assert worker.call(depthwalk.__version__, "", max, 1, 2) == 2
    with pytest.raises(InputError, match=r"a worker has depthwalk .*, this is 0\.0\.0"):
        worker.call("0.0.0", "", max, 1, 2)
