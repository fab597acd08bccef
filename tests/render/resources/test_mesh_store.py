"""Meshes come when they are wanted and go, with all their GL objects, when others need the room."""

import time
from collections.abc import Callable, Iterator, Sequence
from typing import cast

import numpy as np
import pytest

from depthwalk.cook.cluster_builder import build_clusters
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.render.resources.library import Library
from depthwalk.render.resources.mesh_store import MeshStore
from shapes import box, sphere


class Meshes:
    """Two meshes, one that cannot be read, and one asset without."""

    def __init__(self) -> None:
        self.held = [box(1, 1, 1), sphere(columns=8, rows=4)]
        self.forgotten: list[int] = []
        self.previews: dict[int, Mesh] = {}

    def preview(self, asset: int) -> Mesh | None:
        return self.previews.get(asset)

    def forget_preview(self, asset: int) -> None:
        self.previews.pop(asset, None)

    def drawn_mesh(self, asset: int) -> Mesh | None:
        return self.previews.get(asset) or self.mesh(asset)

    def mesh(self, asset: int) -> Mesh | None:
        if asset == 2:
            raise InputError("bad.ply: broken")
        return self.held[asset] if asset < 2 else None

    def mesh_levels(self, asset: int) -> tuple[MeshLevel, MeshLevel]:
        return MeshLevel(self.held[asset], 0.0), MeshLevel(sphere(columns=6, rows=3), 0.1)

    def mesh_clusters(self, asset: int) -> MeshClusters | None:
        return build_clusters(self.held[asset]) if asset < 2 else None

    def forget_mesh(self, asset: int) -> None:
        self.forgotten.append(asset)


@pytest.fixture
def store(gl_device: Device) -> Iterator[MeshStore]:
    scope = gl_device.scope("test")
    store = MeshStore(scope, cast(Library, Meshes()))
    yield store
    scope.release()
    store.forget()


def test_each_level_is_uploaded_once_and_shares_its_look(store: MeshStore) -> None:
    first, coarse = store.object(1), store.object(1, 1)
    assert store.object(1) is first and store.object(1, 1) is coarse
    assert coarse.look is first.look and coarse.indices.size < first.indices.size
    with pytest.raises(LookupError, match="asset 3 has no mesh"):
        store.object(3)


def test_fallbacks_go_with_their_objects_two_frames_after_they_were_wanted(store: MeshStore, gl_device: Device) -> None:
    store.begin_frame()
    before = dict(+gl_device.live)
    assert set(store.mesh_fallbacks([0, 1], wait=True)) == {0, 1}
    store.object(0)
    assert store.fallback_bytes == store.object(0).vertices.size + store.object(0).indices.size
    for _ in range(2):
        assert not store.unwanted_fallbacks
        store.begin_frame()
    assert store.unwanted_fallbacks == {0, 1}
    store.release_fallbacks({0, 1})
    assert dict(+gl_device.live) == before and store.fallback_bytes == 0
    assert sorted(cast(Meshes, store._library).forgotten) == [0, 1]


def test_meshes_that_the_scene_shows_are_no_fallbacks(store: MeshStore) -> None:
    store.object(0)
    store.begin_frame()
    store.begin_frame()
    assert not store.unwanted_fallbacks and store.fallback_bytes == 0


def read_meanwhile(store: MeshStore, assets: Sequence[int]) -> dict[int, tuple[MeshLevel, ...]]:
    """What has been read after some seconds at most."""
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        found = store.mesh_fallbacks(assets, wait=False)
        if set(found) >= {0, 1}:
            break
        time.sleep(0.01)
    return found


def test_frames_that_may_not_wait_have_meshes_read_meanwhile(
    store: MeshStore, caplog: pytest.LogCaptureFixture
) -> None:
    assert set(read_meanwhile(store, [2, 0, 1])) == {0, 1}
    assert "bad.ply: broken" in caplog.text
    with pytest.raises(InputError, match="broken"):
        MeshStore(store._gl, store._library).mesh_fallbacks([2], wait=True)


def test_clusters_are_read_meanwhile_and_go_with_their_mesh(store: MeshStore, gl_device: Device) -> None:
    before = dict(+gl_device.live)
    assert not store.reader.is_read(1, simplified=True, clustered=True)
    deadline = time.monotonic() + 10
    while not store.reader.poll() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert store.reader.is_read(1, simplified=True, clustered=True) and not store.reader.is_reading
    drawn = store.clusters(1)
    assert store.clusters(1) is drawn and drawn.look is store.object(1).look
    store.release_fallbacks({1})
    assert dict(+gl_device.live) == before
    assert not store.reader.is_read(1, clustered=True)


def test_an_asset_without_mesh_has_no_clusters(store: MeshStore) -> None:
    with pytest.raises(LookupError, match="asset 3 has no mesh"):
        store.clusters(3)


def test_indices_stand_for_objects_and_vertices(store: MeshStore) -> None:
    drawn = store.clusters(0)
    clusters, vertices = drawn.clusters, len(drawn.clusters.positions)
    chosen = np.array([0, len(clusters) - 1, 0])
    indices = drawn.indices(np.array([5, 0, drawn.most_objects - 1]), chosen)
    objects, vertex = np.divmod(indices.astype(np.int64), vertices)
    counts = np.diff(clusters.first)[chosen]
    assert objects[:, 0].tolist() == np.repeat([5, 0, drawn.most_objects - 1], counts).tolist()
    np.testing.assert_array_equal(vertex[: counts[0]], clusters.faces[: counts[0]])
    assert indices.max() < 1 << 31 and (objects == objects[:, :1]).all()


def test_a_preview_is_drawn_until_somebody_needs_the_whole_mesh(store: MeshStore, gl_device: Device) -> None:
    """Simplified levels and clusters need it, as do viewers near by; then what the GPU holds is replaced."""
    library, reader = cast(Meshes, store._library), store.reader
    library.previews[1] = sphere(columns=4, rows=2)
    assert not reader.is_read(1)
    until(reader.poll)
    assert reader.is_read(1) and reader.meshes[1].is_preview and not reader.is_reading
    coarse = store.object(1)
    assert coarse.parts[0].face_count == len(library.previews[1].faces) < len(library.held[1].faces)
    assert store.mesh_fallbacks([1], wait=False) == {} and not reader.take_replaced()
    for need in ("simplified", "clustered", "whole"):
        assert not reader.is_read(1, **{need: True})
    until(lambda: reader.poll() and reader.is_read(1, simplified=True, clustered=True, whole=True))
    assert 1 not in library.previews
    assert reader.take_replaced() == {1} and not reader.take_replaced()
    live = dict(+gl_device.live)
    store.free({1})
    assert store.object(1).parts[0].face_count == len(library.held[1].faces) and dict(+gl_device.live) == live
    assert set(store.mesh_fallbacks([1], wait=False)) == {1}


def test_a_preview_that_nobody_asked_for_is_not_drawn(store: MeshStore) -> None:
    """The library reads it ahead, for objects shown by depth images; others of the same asset are drawn as meshes."""
    library, reader = cast(Meshes, store._library), store.reader
    library.previews[1] = sphere(columns=4, rows=2)
    assert not reader.is_read(1, whole=True)
    until(reader.poll)
    assert reader.is_read(1, whole=True) and not reader.take_replaced()
    assert store.object(1).parts[0].face_count == len(library.held[1].faces)


def until(done: Callable[[], bool]) -> None:
    end = time.monotonic() + 20
    while not done():
        assert time.monotonic() < end
        time.sleep(0.002)
