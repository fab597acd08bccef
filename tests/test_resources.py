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
