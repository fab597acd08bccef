"""Mesa's cache of shaders is left alone where its disk has room, and not used where it has none or no folder."""

import os
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from depthwalk.gpu.shader_cache import DISABLE, guard_shader_cache

MEGABYTE = 1 << 20


@pytest.mark.parametrize(("free", "expected"), [(0, "true"), (63 * MEGABYTE, "true"), (64 * MEGABYTE, None)])
@pytest.mark.parametrize("variable", ["XDG_CACHE_HOME", "MESA_SHADER_CACHE_DIR"])
def test_shaders_are_kept_where_there_is_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, variable: str, free: int, expected: str | None
) -> None:
    """The folder need not exist: its disk is that of the nearest that does."""
    asked: list[Path] = []
    environment = {"XDG_CACHE_HOME": "/", variable: str(tmp_path / "to" / "make")}
    monkeypatch.setattr("os.environ", environment)
    monkeypatch.setattr(
        shutil, "disk_usage", lambda place: (asked.append(place), SimpleNamespace(total=MEGABYTE**2, free=free))[1]
    )
    guard_shader_cache()
    assert asked == [tmp_path] and environment.get(DISABLE) == expected


@pytest.mark.parametrize("total", [0, MEGABYTE**2])
def test_a_folder_that_cannot_be_is_told_as_such(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, total: int
) -> None:
    """On what is no disk, as /proc; below a file; or where the user may not write. Mesa itself tells nobody why."""
    (tmp_path / "file").touch()
    monkeypatch.setattr(shutil, "disk_usage", lambda place: SimpleNamespace(total=total, free=total))
    monkeypatch.setattr(os, "access", lambda place, mode: not total)
    for name, why in (
        ("new", "cannot be created"),
        ("file", "is no folder"),
        ("file/new", f"cannot be created, since {tmp_path / 'file'} is no folder"),
    ):
        environment = {"MESA_SHADER_CACHE_DIR": str(tmp_path / name)}
        monkeypatch.setattr("os.environ", environment)
        guard_shader_cache()
        assert environment.get(DISABLE) == "true"
        assert caplog.messages[-1] == f"{tmp_path / name}: {why}: compiled shaders are not kept"


def test_what_the_user_has_set_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    environment = {DISABLE: "false"}
    monkeypatch.setattr("os.environ", environment)
    monkeypatch.setattr(shutil, "disk_usage", lambda place: SimpleNamespace(total=MEGABYTE, free=0))
    guard_shader_cache()
    assert environment == {DISABLE: "false"}


@pytest.mark.parametrize("module", ["gpu.headless_device", "walk.window"])
def test_every_way_to_a_context_looks_first(monkeypatch: pytest.MonkeyPatch, module: str) -> None:
    class Looked(BaseException):
        """Stops before a context is made."""

    def look() -> None:
        raise Looked

    monkeypatch.setattr(f"depthwalk.{module}.guard_shader_cache", look)
    with pytest.raises(Looked):
        if module == "walk.window":
            from depthwalk.walk.window import open_window

            open_window("", (64, 64))
        else:
            from depthwalk.gpu.headless_device import headless_device

            headless_device()
