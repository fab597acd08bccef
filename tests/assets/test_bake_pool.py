"""The processes that bake beside a window or a picture."""

import threading

import pytest

from depthwalk.assets.bake_pool import BakePool


@pytest.mark.slow
@pytest.mark.parametrize("ends_first", [False, True])
def test_once_it_is_closed_nothing_is_left_of_its_processes(ends_first: bool) -> None:
    """Else Python, where it ends meanwhile, writes to a pipe that the executor's thread has just closed."""
    before = set(threading.enumerate())
    pool = BakePool()
    pool.begin(1)
    managers = set(threading.enumerate()) - before
    assert managers
    if ends_first:
        pool.end()
    pool.close()
    assert not any(thread.is_alive() for thread in managers)
    pool.begin(1)
    assert pool.executor is None  # closed for good
