"""What nannies do for their workers."""

import asyncio
import importlib
import subprocess
import sys
from types import SimpleNamespace

import dask
import pytest

from depthwalk.cluster import nanny
from depthwalk.cluster.lasting_worker import LastingWorker


def test_what_is_preloaded_exists() -> None:
    """The process that is forked passes over modules that it cannot import, and says nothing."""
    for name in nanny.PRELOADED:
        importlib.import_module(name)


def test_a_preloading_nanny_forks_workers_and_may_start_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded: list[object] = []
    monkeypatch.delenv(TUNABLES, raising=False)
    monkeypatch.setattr(nanny, "preload", lambda: loaded.append(dask.config.get(METHOD)))
    with dask.config.set({METHOD: "spawn"}):
        made = SimpleNamespace(config=dask.config.merge(dask.config.config), env={TRIM: "1"}, pre_spawn_env={TRIM: "1"})
        made.periodic_callbacks = {"tick": SimpleNamespace(callback_time=20.0)}
        nanny.dask_setup(made)
        assert loaded == [nanny.worker_config().get(METHOD, "spawn")]
        assert dask.config.get("distributed.worker.daemon") is False
    assert dask.config.get("distributed.worker.profile.enabled", config=made.config) is False  # what workers are given
    assert made.periodic_callbacks["tick"].callback_time >= 500
    assert not made.env and made.pre_spawn_env == {TUNABLES: "glibc.malloc.hugetlb=1"} and made.Worker is LastingWorker


def test_what_a_user_tells_the_c_library_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(TUNABLES, "glibc.malloc.arena_max=1")
    assert nanny.worker_config()[f"distributed.nanny.pre-spawn-environ.{TUNABLES}"] == "glibc.malloc.arena_max=1"


def test_a_worker_whose_scheduler_is_lost_leaves_its_nanny() -> None:
    told: list[dict[str, object]] = []

    class Lost:
        async def handle_stream(self, comm: object) -> None:
            raise OSError("the connection broke")

        async def close(self, **how: object) -> None:
            told.append(how)

    with pytest.raises(OSError, match="broke"):
        asyncio.run(LastingWorker.handle_scheduler(Lost(), None))  # type: ignore[arg-type]  # all that it asks for
    assert [how["nanny"] for how in told] == [False]


@pytest.mark.slow
def test_what_workers_are_forked_from_has_read_a_scene_and_is_not_searched_for_garbage() -> None:
    program = (
        "import gc, sys, depthwalk.commands.worker_start as made;"
        "from depthwalk.scene.path import PathFile;"
        "from depthwalk.cluster.nanny import PRELOADED;"
        "assert gc.isenabled() and gc.get_freeze_count() > 100_000;"
        "assert PathFile.__pydantic_complete__ and sys.modules.keys() >= set(PRELOADED);"
        "made._rehearse()"  # which may not fail, though a nanny would pass over it
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


def test_macos_does_not_fork(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "darwin")
    assert METHOD not in nanny.worker_config()


METHOD = "distributed.worker.multiprocessing-method"
TRIM = "MALLOC_TRIM_THRESHOLD_"
TUNABLES = "GLIBC_TUNABLES"
