"""Depth of field: the shaders against their twins, both against many frames, and what must stay sharp."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

from depthwalk.colour import srgb_from_linear
from depthwalk.gpu.device import Device
from depthwalk.gpu.failures import GpuError
from depthwalk.quality.metrics import psnr
from depthwalk.reference.dof import gather
from depthwalk.reference.dof_paper import paper
from depthwalk.reference.dof_tiles import Reduced, ranges, reduced, tile_classes
from depthwalk.reference.tone import TONES
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.lens_gather import LensGather
from depthwalk.render.view.lens import (
    DISC,
    TILE,
    TileClass,
    circle_radius,
    gaussian,
    largest_radius,
    lens_points,
    lens_views,
)
from depthwalk.render.view.view import View, matrix_array
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from shapes import ShapeLibrary, box, scene_of, sphere

SIZE = (150, 100)
CAMERA = Camera((0, 1, 4), (0, 0.9, 0), 0.8)


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([sphere(0.5, 64, 32), box(0.4, 2, 0.4, (0, 1, 0), colour=(40, 160, 70))], [None, None])


def picket(**dof: Any) -> Scene:
    """A ball in focus, a post before it that covers its left part, and one far behind its right part."""
    scene = scene_of(
        (0, (0, 0.5, 0), 0.0, 1.0),
        (1, (-0.35, 0, 2), 0.4, 0.6),
        (1, (1.2, 0, -5), 0.4, 1.5),
        representation=Representation.MESH,
        sky={},
        ground={"height": 0.0, "half_size": 500.0},  # it ends between two rows of pixels
    )
    settings = {"mode": "gather", "focal_length": 400, "f_number": 1.4, "focus_distance": 3.6, "max_blur": 20.0} | dof
    cast(SimpleNamespace, scene).render = RenderSettings.model_validate({"dof": settings})
    return scene


class Drawn:
    """A frame: sRGB (H, W, 3), linear (H, W, 4), circles (H, W)."""

    def __init__(self, library: ShapeLibrary, scene: Scene | None = None, **dof: Any) -> None:
        scene = scene or picket(**dof)
        self.lens, view = scene.render.dof, View(CAMERA, SIZE)
        with HeadlessRenderer(scene, library, SIZE, Representation.MESH) as headless:
            headless.draw(view, linear=True)
            self.pixels, image = headless.pixels()[..., :3], headless.linear_image()
            assert headless.renderer.view is not None
            self.depth_range = np.array(headless.renderer.view.depth_range)
        self.linear, self.distance = image.colour, image.distance
        self.circles = circle_radius(self.lens, view, image.distance)
        self.limited = np.clip(self.circles, -largest_radius(self.lens, view), largest_radius(self.lens, view))
        self.extremes = np.abs(circle_radius(self.lens, view, self.depth_range))


@pytest.fixture(scope="module")
def sharp(library: ShapeLibrary, gl_device: Device) -> Drawn:
    return Drawn(library, mode="none")


@pytest.fixture(scope="module")
def truth(library: ShapeLibrary, gl_device: Device) -> Drawn:
    return Drawn(library, mode="accumulate", samples=128)


@pytest.fixture(scope="module")
def gathered(library: ShapeLibrary, gl_device: Device) -> Drawn:
    return Drawn(library)


def test_circles_are_the_papers() -> None:
    """Formulas (1) and (2) in full, with a sensor of the height that the angle of view asks for."""
    lens, view = picket(focal_length=80, f_number=2, focus_distance=4).render.dof, View(CAMERA, SIZE)
    f, diameter = 0.08, 0.04
    distance = np.array([0.7, 2.0, 4.0, 9.0, 1e9])
    image, sensor = f * distance / (distance - f), f * 4 / (4 - f)
    circle = np.abs(image - sensor) * diameter / image
    pixels = circle / (2 * sensor * np.tan(CAMERA.fov / 2) / SIZE[1])
    found = circle_radius(lens, view, distance)
    assert np.abs(found) == pytest.approx(pixels / 2, rel=1e-6)
    assert np.sign(found).tolist() == [-1, -1, 0, 1, 1]


def test_lens_points_are_spread_evenly_and_end_in_the_middle() -> None:
    points = lens_points(400)
    assert points[-1].tolist() == [0, 0] and np.hypot(*points.T).max() == pytest.approx(1)
    assert points.mean(0) == pytest.approx([0, 0], abs=0.01)
    assert (points.T @ points / len(points)) == pytest.approx(np.eye(2) / 4, abs=0.01)
    assert lens_points(1).tolist() == [[0, 0]]


def test_from_all_over_the_lens_points_appear_aside_by_their_circle() -> None:
    """The projections themselves: what is in focus stays, all else moves by its radius times the point of the lens."""
    lens, view = picket(mode="accumulate", samples=9).render.dof, View(CAMERA, SIZE, 0.1, 100)
    middle = view.position + np.array([[0.3, -0.2, 1.5], [-0.4, 0.5, lens.focus_distance], [2, 1, 20.0]]) @ view.axes
    distance = (middle - view.position) @ view.axes[2]

    def pixels(seen: View) -> Array:
        clip = np.column_stack([middle - seen.position, np.zeros(3)]) @ matrix_array(seen.clip_from_eye).T
        return clip[:, :2] / clip[:, 3:] / 2 * SIZE

    for seen, point in zip(lens_views(view, lens), lens_points(9), strict=True):
        moved = pixels(seen) - pixels(view)
        assert moved == pytest.approx(circle_radius(lens, view, distance)[:, None] * point, abs=1e-9)
        for target, ray in zip(middle, np.column_stack([pixels(seen) * 2 / SIZE, np.ones(3)]), strict=True):
            straight = seen.ray_from_screen @ ray * ((target - seen.position) @ seen.axes[2])
            assert straight == pytest.approx(target - seen.position, abs=1e-9)


def test_gather_matches_its_twin(sharp: Drawn, gathered: Drawn) -> None:
    circles, lit = gathered.limited[::-1], sharp.linear[::-1]
    expected = gather(lit, circles, gathered.lens.samples)[::-1]
    difference = np.abs(gathered.linear - expected).max(-1)
    assert np.abs(gathered.linear - sharp.linear).max(-1).mean() > 0.015
    assert difference.mean() < 5e-4 and np.quantile(difference, 0.99) < 3e-3


def test_gather_matches_its_twin_where_circles_are_wide(sharp: Drawn, library: ShapeLibrary, gl_device: Device) -> None:
    """In tiles of all classes; and nothing shows of what the reduced pictures held before."""
    scene = picket(max_blur=25.0, focus_distance=1.6)
    drawn, again = Drawn(library, scene), Drawn(library, scene)
    circles, lit = drawn.limited[::-1], sharp.linear[::-1]
    whole = Reduced(block=1, lit=lit, circles=circles, least=circles, greatest=circles)
    classes = set(tile_classes(reduced(reduced(whole)), TILE).flat)
    assert classes == set(TileClass) - {TileClass.SHARP}
    expected = gather(lit, circles, drawn.lens.samples)[::-1]
    difference = np.abs(drawn.linear - expected).max(-1)
    assert difference.mean() < 5e-4 and np.quantile(difference, 0.99) < 3e-3
    assert np.array_equal(drawn.linear, again.linear)


def test_what_output_makes_of_it_in_the_same_programs_matches_the_twin(
    sharp: Drawn, gathered: Drawn, library: ShapeLibrary, gl_device: Device
) -> None:
    """Where nobody keeps the light, it is never stored: tiles are drawn in the colours of the screen."""

    def shown(light: Array) -> Array:
        tone = TONES[scene.render.output.tone_mapping]
        mapped = tone(2.0**scene.render.output.exposure * light[..., :3].reshape(-1, 3)).reshape(*light.shape[:-1], 3)
        return np.concatenate([srgb_from_linear(mapped), light[..., 3:]], -1)

    scene = picket()
    with HeadlessRenderer(scene, library, SIZE, Representation.MESH) as headless:
        timers = headless.renderer.timers
        timers.time_next()
        while timers.of_frame < 0:  # a GPU's times are known some frames later
            headless.draw(View(CAMERA, SIZE))
        pixels = headless.pixels()[..., :3] / 255
        assert "dof + output" in timers.milliseconds
    expected = gather(sharp.linear[::-1], gathered.limited[::-1], gathered.lens.samples, passed_on=shown)[::-1, :, :3]
    difference = np.abs(pixels - expected).max(-1)
    assert difference.mean() < 3e-3 and np.quantile(difference, 0.99) < 8e-3


def test_paper_matches_its_twin(library: ShapeLibrary, sharp: Drawn) -> None:
    drawn = Drawn(library, mode="paper")
    most = min(drawn.extremes.max(), largest_radius(drawn.lens, View(CAMERA, SIZE)))  # formula (3), limited
    expected = paper(sharp.linear[::-1], drawn.limited[::-1], gaussian(), np.array(DISC), most)[::-1]
    difference = np.abs(drawn.linear - expected).max(-1)
    assert np.abs(drawn.linear - sharp.linear).max(-1).mean() > 0.015
    assert difference.mean() < 5e-4 and np.quantile(difference, 0.99) < 3e-3


def test_gather_comes_near_to_many_frames(sharp: Drawn, truth: Drawn, gathered: Drawn) -> None:
    everywhere = np.ones(SIZE[::-1], bool)
    assert psnr(truth.pixels, gathered.pixels, everywhere) > 34
    assert psnr(truth.pixels, sharp.pixels, everywhere) < 28


def test_what_is_in_focus_stays_as_it_is(library: ShapeLibrary, gl_device: Device) -> None:
    """Where nothing before it reaches, neither its inside nor its silhouette changes, whatever is behind."""
    drawn = {}
    for mode in ("none", "gather"):
        scene = picket(mode=mode)
        scene.objects.position[1] = (0, 0, -3)
        drawn[mode] = Drawn(library, scene)
    focused = np.abs(drawn["gather"].circles) < 0.5
    focused &= ranges(drawn["gather"].limited[::-1], TILE)[0, ::-1] > -0.5
    outline = focused & binary_dilation(drawn["none"].circles > 3)
    assert focused.sum() > 400 and outline.sum() > 30
    assert np.abs(drawn["gather"].pixels.astype(int) - drawn["none"].pixels)[focused].max() <= 1


def test_what_is_before_the_focus_spreads_over_what_is_sharp(sharp: Drawn, truth: Drawn, gathered: Drawn) -> None:
    """Beside the near post's silhouette its green lies on the ball, as much as in the mean of many frames."""
    beside = (np.abs(sharp.circles) < 0.5) & (np.abs(truth.linear - sharp.linear).max(-1) > 0.05)
    assert beside.sum() > 40
    assert gathered.linear[beside].mean(0) == pytest.approx(truth.linear[beside].mean(0), abs=0.02)


def horizon_blur(drawn: Drawn) -> float:
    """How far the colours of ground and sky run into each other, pixels: the deviation of where they change, at the
    picture's left edge, where nothing stands."""
    change = np.abs(np.diff(drawn.linear[:, :20, :3].mean((1, 2))))
    change[change < 0.1 * change.max()] = 0  # the sky's own fading
    rows = np.arange(len(change))
    middle = np.average(rows, weights=change)
    return np.sqrt(np.average((rows - middle) ** 2, weights=change))


@pytest.mark.parametrize("mode", ["paper", "gather", "accumulate"])
def test_blur_is_as_wide_whatever_the_samples_of_a_pixel(library: ShapeLibrary, gl_device: Device, mode: str) -> None:
    blur = {}
    for aa in ("none", "ssaa"):
        scene = picket(mode=mode)
        scene.render.aa = aa
        blur[aa] = horizon_blur(Drawn(library, scene))
    assert blur["none"] > 1.5
    assert blur["ssaa"] == pytest.approx(blur["none"], rel=0.1)


def test_accumulated_pictures_do_not_depend_on_tiles_that_are_kept(gl_device: Device) -> None:
    """The window keeps intermediate images from frame to frame; not from one point of the lens to the next."""
    scene = picket(mode="accumulate", samples=6)
    scene.objects.representation[:] = Representation.DPCI
    shapes = ShapeLibrary([sphere(0.5, 64, 32), box(0.4, 2, 0.4, (0, 1, 0))], resolution=64)
    drawn = []
    for remembers in (False, True):
        with HeadlessRenderer(scene, shapes, SIZE, Representation.DPCI) as headless:
            headless.renderer.remembers = remembers
            for aside in (0.0, 0.01):
                headless.draw(View(Camera((aside, 1, 4), (aside, 0.9, 0), 0.8), SIZE))
            drawn.append(headless.pixels().astype(int))
    assert np.abs(drawn[1] - drawn[0]).max() <= 1


def test_accumulated_pictures_keep_the_middles_distances(library: ShapeLibrary, sharp: Drawn, truth: Drawn) -> None:
    assert np.array_equal(truth.distance, sharp.distance)


def test_alpha_is_blurred_with_the_colours(library: ShapeLibrary, gl_device: Device) -> None:
    scene = picket(focus_distance=30)
    scene.environment.ground = None
    with HeadlessRenderer(scene, library, SIZE, Representation.MESH) as headless:
        headless.draw(View(CAMERA, SIZE), transparent=True, linear=True)
        colour = headless.linear_image().colour
    part = (colour[..., 3] > 0.2) & (colour[..., 3] < 0.8)
    assert part.sum() > 200 and (colour[part][:, :3].max(1) < colour[part][:, 3]).all()


def test_what_is_where_in_the_picture(library: ShapeLibrary, gl_device: Device) -> None:
    with HeadlessRenderer(picket(mode="none"), library, SIZE, Representation.MESH) as headless:
        with headless.device.context:
            assert headless.renderer.distance_at() == np.inf and headless.renderer.point_at(0.5, 0.5) is None
        view = View(CAMERA, SIZE)
        headless.draw(view, linear=True)
        for column, row in ((0, 0), (SIZE[0] // 2, SIZE[1] // 2), (SIZE[0] - 1, SIZE[1] - 1), (5, 3 * SIZE[1] // 4)):
            across, down = (column + 0.5) / SIZE[0], (row + 0.5) / SIZE[1]
            with headless.device.context:
                found, point = headless.renderer.distance_at(across, down), headless.renderer.point_at(across, down)
            expected = headless.linear_image().distance[row, column]
            assert found == pytest.approx(expected, rel=1e-6)
            assert (point is None) == np.isinf(expected)
            if point is not None:
                x, y, z = view.axes @ (point - view.position)
                assert z == pytest.approx(found)
                assert (x / z, y / z) == pytest.approx(view.half_extent * np.array([2 * across - 1, 1 - 2 * down]))
        with headless.device.context:
            assert 3 < headless.renderer.distance_at() < 4


def test_a_driver_without_large_points_is_named() -> None:
    """OpenGL promises points of one pixel only."""
    context = SimpleNamespace(info={"GL_POINT_SIZE_RANGE": (1.0, 8.0)})
    lens = LensGather(cast(Any, SimpleNamespace(device=SimpleNamespace(context=context))))
    with pytest.raises(GpuError, match="gather needs points 16 pixels wide; this driver allows 8"):
        lens.draw(cast(Any, SimpleNamespace(size=SIZE)), 16, {})
