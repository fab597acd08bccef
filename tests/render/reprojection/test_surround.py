"""What earlier pictures saw beside the last one: the shaders against their twins, and against what is truly there."""

import math
from collections.abc import Iterator
from typing import Any

import moderngl
import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.reference.surround import captured, places_around
from depthwalk.render.frame_memory import SURROUNDING
from depthwalk.render.reprojection.reprojection import BEYOND, Reprojection
from depthwalk.render.reprojection.surround import SURROUND_SIZE, surround_views
from depthwalk.render.view.view import View, view_distance
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.environment import GroundParams, SkyParams
from shapes import ShapeLibrary, box, scene_of
from stage import OnScreen

SIZE = (160, 120)


def looking(degrees: float, aside: float = 0.0) -> Camera:
    angle = math.radians(degrees)
    return Camera((aside, 1.2, 0.0), (aside + math.sin(angle), 1.1, math.cos(angle)), 0.8)


class Turning(OnScreen):
    """Crates all around, of which pictures are kept."""

    def __init__(self, device: Device) -> None:
        library = ShapeLibrary([box(1.0, 1.0, 1.0, (0, 0.5, 0))], [None])
        around = [(5 * math.sin(angle), 0, 5 * math.cos(angle)) for angle in np.radians(range(0, 360, 30))]
        scene = scene_of(*[(0, place, 0.4, 1.0) for place in around], representation=Representation.MESH)
        scene.environment.ground, scene.environment.sky = GroundParams(), SkyParams()
        super().__init__(device, scene, library, SIZE)
        self.reprojection = Reprojection(device)

    def __exit__(self, *_: object) -> None:
        self.reprojection.release()
        super().__exit__()

    def take(self, camera: Camera) -> View:
        self.renderer.render(View(camera, SIZE), self.reprojection.canvas(SIZE))
        assert self.renderer.targets is not None and self.renderer.view is not None
        self.reprojection.take(self.renderer.targets, self.renderer.view)
        return self.renderer.view

    def distances(self) -> NDArray[np.float64]:
        assert self.renderer.targets is not None and self.renderer.view is not None
        depth = np.frombuffer(self.renderer.targets.depth.read(alignment=1), np.float32).reshape(SIZE[::-1])
        found = view_distance(depth, *self.renderer.view.depth_range)
        return np.where(np.isinf(found), BEYOND, found)

    def shown(self, camera: Camera) -> NDArray[np.int64]:
        self.reprojection.show(View(camera, SIZE), self.screen)
        return self.pixels()


@pytest.fixture
def turning(gl_device: Device) -> Iterator[Turning]:
    with Turning(gl_device) as stage:
        yield stage


def read(texture: moderngl.Texture, dtype: type) -> NDArray[Any]:
    return np.frombuffer(texture.read(), dtype).reshape(SURROUND_SIZE, SURROUND_SIZE, 4)


def test_a_picture_is_kept_as_its_twin_says(turning: Turning) -> None:
    view = turning.take(looking(20))
    column, row = np.random.default_rng(2).integers(0, SURROUND_SIZE, (2, 20_000))
    expected = captured(view, turning.distances(), (np.stack([column, row], -1) + 0.5) / SURROUND_SIZE)[:, 3]
    found = read(turning.reprojection.surround.surfaces, np.float32)[row, column]
    assert ((found[:, 3] > 0) == (expected > 0)).mean() > 0.999 and (found[:, :3] == 0).all()
    assert (found[expected > 0, 3] > 0).mean() > 0.998  # up to the edges, or who turns sees a seam of something older
    off = np.abs(found[:, 3] / np.maximum(expected, 1) - 1)[expected > 0]
    assert len(off) > 500 and np.median(off) < 1e-4 and (off > 0.01).mean() < 0.02  # other texels, along edges
    colours = read(turning.reprojection.surround.colours, np.uint8)[row, column]
    assert (colours[:, 3] == 255 * (found[:, 3] > 0)).all()


def test_what_is_looked_up_is_what_the_twin_finds(turning: Turning) -> None:
    """In a map whose colours tell places, by who has turned away from all that the last picture shows."""
    turning.take(looking(90))
    turning.take(looking(0))
    surround = turning.reprojection.surround
    at = (np.arange(SURROUND_SIZE) + 0.5) / SURROUND_SIZE
    texels = np.full((SURROUND_SIZE, SURROUND_SIZE, 4), 255, np.uint8)
    texels[..., 0], texels[..., 1] = (at * 255).round(), (at * 255).round()[:, None]
    surround.colours.write(texels)
    camera = looking(90, aside=0.3)
    shown = turning.shown(camera)[..., :2] / 255
    x, y = np.meshgrid((np.arange(160) + 0.5) / 160 * 2 - 1, (np.arange(120) + 0.5) / 120 * 2 - 1)
    rays = np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3) @ View(camera, SIZE).ray_from_screen.T
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    viewer = View(camera, SIZE).position - looking(90).position  # from the map's origin: of the first picture
    expected, known = places_around(read(surround.surfaces, np.float32), viewer, rays)
    off = np.abs(shown.reshape(-1, 2) - expected).max(1)[known]
    assert known.mean() > 0.8 and np.median(off) < 0.004 and (off > 0.01).mean() < 0.02


def test_who_turns_back_sees_what_was_there(turning: Turning) -> None:
    cameras = looking(45), looking(45, aside=0.2)
    true = [turning.true(camera) for camera in cameras]
    off = []
    for before in (180, 60):  # something else was seen; just that
        turning.take(looking(before))
        turning.take(looking(0))
        off.append([np.abs(turning.shown(camera) - there).mean() for camera, there in zip(cameras, true, strict=True)])
    assert (np.array(off[1]) < np.array(off[0]) / 2).all()
    assert turning.reprojection.unseen(View(looking(45), SIZE)) < 0.05


def test_what_was_seen_from_far_away_or_before_a_change_is_unknown(turning: Turning) -> None:
    turning.take(looking(90))
    turning.take(looking(0))
    view, away = View(looking(90), SIZE), View(looking(90, aside=5.0), SIZE)
    assert turning.reprojection.unseen(view) < 0.02  # the edges are known to some degrees only
    assert turning.reprojection.unseen(away) > 0.9
    assert turning.reprojection.unseen(View(looking(180), SIZE)) > 0.4
    turning.reprojection.surround.forget()
    assert turning.reprojection.unseen(view) > 0.9 and turning.reprojection.unseen(View(looking(0), SIZE)) == 0


def test_the_sides_show_every_direction_once_and_frames_do_not_notice(turning: Turning) -> None:
    turning.renderer.remembers = True
    turning.take(looking(0))
    before, plan = turning.true(looking(0)), turning.renderer.plan
    for side in surround_views(np.array([0.0, 1.2, 0.0])):
        steps = turning.renderer.auxiliary_steps(SURROUNDING, side, turning.reprojection.surround.canvas())
        next(steps)
        del steps  # given up
        for _ in turning.renderer.auxiliary_steps(SURROUNDING, side, turning.reprojection.surround.canvas()):
            pass
        assert turning.renderer.auxiliary_view is not None and turning.renderer.targets is not None
        turning.reprojection.surround.keep_canvas(turning.renderer.targets, turning.renderer.auxiliary_view)
    assert turning.renderer.plan is plan
    assert (read(turning.reprojection.surround.surfaces, np.float32)[..., 3] > 0).all()
    for degrees in (100, 180, 250):
        off = np.abs(turning.shown(looking(degrees)) - turning.true(looking(degrees)))
        assert np.median(off) <= 4 and off.mean() < 12  # of so few pixels, blurred along edges
    assert (turning.true(looking(0)) == before).all()


def test_without_a_side_there_is_nothing_to_keep(turning: Turning) -> None:
    view = turning.take(looking(0))
    assert turning.renderer.targets is not None
    with pytest.raises(ValueError, match="nothing was drawn"):
        turning.reprojection.surround.keep_canvas(turning.renderer.targets, view)
