"""What nannies do for their workers."""

import importlib

import dask
import pytest

from depthwalk.cluster import nanny


def test_what_is_preloaded_exists() -> None:
    """The process that is forked passes over modules that it cannot import, and says nothing."""
    for name in nanny.PRELOADED:
        importlib.import_module(name)


def test_a_preloading_nanny_forks_workers_and_may_start_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded: list[object] = []
    monkeypatch.setattr(nanny, "preload", lambda: loaded.append(dask.config.get(METHOD)))
    with dask.config.set({METHOD: "spawn"}):
        nanny.dask_setup(None)
        assert loaded == [nanny.worker_config().get(METHOD, "spawn")]
        assert dask.config.get("distributed.worker.daemon") is False


def test_macos_does_not_fork(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "darwin")
    assert METHOD not in nanny.worker_config()


METHOD = "distributed.worker.multiprocessing-method"
