"""Simplified meshes in the cache."""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.bake.level_file import LEVELS
from depthwalk.ingest.mesh import MeshLevel
from shapes import simplified, sphere


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.cache.cache_folder", lambda: tmp_path / "baked")


@pytest.fixture(scope="module")
def levels() -> tuple[MeshLevel, ...]:
    return simplified(sphere(columns=24, rows=12))


def test_levels_are_found_again(cache: None, levels: tuple[MeshLevel, ...]) -> None:
    LEVELS.keep_value(levels, "abc")
    found = LEVELS.find_value(levels[0].mesh, "abc")
    assert found is not None and len(found) == len(levels) > 1 and found[0].mesh is levels[0].mesh
    for one, other in zip(levels, found, strict=True):
        assert one.error == other.error and one.mesh.parts == other.mesh.parts
        for name in ("positions", "normals", "colours", "uv", "faces"):
            np.testing.assert_array_equal(getattr(one.mesh, name), getattr(other.mesh, name))


def test_other_keys_have_none(cache: None, levels: tuple[MeshLevel, ...]) -> None:
    LEVELS.keep_value(levels, "abc")
    assert LEVELS.find_value(levels[0].mesh, "abd") is None


@pytest.mark.parametrize("content", [b"", b"not a zip", None])
def test_damaged_files_are_passed_over(cache: None, levels: tuple[MeshLevel, ...], content: bytes | None) -> None:
    path = LEVELS.keep_value(levels, "abc")
    path.write_bytes(path.read_bytes()[:200] if content is None else content)
    assert LEVELS.find_value(levels[0].mesh, "abc") is None
