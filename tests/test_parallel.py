"""Threads share the baker's work and do not show in what it makes."""

import os
import threading
import time
from dataclasses import fields

import numpy as np
import pytest

from depthwalk.bake.baker import bake_object
from depthwalk.bake.params import BakeParams
from depthwalk.bake.raycast import RayCaster
from depthwalk.parallel import batches, begin, default_workers, thread_map
from shapes import box, joined, sphere


@pytest.mark.slow
def test_threads_do_not_show() -> None:
    """Past 2^15 texels every stage has several batches."""
    mesh = joined(sphere(0.7, 48, 24), box(0.3, 1, 0.9, (0.5, 1.2, 0)), box(1.2, 0.1, 0.1, (0, 0.9, 0.3)))
    alone, shared = (bake_object(mesh, BakeParams(resolution=192, layers=2), "", workers=workers) for workers in (1, 3))
    for name in ("images", "boundary_strips"):
        assert len(getattr(alone, name)) == len(getattr(shared, name)) > 5
        for one, other in zip(getattr(alone, name), getattr(shared, name), strict=True):
            for field in fields(one):
                np.testing.assert_equal(getattr(one, field.name), getattr(other, field.name))


def test_so_many_work_at_once_and_the_order_stays() -> None:
    together = threading.Barrier(3)

    def wait_for_the_others(number: int) -> int:
        together.wait(10)  # seconds; breaks where fewer threads come
        return number

    with thread_map(3) as each:
        assert list(each(wait_for_the_others, range(6))) == list(range(6))


def test_one_worker_is_the_caller_itself() -> None:
    with thread_map(1) as each:
        assert set(each(lambda _: threading.current_thread(), range(3))) == {threading.current_thread()}


def test_what_goes_wrong_in_a_thread_reaches_the_caller_and_ends_the_rest() -> None:
    done = []

    def fail(number: int) -> None:
        done.append(number)
        time.sleep(0.005 if number else 0)  # all of them: 2.5 s, in which even a busy machine calls the first off
        raise ValueError(number)

    before = threading.active_count()
    with pytest.raises(ValueError, match="0"), thread_map(2) as each:
        list(each(fail, range(1000)))
    assert threading.active_count() == before
    assert len(done) < 1000


@pytest.mark.parametrize(("cores", "processes", "threads"), [(1, 1, 1), (2, 1, 2), (16, 1, 4), (16, 8, 2), (2, 3, 1)])
def test_processes_share_the_cores(cores: int, processes: int, threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(cores)), raising=False)
    assert default_workers(processes) == threads


def test_batches_cover_everything() -> None:
    assert [list(range(7))[some] for some in batches(7, 3)] == [[0, 1, 2], [3, 4, 5], [6]]
    assert batches(0, 3) == [slice(0, 3)]


def test_rays_that_escape_are_those_that_meet_nothing() -> None:
    caster = RayCaster(sphere(1.0, 48, 24))
    random = np.random.default_rng(1)
    origin, direction = random.normal([0, 1, 0], 1, (5000, 3)), random.normal(size=(5000, 3))
    escaped = caster.escapes(origin, direction)
    np.testing.assert_array_equal(escaped, np.isinf(caster.first(origin, direction).distance))
    assert 500 < escaped.sum() < 4500


def test_each_ray_reaches_its_own_distance() -> None:
    caster = RayCaster(box(1, 1, 1))
    origin, direction = (np.array([[0, 0, z]] * 3, np.float32) for z in (3, -1))
    hits = caster.peel(origin, direction, 1, np.array([2.4, 2.6, np.inf]))
    np.testing.assert_allclose(hits.distance[0], [np.inf, 2.5, 2.5])


@pytest.mark.parametrize("workers", [1, 2])
def test_work_that_is_begun_may_use_the_map(workers: int) -> None:
    calls: list[int] = []

    def work() -> list[int]:
        calls.append(1)
        return list(parallel_map(abs, [-1, -2]))

    with thread_map(workers) as parallel_map:
        result = begin(work, parallel_map)
        assert result() == result() == [1, 2]
    assert calls == [1]


@pytest.mark.parametrize("workers", [1, 2])
def test_what_goes_wrong_in_work_that_was_begun_reaches_who_asks(workers: int) -> None:
    with thread_map(workers) as parallel_map:
        result = begin(lambda: 1 // 0, parallel_map)
        with pytest.raises(ZeroDivisionError):
            result()
