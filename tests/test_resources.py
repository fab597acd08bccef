"""The folders that travel with the program."""

from pathlib import Path

import pytest

from depthwalk import resources


def test_folders_hold_what_they_are_for() -> None:
    assert (resources.shader_root() / "warp" / "warp.vert").is_file()
    assert list(resources.scene_root().glob("*.yaml")) and list(resources.asset_root().glob("*.ply"))


def test_a_wheel_has_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resources, "_PACKAGE", tmp_path / "site-packages" / "depthwalk")
    with pytest.raises(FileNotFoundError, match="incomplete"):
        resources.shader_root()
    (tmp_path / "site-packages" / "depthwalk" / "_data" / "shaders").mkdir(parents=True)
    assert resources.shader_root() == tmp_path / "site-packages" / "depthwalk" / "_data" / "shaders"


def test_a_name_means_the_users_own_file_first_and_then_one_that_ships(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    teapot = resources.asset_root() / "teapot.ply"
    for name in ("teapot.ply", "assets/teapot.ply"):
        assert resources.given_or_shipped(Path(name)).samefile(teapot)
    room = resources.scene_root() / "room.yaml"
    assert resources.given_or_shipped(Path("room.yaml")).samefile(room)
    assert resources.given_or_shipped(Path("scenes/paths/room.yaml")).samefile(
        resources.scene_root() / "paths/room.yaml"
    )
    (tmp_path / "teapot.ply").touch()
    for name in (
        "teapot.ply",
        "kettle.ply",
        "../room.yaml",
        "",
        "a\0b",
        "x" * 5000,
        "assets",
        str(tmp_path / "room.yaml"),
    ):
        assert resources.given_or_shipped(Path(name)) == Path(name)
