"""Far clusters: the picture that single objects give, with fewer tiles; reused until something moves."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.render import kernels
from depthwalk.render.image import read_pixels
from depthwalk.render.view.view import View
from depthwalk.render.world.far_clusters import MEMBERS
from depthwalk.scene.arrays import Camera
from depthwalk.types import Rows
from shapes import ShapeLibrary, box, scene_of, sphere
from stage import OnScreen

SIZE = 320, 240
CAMERA = Camera((4.0, 45.0, 95.0), (0.0, 0.0, 10.0), 0.7)


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([sphere(0.5, 24, 12), box(0.8, 1.6, 0.5, (0, 0.8, 0))], resolution=32)


def field(count: int = 40, seed: int = 0) -> list[tuple[int, list[float], float, float]]:
    """Balls and boxes of many sizes, strewn over a square, turned about."""
    rng = np.random.default_rng(seed)
    x, z = np.meshgrid(*[(np.arange(count) - count / 2) * 1.6] * 2)
    places = np.stack([x.ravel(), 0 * x.ravel(), z.ravel()], 1) + rng.uniform(-0.5, 0.5, (count**2, 3)) * (1, 0, 1)
    kinds, turns, scales = rng.integers(0, 2, count**2), rng.uniform(0, 6, count**2), rng.uniform(0.6, 1.4, count**2)
    return list(zip(kinds.tolist(), places.tolist(), turns.tolist(), scales.tolist(), strict=True))


class Stage(OnScreen):
    """Of objects that are in clusters where they are small."""

    def __init__(
        self,
        device: Device,
        library: ShapeLibrary,
        places: Sequence[tuple[int, Sequence[float], float, float]],
        remembers: bool = False,
        **warp: Any,
    ) -> None:
        self.scene = scene_of(*places)
        self.scene.render.warp.cluster_pixels = 24
        for name, value in warp.items():
            setattr(self.scene.render.warp, name, value)
        super().__init__(device, self.scene, library, SIZE)
        self.renderer.remembers = remembers

    def picture(self, camera: Camera = CAMERA) -> Rows:
        self.draw(View(camera, SIZE), transparent=True)
        return read_pixels(self.screen).astype(int)


def test_the_picture_is_that_of_single_objects(gl_device: Device, library: ShapeLibrary) -> None:
    with Stage(gl_device, library, field()) as stage:
        together, counts = stage.picture(), dict(stage.counts)
        stage.scene.render.warp.cluster_pixels = 0
        single, plain = stage.picture(), stage.counts
    assert plain["clusters"] == 0 and 0 < counts["clusters"] <= counts["dpci"] / 8
    assert abs(counts["dpci"] - plain["dpci"]) <= 0.2 * plain["dpci"]  # of clusters in sight, all are drawn
    assert (single[..., 3] > 0).mean() > 0.1
    differ = np.abs(together - single).max(-1)
    assert (differ > 0).mean() < 0.01  # tiles lie elsewhere in the atlas, so edges are rounded otherwise
    assert (differ > 64).mean() < 0.002


def test_compiled_loops_draw_the_same(gl_device: Device, library: ShapeLibrary) -> None:
    pytest.importorskip("numba")
    with Stage(gl_device, library, field()) as stage:
        by_numpy = stage.picture()
        assert stage.counts["clusters"] > 0 and kernels.load()
        np.testing.assert_allclose(stage.picture(), by_numpy, atol=3)
    with Stage(gl_device, library, field(), remembers=True) as walking:
        walking.picture()
        walking.picture()
        assert walking.counts["warped"] == 0 and walking.counts["clusters"] > 0


def test_near_objects_are_drawn_one_by_one(gl_device: Device, library: ShapeLibrary) -> None:
    with Stage(gl_device, library, field()) as stage:
        stage.picture(Camera((0.0, 20.0, 75.0), (0.0, 0.0, 0.0), 0.7))
        assert stage.counts["dpci"] > stage.counts["clusters"] > 0
        assert stage.renderer.plan is not None
        numbers = stage.renderer.plan.object_rows
        assert len(np.unique(numbers)) == len(numbers)


def test_clusters_are_kept_while_somebody_walks(gl_device: Device, library: ShapeLibrary) -> None:
    with Stage(gl_device, library, field(), remembers=True) as walking, Stage(gl_device, library, field()) as fresh:
        cameras = [Camera((4.0 + 0.02 * k, 45.0, 95.0), (0.0, 0.0, 10.0), 0.7) for k in range(4)]
        walking.picture(cameras[0])
        assert walking.counts["warped"] == walking.counts["dpci"]
        for camera in cameras[1:]:
            walked = walking.picture(camera)
        assert walking.counts["warped"] == 0 and walking.counts["clusters"] > 0
        truth = fresh.picture(camera)
    # Resampled, what is a few pixels large is its own neighbour's colour at edges; elsewhere it is the same.
    assert (np.abs(walked - truth).max(-1) > 64).mean() < 0.05
    np.testing.assert_allclose(walked.mean((0, 1)), truth.mean((0, 1)), rtol=0.02)


def test_what_moves_is_warped_anew(gl_device: Device, library: ShapeLibrary) -> None:
    """One object jumps up, out of its cluster's box."""
    with Stage(gl_device, library, field(), remembers=True) as stage:
        stage.picture()
        before = stage.picture()
        assert stage.counts["warped"] == 0
        stage.scene.objects.position[700] += (0, 6, 0)
        stage.renderer.world.moved(slice(700, 701))
        after = stage.picture()
        assert 0 < stage.counts["warped"] <= 4 * MEMBERS  # those of its cell
        assert (before != after).any(-1).sum() > 10
        stage.picture()
        assert stage.counts["warped"] == 0
        stage.renderer.remembers = False
        assert (np.abs(stage.picture() - after).max(-1) > 64).mean() < 0.01


@pytest.mark.parametrize("width", [2.0, 40.0])
def test_hidden_clusters_are_left_out(gl_device: Device, library: ShapeLibrary, width: float) -> None:
    """Few behind a post, most behind a wide wall."""
    wall = [(1, [0.0, 0.0, 70.0], 0.0, width)]
    with Stage(gl_device, library, wall + field()) as stage:
        camera = Camera((0.0, 18.0, 130.0), (0.0, 2.0, 0.0), 0.7)
        culled, clusters = stage.picture(camera), stage.counts["clusters"]
        assert (stage.counts["occluded"] > 1000) == (width == 40.0)
        stage.scene.render.culling.occlusion = False
        assert (np.abs(stage.picture(camera) - culled).max(-1) > 64).mean() < 0.002
        assert 0 < clusters <= stage.counts["clusters"]
        assert (clusters < 0.6 * stage.counts["clusters"]) == (width == 40.0)


@pytest.mark.parametrize("setting", [("lod", "mode", "paper"), ("warp", "order", "epipole"), ("lod", "freeze", True)])
def test_some_settings_need_objects(
    gl_device: Device, library: ShapeLibrary, setting: tuple[str, str, str | bool]
) -> None:
    with Stage(gl_device, library, field(8)) as stage:
        stage.picture()
        assert stage.counts["clusters"] > 0
        group, name, value = setting
        setattr(getattr(stage.scene.render, group), name, value)
        stage.picture()
        assert stage.counts["clusters"] == 0 and stage.counts["dpci"] == 64
