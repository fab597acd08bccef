"""Mesh clusters in the cache: found again as they were, and made again where the file is damaged."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from depthwalk.assets.library import SceneLibrary
from depthwalk.cook.cluster_builder import build_clusters
from depthwalk.cook.cluster_file import CLUSTERS
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.scene.loader import load_scene
from shapes import box, mesh_of, sphere

MESH = sphere(1.0, 16, 8)
KEY = 64 * "a"


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture(scope="module")
def clusters() -> MeshClusters:
    return build_clusters(MESH)


def assert_same(one: MeshClusters, other: MeshClusters) -> None:
    for name in (field.name for field in fields(MeshClusters)):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_clusters_are_found_as_they_were(clusters: MeshClusters) -> None:
    assert CLUSTERS.find_value(MESH, KEY) is None
    CLUSTERS.keep_value(clusters, KEY)
    found = CLUSTERS.find_value(MESH, KEY)
    assert found is not None
    assert_same(found, clusters)


def test_a_mesh_without_triangles_has_none() -> None:
    empty = mesh_of(np.zeros((0, 3)), np.zeros((0, 3), int), np.zeros((0, 3)))
    CLUSTERS.keep_value(build_clusters(empty), KEY)
    found = CLUSTERS.find_value(empty, KEY)
    assert found is not None and len(found) == 0


@pytest.mark.parametrize("place", [0.1, 0.5, 0.9])
def test_a_damaged_file_is_removed(clusters: MeshClusters, place: float, caplog: pytest.LogCaptureFixture) -> None:
    file = CLUSTERS.keep_value(clusters, KEY)
    data = bytearray(file.read_bytes())
    data[int(place * len(data))] ^= 0xFF
    file.write_bytes(data)
    if CLUSTERS.find_value(MESH, KEY) is None:  # a byte of an archive's own headers may not matter
        assert not CLUSTERS.file(KEY).exists() and "damaged mesh clusters" in caplog.text


BAD = {
    "a vertex that does not exist": {"faces": lambda c: c.faces + np.uint32(len(c.positions))},
    "a group that does not exist": {"group": lambda c: c.group + len(c.error)},
    "clusters too large": {"first": lambda c: c.first * 2},
    "levels": {"level_first": lambda c: c.level_first[:-1]},
    "no number": {"error": lambda c: c.error * np.nan},
    "another type": {"centre": lambda c: c.centre.astype(int)},
    "falling errors": {"error": lambda c: c.error[::-1].copy()},
    "out of order": {"made_by": lambda c: c.made_by[::-1].copy()},
}


@pytest.mark.parametrize("change", BAD.values(), ids=BAD)
def test_what_cannot_be_drawn_is_not_used(clusters: MeshClusters, change: dict[str, object]) -> None:
    CLUSTERS.keep_value(replace(clusters, **{name: make(clusters) for name, make in change.items()}), KEY)  # type: ignore[operator]
    assert CLUSTERS.find_value(MESH, KEY) is None and not CLUSTERS.file(KEY).exists()


def test_the_library_builds_them_once(tiny_scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.cook.cluster_builder.build_clusters", lambda mesh: build_clusters(box(1, 1, 1)))
    assets, stages = load_scene(tiny_scene).assets, []
    made = SceneLibrary(assets, lambda name, stage: stages.append(stage)).mesh_clusters(0)
    found = SceneLibrary(assets, lambda name, stage: stages.append(stage)).mesh_clusters(0)
    assert stages == ["reading", "dividing into clusters", "reading"]
    assert made is not None and found is not None
    assert_same(made, found)


def test_a_full_disk_costs_nothing_but_time(
    tiny_scene: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(*arguments: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr("depthwalk.cook.cluster_builder.build_clusters", lambda mesh: build_clusters(box(1, 1, 1)))
    monkeypatch.setattr("depthwalk.cache.write_arrays", full)
    assert SceneLibrary(load_scene(tiny_scene).assets).mesh_clusters(0) is not None
    assert "cannot store the mesh clusters of ball in the cache: no space left" in caplog.text
