"""Index lists of 16 bits: what is drawn does not depend on how it is cut into chunks."""

from collections.abc import Sequence

import numpy as np
import pytest

from depthwalk.bake.images import BakedObject
from depthwalk.cook import indexed_lods
from depthwalk.cook.index_chunks import WHOLE, chunk_runs, vertex_numbers
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.simplified_lods import build_simplified_lods
from depthwalk.gpu.device import Device
from depthwalk.render.image import read_pixels
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.scene import Scene
from depthwalk.types import Array, Ints, Rows
from shapes import ShapeLibrary, bake, scene_of, sphere
from stage import OnScreen

CHUNKS = np.array([[0, 0], [6, 10], [12, 20]])


@pytest.mark.parametrize(
    ("chunks", "run", "expected"),
    [
        (WHOLE, (3, 9), [(3, 9, 0)]),
        (CHUNKS, (3, 6), [(3, 3, 0), (6, 3, 10)]),
        (CHUNKS, (0, 18), [(0, 6, 0), (6, 6, 10), (12, 6, 20)]),
        (CHUNKS, (12, 6), [(12, 6, 20)]),
        (CHUNKS, (6, 0), []),
    ],
)
def test_runs_are_cut_at_chunks(chunks: Ints, run: tuple[int, int], expected: Sequence[tuple[int, int, int]]) -> None:
    assert chunk_runs(chunks, *run) == expected


def test_indices_count_from_the_vertex_of_their_chunk() -> None:
    indices = np.tile(np.arange(6, dtype=np.uint16), 3)
    np.testing.assert_array_equal(vertex_numbers(indices, CHUNKS, 3, 6), [3, 4, 5, 10, 11, 12])


def test_pictures_do_not_depend_on_chunks(gl_device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    baked = bake(sphere(0.6, 64, 32), resolution=132)
    whole = build_simplified_lods(baked)
    monkeypatch.setattr(indexed_lods, "MOST_VERTICES", 600)
    cut = build_simplified_lods(baked)
    assert len(cut.chunks) > len(whole.chunks) == len(whole.error)
    np.testing.assert_array_equal(triangles_of(whole, 0), triangles_of(cut, 0))
    scene, camera = scene_of((0, (0, 0, 0), 0.0, 1.0)), Camera((0.4, 0.9, 2.0), (0, 0.6, 0), 0.7)
    pictures = [pictured(gl_device, scene, baked, camera)]
    monkeypatch.undo()
    pictures.append(pictured(gl_device, scene, baked, camera))
    assert (pictures[0][..., 3] > 0).sum() > 5000
    assert (np.abs(pictures[0] - pictures[1]).max(-1) > 2 / 255).mean() < 1e-3


def triangles_of(grids: LodGeometry, level: int) -> Rows:
    """Corners (t, 3), positions packed into numbers, in an order of their own."""
    packed = grids.vertices[grids.drawn(level), :3].astype(np.int64) @ np.array([1 << 32, 1 << 16, 1])
    rows = np.sort(packed, axis=1)
    return rows[np.lexsort(rows.T)]


def pictured(device: Device, scene: Scene, baked: BakedObject, camera: Camera) -> Array:
    with OnScreen(device, scene, ShapeLibrary([None], [baked], kept=False), (320, 240)) as stage:
        stage.draw(View(camera, (320, 240)), transparent=True)
        return read_pixels(stage.screen).astype(float) / 255
