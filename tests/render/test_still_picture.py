"""The picture of a viewer who stands still: its quarters fit, it is finer, and later frames know nothing of it."""

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.colour import linear_from_srgb8, srgb8_from_linear
from depthwalk.gpu.device import Device
from depthwalk.quality.metrics import flip_map
from depthwalk.render.still_picture import StillPicture, quarters
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import GroundParams, SkyParams
from shapes import ShapeLibrary, bake, box, scene_of, sphere
from stage import OnScreen

SIZE = (161, 120)
HERE = Camera((0.0, 1.2, 4.0), (0.2, 0.6, 0.0), 0.8)


class Standing(OnScreen):
    """A crate and a ball on the ground, in sunlight."""

    def __init__(self, device: Device, size: tuple[int, int] = SIZE) -> None:
        shapes = [box(1.0, 1.0, 1.0, (0, 0.5, 0)), sphere(0.5, 64, 32)]
        scene = scene_of((0, (-0.6, 0, 0), 0.4, 1.0), (1, (0.9, 0.5, 1.2), 0.0, 1.0))
        scene.environment.ground, scene.environment.sky = GroundParams(half_size=500.0), SkyParams()
        scene.render.shadows.enabled = True
        super().__init__(device, scene, ShapeLibrary(shapes, [bake(shape) for shape in shapes]), size)
        self.size = size
        self.renderer.remembers = True
        self.still = StillPicture(device)

    def __exit__(self, *_: object) -> None:
        self.still.release()
        super().__exit__()

    def picture(self) -> NDArray[np.uint8]:
        shape = *self.size[::-1], 3
        return np.frombuffer(self.screen.read(components=3, alignment=1), np.uint8).reshape(shape)

    def whole(self, camera: Camera = HERE) -> NDArray[np.uint8]:
        self.draw(View(camera, self.size))
        return self.picture()

    def refined(self) -> NDArray[np.uint8]:
        for _ in self.still.steps(self.renderer, View(HERE, self.size)):
            pass
        self.still.show(self.screen)
        return self.picture()


@pytest.fixture
def standing(gl_device: Device) -> Iterator[Standing]:
    with Standing(gl_device) as stage:
        yield stage


def test_the_rays_of_the_quarters_are_those_of_the_picture() -> None:
    view = View(Camera((1.0, 2.0, 3.0), (0.0, 1.5, 0.0), 0.9), SIZE)
    seen = 0
    for quarter, (left, below) in quarters(view):
        pixels = np.stack(np.meshgrid([0.5, 10.5, 40.5], [0.5, 20.5, 59.5]), -1).reshape(-1, 2)
        of_quarter = np.column_stack([2 * pixels / quarter.size - 1, np.ones(9)]) @ quarter.ray_from_screen.T
        at = pixels + np.array([left, below])
        of_picture = np.column_stack([2 * at / SIZE - 1, np.ones(9)]) @ view.ray_from_screen.T
        assert of_quarter == pytest.approx(of_picture)
        seen += quarter.size[0] * quarter.size[1]
    assert seen == 162 * 120  # a column more than the picture has


def test_it_is_nearer_to_the_truth(gl_device: Device, standing: Standing) -> None:
    standing.renderer.settings.fused = False  # light is rounded to halves in all three
    standing.renderer.settings.output.dither = False  # the truth has no noise
    whole, refined = standing.whole().copy(), standing.refined().copy()
    with Standing(gl_device, (4 * SIZE[0], 4 * SIZE[1])) as larger:
        larger.renderer.settings.fused = False
        larger.renderer.settings.output.dither = False
        true = linear_from_srgb8(larger.whole())
    truth = srgb8_from_linear(true.reshape(SIZE[1], 4, SIZE[0], 4, 3).mean((1, 3)))
    assert flip_map(truth, refined).mean() < 0.6 * flip_map(truth, whole).mean()


def test_later_frames_know_nothing_of_it(standing: Standing) -> None:
    standing.whole()
    before = standing.whole().copy()
    standing.refined()
    after = standing.whole()
    assert standing.renderer.plan is not None and standing.renderer.plan.counts["warped"] == 0
    assert standing.renderer.plan.counts["shadow_maps"] == 0
    assert np.array_equal(before, after)


def test_it_may_be_given_up_after_any_step(standing: Standing) -> None:
    before = standing.whole().copy()
    steps = sum(1 for _ in standing.still.steps(standing.renderer, View(HERE, SIZE)))
    assert steps > 12
    for taken in range(0, steps, 5):
        begun = standing.still.steps(standing.renderer, View(HERE, SIZE))
        for _ in range(taken):
            next(begun)
        del begun
        assert np.abs(standing.whole().astype(int) - before).max() <= 1


def test_without_a_picture_nothing_is_shown(standing: Standing) -> None:
    with pytest.raises(ValueError, match="no picture"):
        standing.still.show(standing.screen)


def test_everything_is_released(gl_device: Device) -> None:
    before = +gl_device.live
    with Standing(gl_device) as stage:
        stage.whole()
        stage.refined()
    assert +gl_device.live == before
