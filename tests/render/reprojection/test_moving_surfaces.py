"""Objects that move by themselves in a finished picture: the shaders against their twin, and against the truth."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import moderngl
import numpy as np
import pytest

from depthwalk.assets.library import SceneLibrary
from depthwalk.gpu.device import Device
from depthwalk.reference.finished_picture import nearest_moving, velocities_in
from depthwalk.reference.reprojection import sources
from depthwalk.render.image import read_pixels
from depthwalk.render.renderer import Renderer
from depthwalk.render.reprojection.reprojection import BEYOND, Reprojection
from depthwalk.render.view.field_of_view import widened
from depthwalk.render.view.view import View, view_distance
from depthwalk.render.world.moving_objects import MovingObjects
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from depthwalk.types import Array
from files import write_ply
from shapes import box, sphere

SIZE = (160, 120)
SCENE = """
version: 1
assets: {ball: {mesh: ball.ply}, crate: {mesh: crate.ply}, wall: {mesh: wall.ply}}
objects:
  - {asset: wall, position: [0, 0, -2]}
  - asset: ball
    animation: {interpolation: linear, keyframes: [{time: 0, position: [-1, 0, 0]}, {time: 1, position: [1, 0.4, 0.5]}]}
  - group:
      position: [0.9, 0, 0.6]
      animation: {interpolation: linear, keyframes: [{time: 0}, {time: 2, yaw: 360}]}
      objects: [{asset: crate, position: [0.5, 0, 0]}]
environment: {ground: {}, sky: {}}
"""
THEN = Camera((0.0, 1.2, 4.0), (0.0, 0.6, 0.0), 0.8, 0.5)
NOW = replace(THEN, time=0.6)
ASIDE = Camera((0.12, 1.25, 3.9), (0.2, 0.6, 0.0), 0.8, 0.6)


class Stage(NamedTuple):
    """A finished picture of the moment of `THEN`, with what is known of it."""

    renderer: Renderer
    reprojection: Reprojection
    source: View
    distances: Array
    moving: MovingObjects

    def shown(self, camera: Camera) -> Array:
        return self._pixels(lambda view, screen: self.reprojection.show(view, screen), camera)

    def true(self, camera: Camera) -> Array:
        return self._pixels(lambda view, screen: self.renderer.render(view, screen), camera)

    def _pixels(self, draw: Callable[[View, moderngl.Framebuffer], None], camera: Camera) -> Array:
        """The picture (h, w, 3), lowest row first."""
        scope = self.renderer.device.scope("screen")
        screen = scope.framebuffer([scope.texture(SIZE, 4)])
        draw(View(camera, SIZE), screen)
        pixels = read_pixels(screen)[::-1, :, :3].astype(int)
        scope.release()
        return pixels


@pytest.fixture
def stage(gl_device: Device, tmp_path: Path) -> Iterator[Stage]:
    write_ply(tmp_path / "ball.ply", sphere(0.3, 48, 24))
    write_ply(tmp_path / "crate.ply", box(0.4, 0.8, 0.4, (0, 0.4, 0)))
    write_ply(tmp_path / "wall.ply", box(6.0, 2.0, 0.2, (0, 1, 0)))
    (tmp_path / "scene.yaml").write_text(SCENE)
    scene = load_scene(tmp_path / "scene.yaml")
    renderer, reprojection = Renderer(gl_device, scene, SceneLibrary(scene.assets)), Reprojection(gl_device)
    try:
        source = widened(View(THEN, SIZE), 0.1)
        renderer.render(source, reprojection.canvas(source.size))
        assert renderer.view is not None and renderer.targets is not None
        source = View(source.camera, source.size, *renderer.view.depth_range)
        depth = np.frombuffer(renderer.targets.depth.read(alignment=1), np.float32).reshape(source.size[::-1])
        metres = view_distance(depth, *source.depth_range)
        moving = renderer.world.moving(source)
        assert moving is not None
        reprojection.take(renderer.targets, source, moving)
        yield Stage(renderer, reprojection, source, np.where(np.isinf(metres), BEYOND, metres), moving)
    finally:
        reprojection.release()
        renderer.release()


def test_what_moves_is_a_rigid_body(stage: Stage) -> None:
    """The ball by 2, 0.4 and 0.5 m in a second; the crate by half a turn, its middle 0.5 m from the axis."""
    moving = stage.moving
    assert len(moving.velocity) == 2
    assert moving.velocity[0] == pytest.approx([2, 0.4, 0.5], abs=1e-3)
    assert moving.turn == pytest.approx(np.array([[0, 0, 0], [0, np.pi, 0]]), abs=1e-3)
    # After a quarter of a turn it is at −z of the axis, and goes on towards −x.
    assert moving.pivot[1] == pytest.approx([0.9, 0, 0.1], abs=1e-3)
    assert moving.velocity[1] == pytest.approx([-0.5 * np.pi, 0, 0], abs=0.03)
    assert moving.growth == pytest.approx([0, 0], abs=1e-3)


def test_velocities_are_those_of_the_twin(stage: Stage) -> None:
    assert stage.reprojection._shown is not None
    images = stage.reprojection._shown.moving
    assert images is not None
    found = np.frombuffer(images.velocities.texture.read(), np.float16).reshape(*stage.distances.shape, 4).astype(float)
    expected = velocities_in(stage.source, stage.distances, stage.moving)
    assert 0.02 < (expected[..., 3] > 0).mean() < 0.2
    assert (found[..., 3] == expected[..., 3]).mean() > 0.998  # single precision decides along edges
    both = (found[..., 3] > 0) & (expected[..., 3] > 0)
    np.testing.assert_allclose(found[both], expected[both], atol=0.01)
    cells = np.frombuffer(images.nearest.texture.read(), np.float32).reshape(*images.nearest.texture.size[::-1], 4)
    np.testing.assert_allclose(cells, nearest_moving(stage.distances, found), rtol=1e-3, atol=1e-3)


def test_the_shader_is_its_twin(stage: Stage) -> None:
    """Of a picture whose colours tell places, seen from elsewhere at another moment."""
    assert stage.reprojection._shown is not None
    texture = stage.reprojection._shown.drawn.colours.texture
    (width, height), rest = texture.size, np.zeros(texture.size[::-1])
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    texture.write((np.stack([x, y, rest, rest + 1], -1) * 255).round().astype(np.uint8).tobytes())
    velocities = velocities_in(stage.source, stage.distances, stage.moving)
    for camera in (NOW, ASIDE):
        shown = stage.shown(camera)[..., :2] / 255
        expected = sources(stage.source, stage.distances, View(camera, SIZE), velocities)
        off = np.abs(shown - expected).max(-1)
        assert np.median(off) < 0.003 and (off > 0.01).mean() < 0.012  # single precision decides along edges


@pytest.mark.parametrize(("camera", "part"), [(NOW, 0.35), (ASIDE, 0.5)])
def test_what_moves_is_shown_where_it_is_by_now(stage: Stage, camera: Camera, part: float) -> None:
    """Compared with the same picture whose objects stay. The side of the crate that turns into sight was never seen."""
    shown, stayed = stage.shown(camera), stage.shown(replace(camera, time=THEN.time))
    true = stage.true(camera)
    before, after = (np.abs(picture - true).max(-1) for picture in (stayed, shown))
    assert (before > 24).mean() > 0.03
    assert (after > 24).mean() < part * (before > 24).mean()


def test_the_moment_of_the_picture_shows_it_unchanged(stage: Stage) -> None:
    off = np.abs(stage.shown(THEN) - stage.true(THEN)).max(-1)
    assert (off > 1).mean() < 0.002


def test_the_floor_below_what_moves_stays(stage: Stage) -> None:
    """The lowest part of a cylinder is not the object's but what it stands on."""
    velocities = velocities_in(stage.source, stage.distances, stage.moving)
    row, column = np.argwhere(velocities[..., 3] > 0).T
    ray = np.dstack([((column + 0.5) / stage.source.size[0] * 2 - 1), ((row + 0.5) / stage.source.size[1] * 2 - 1)])[0]
    point = stage.source.position + stage.distances[row, column][:, None] * (
        np.column_stack([ray * stage.source.half_extent, np.ones(len(row))]) @ stage.source.axes
    )
    assert (point[:, 1] > 0.001).all()
