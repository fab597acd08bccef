"""What a walk makes ready beside its frames, and how it is stopped."""

import pytest

from depthwalk.assets.background import BackgroundLibrary
from depthwalk.assets.library import SceneLibrary
from depthwalk.walk.background_work import BackgroundWork


def test_a_library_without_threads_has_nothing_to_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded: list[bool] = []
    monkeypatch.setattr("depthwalk.render.kernels.load_behind", lambda: loaded.append(True))
    work = BackgroundWork(SceneLibrary(()))
    assert work.progress is None and work.failures == []
    assert work.stop_baking() == "Nothing is being baked"
    for _ in range(2):
        work.begin_deferred()
    assert loaded == [True]
    work.close()


def test_one_with_threads_bakes_once_there_is_a_picture_and_is_closed_when_another_comes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("depthwalk.render.kernels.load_behind", lambda: None)
    closed: list[BackgroundLibrary] = []
    monkeypatch.setattr(BackgroundLibrary, "close", lambda library: closed.append(library))
    first = BackgroundLibrary(())
    first.baking_waits = True
    first.failures.append("a.ply: empty file")
    work = BackgroundWork(first)
    work.begin_deferred()
    assert not first.baking_waits and work.failures == ["a.ply: empty file"]
    second = SceneLibrary(())
    work.replace(second)
    assert closed == [first] and work.library is second and work.failures == []
