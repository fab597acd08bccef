"""`render.aa: msaa` takes the samples that the hardware says it does, in all that is drawn."""

from collections import Counter
from types import SimpleNamespace
from typing import Literal, cast

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.gpu.multisampling import sample_offsets
from depthwalk.render.antialiasing.modes import MULTISAMPLING, hardware_samples, sample_views
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.view import View, matrix_array
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from shapes import ShapeLibrary, box, scene_of
from studio import Studio

CAMERA = Camera((2, 2.3, 3.5), (0, 0.7, 0), 0.7)
SIZE = (160, 120)


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([box(1.4, 1.4, 1.4, (0, 0.7, 0))], resolution=64)


def crate(representation: Representation, **environment: dict[str, float]) -> Scene:
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=representation, **environment)
    scene.render.aa = "msaa"
    return scene


@pytest.fixture(scope="module")
def offsets(gl_device: Device) -> Array:
    if gl_device.max_samples < MULTISAMPLING:
        pytest.skip("no shaders per sample here")
    with gl_device.context:
        return sample_offsets(gl_device, MULTISAMPLING)


def pixels(view: View, points: Array) -> Array:
    """Where `points` (n, 3), world, are in the picture (n, 2), y upward."""
    clip = np.pad(points - view.position, ((0, 0), (0, 1)), constant_values=1) @ matrix_array(view.clip_from_eye).T
    return (clip[:, :2] / clip[:, 3:] + 1) / 2 * SIZE


@pytest.fixture(scope="module")
def inside(offsets: Array) -> Array:
    """Of each sample (H, W, samples), top row first, how many pixels it is within the crate's outline."""
    corners = np.stack(np.meshgrid([-0.7, 0.7], [0, 1.4], [-0.7, 0.7]), -1).reshape(-1, 3)
    hull = ConvexHull(pixels(View(CAMERA, SIZE, 0.1, 10), corners))
    column, row = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1])[::-1] + 0.5)
    at = np.stack([column, row], -1)[:, :, None] + offsets
    return -(at @ hull.equations[:, :2].T + hull.equations[:, 2]).max(-1)


def test_samples_lie_in_the_pixel_each_in_a_row_and_a_column_of_its_own(offsets: Array) -> None:
    assert offsets.shape == (MULTISAMPLING, 2) and np.abs(offsets).max() < 0.5
    for axis in offsets.T:
        assert len(set(axis)) == MULTISAMPLING


def test_views_of_samples_see_them_in_the_middle_of_pixels() -> None:
    rng = np.random.default_rng(2)
    points, offsets = rng.uniform(-1, 1, (50, 3)), rng.uniform(-0.5, 0.5, (3, 2))
    view = View(CAMERA, SIZE, 0.1, 10, shear=(0.01, -0.02))
    for seen, offset in zip(sample_views(view, offsets), offsets, strict=True):
        assert pixels(seen, points) == pytest.approx(pixels(view, points) - offset, abs=1e-9)


def test_a_mesh_covers_of_each_pixel_the_samples_within_its_outline(
    studio: Studio, library: ShapeLibrary, inside: Array
) -> None:
    alpha = studio.picture(crate(Representation.MESH), library, CAMERA, SIZE, transparent=True)[..., 3]
    certain = (np.abs(inside) > 0.01).all(-1)  # pixels, beyond the rasteriser's own rounding
    assert certain.mean() > 0.95
    assert alpha[certain] == pytest.approx((inside > 0).mean(-1)[certain], abs=1 / 255)
    assert len(np.unique(alpha)) == MULTISAMPLING + 1


@pytest.mark.parametrize("representation", [Representation.DPCI, Representation.DMESH])
def test_depth_images_are_drawn_for_each_sample(
    studio: Studio, library: ShapeLibrary, inside: Array, representation: Representation
) -> None:
    covered = (inside > 0).mean(-1)
    edge = (covered > 0) & (covered < 1)
    scene = crate(representation)
    errors = {}
    for aa in ("none", "msaa"):
        scene.render.aa = aa
        alpha = studio.picture(scene, library, CAMERA, SIZE, transparent=True)[..., 3]
        errors[aa] = np.abs(alpha - covered)[edge].mean()
    assert errors["msaa"] < 0.7 * errors["none"]


def test_the_distance_of_a_pixel_is_that_of_the_nearest_sample(library: ShapeLibrary, inside: Array) -> None:
    with HeadlessRenderer(crate(Representation.MESH), library, SIZE) as headless:
        headless.draw(View(CAMERA, SIZE), transparent=True)
        distance = headless.distances()
    touched = (inside > 0).any(-1)
    certain = (np.abs(inside) > 0.01).all(-1)
    assert (np.isfinite(distance) == touched)[certain].all()


@pytest.mark.parametrize("dof", ["gather", "accumulate"])
def test_a_lens_without_blur_changes_nothing(
    studio: Studio, library: ShapeLibrary, dof: Literal["gather", "accumulate"]
) -> None:
    scene = crate(Representation.DPCI, sky={}, ground={"height": 0.0})
    without = studio.picture(scene, library, CAMERA, SIZE)
    scene.render.dof.mode, scene.render.dof.samples = dof, 2
    scene.render.dof.f_number, scene.render.dof.focal_length = 64, 1
    assert np.abs(studio.picture(scene, library, CAMERA, SIZE) - without).max() < 0.02


def test_samples_come_and_go_with_the_setting(gl_device: Device, library: ShapeLibrary) -> None:
    """Each change of it leaves as many GL objects as the one before to the same value."""
    scope, scene = gl_device.scope("test"), crate(Representation.DPCI, sky={}, ground={"height": 0.0})
    screen = scope.framebuffer([scope.texture(SIZE, 4)])
    before = gl_device.live.copy()
    renderer = Renderer(gl_device, scene, library)
    live: dict[str, list[Counter[str]]] = {"none": [], "msaa": []}
    for aa in ("msaa", "none", "msaa", "none"):
        scene.render.aa = aa
        renderer.render(View(CAMERA, SIZE), screen)
        live[aa].append(gl_device.live.copy())
    renderer.release()
    assert +gl_device.live == +before
    scope.release()
    assert live["none"][0] == live["none"][1] and live["msaa"][1]["texture"] > live["none"][1]["texture"]
    assert live["msaa"][0]["texture"] == live["msaa"][1]["texture"]


def test_a_driver_with_fewer_samples_is_told_apart() -> None:
    settings = RenderSettings(aa="msaa")
    with pytest.raises(InputError, match=r"^render\.aa: msaa needs 4 samples .*; slow offers 1; choose ssaa"):
        hardware_samples(settings, cast(Device, SimpleNamespace(max_samples=1, renderer="slow")))
    settings.aa = "ssaa"
    assert hardware_samples(settings, cast(Device, SimpleNamespace(max_samples=1))) == 1
