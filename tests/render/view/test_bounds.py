"""Where objects are: visibility, near and far plane, the camera that sees everything."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyglm import glm

from depthwalk.gpu.device import Device
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.bounds import Bounds, depth_range, extents, ground_range
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.scene import Scene
from shapes import ShapeLibrary, scene_of, sphere
from studio import Studio

number = st.floats(-50, 50)


shears = st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))


@given(
    st.tuples(number, number, number),
    st.floats(0.01, 5),
    st.tuples(number, number, number),
    st.floats(0.2, 2.5),
    shears,
    st.integers(0, 2),
)
def test_a_sphere_that_shows_a_point_is_visible(
    centre: tuple[float, float, float],
    bounding_radius: float,
    eye: tuple[float, float, float],
    fov: float,
    shear: tuple[float, float],
    along: int,
) -> None:
    view = View(Camera(eye, (eye[0] + 1, eye[1] + 0.3, eye[2] - 1), fov), (160, 90), shear=shear)
    point = np.add(centre, bounding_radius * np.eye(3)[along])  # one point of the sphere
    right, up, forward = view.axes @ (point - view.position)
    tan_x, tan_y = view.half_extent
    shows = forward > 0 and abs(right) < tan_x * forward and abs(up) < tan_y * forward
    visible, _ = Bounds(np.array([centre]), np.array([bounding_radius])).visible(view)
    assert len(visible) == 1 or not shows


@given(st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(3, 9)), st.floats(0.1, 2), shears)
def test_the_extent_of_a_sphere_holds_its_points(
    centre: tuple[float, float, float], bounding_radius: float, shear: tuple[float, float]
) -> None:
    view = View(Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 1.0), (160, 90), 0.1, 50.0, shear)
    centre = (centre[0], centre[1], -centre[2])
    low, high = extents(view, Bounds(np.array([centre]), np.array([bounding_radius])))
    directions = np.random.default_rng(2).normal(size=(200, 3))
    points = centre + bounding_radius * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    right, up, forward = view.axes @ points.T
    at = np.clip(np.stack([right, up], -1) / forward[:, None] / view.half_extent, -1, 1)
    assert (at >= low - 1e-9).all() and (at <= high + 1e-9).all()


def test_the_nearest_ground_is_that_at_the_lower_edge() -> None:
    """From 1.6 m above, looking ahead: at 45° down; also in a picture of the lower half alone."""
    camera = Camera((0.0, 1.6, 0.0), (0.0, 1.6, -1.0), np.pi / 2)
    assert ground_range(View(camera, (100, 100)), 0.0, 50.0)[0] == pytest.approx(1.6)
    half = Camera(camera.position, camera.target, 2 * np.arctan(0.5))
    assert ground_range(View(half, (100, 100), shear=(0.0, 0.5)), 0.0, 50.0)[0] == pytest.approx(1.6)


@pytest.mark.parametrize(
    ("forward", "bounding_radius", "ground", "near", "far"),
    [
        ([10.0], [1.0], None, 0.99 * 9, 1.01 * 11),
        ([10.0, 2000.0], [1.0, 500.0], None, 0.99 * 9, 1.01 * 2500),
        ([0.5], [1.0], None, 1.01 * 1.5 / 2e3, 1.01 * 1.5),  # inside
        ([10.0], [1.0], (0.8, 700.0), 0.99 * 0.8, 1.01 * 700),
        ([0.02], [0.01], None, 0.99 * 0.01, 1.01 * 0.03),
    ],
)
def test_near_and_far_hold_what_is_seen(
    forward: Sequence[float], bounding_radius: Sequence[float], ground: None, near: float, far: float
) -> None:
    assert depth_range(np.array(forward), np.array(bounding_radius), ground) == pytest.approx((near, far))


def test_nothing_in_sight_still_has_a_range() -> None:
    near, far = depth_range(np.zeros(0), np.zeros(0), None)
    assert 0 < near < far


@pytest.mark.parametrize("scale", [0.004, 1.0, 1500.0])
@pytest.mark.parametrize("size", [(160, 120), (60, 240)])
def test_the_camera_that_frames_all_sees_all(
    gl_device: Device, studio: Studio, scale: float, size: tuple[int, int]
) -> None:
    """Two balls far apart, tiny or huge, in a wide or a narrow picture: both whole, with the same picture."""
    library = ShapeLibrary([sphere(columns=48, rows=24)], resolution=64)
    scene = scene_of((0, (-4 * scale, 0, 0), 0.0, scale), (0, (4 * scale, 0, 0), 0.0, scale))
    renderer = Renderer(gl_device, scene, library)
    camera = renderer.frame_all(size[0] / size[1], away=glm.dvec3(0, 0.25, 1))
    renderer.release()
    solid = studio.picture(scene, library, camera, size=size, transparent=True)[..., 3] > 0
    columns = np.flatnonzero(solid.any(0))
    assert columns[0] > 0 and columns[-1] < size[0] - 1
    left, right = solid[:, : size[0] // 2].sum(), solid[:, size[0] // 2 :].sum()
    assert left > 20 and abs(int(left) - int(right)) < 0.2 * left


def test_the_camera_that_frames_all_sees_all_while_it_turns(gl_device: Device, studio: Studio) -> None:
    """A ball beside the middle of another one: from the side it reaches farther out than from the front."""
    library, size = ShapeLibrary([sphere(columns=48, rows=24)], resolution=64), (90, 120)
    scene = scene_of((0, (0, 0, -3), 0.0, 1.0), (0, (0, 1, 3), 0.0, 0.5))
    renderer = Renderer(gl_device, scene, library)
    tight = renderer.frame_all(size[0] / size[1])
    camera = renderer.frame_all(size[0] / size[1], turns=True)
    renderer.release()
    assert not whole(studio, scene, library, turned(tight, 90), size)
    for degrees in (0, 45, 90, 200):
        assert whole(studio, scene, library, turned(camera, degrees), size)


def turned(camera: Camera, degrees: float) -> Camera:
    """The camera turned about its target, around the y axis."""
    angle = np.radians(degrees)
    x, y, z = np.subtract(camera.position, camera.target)
    away = np.cos(angle) * x + np.sin(angle) * z, y, np.cos(angle) * z - np.sin(angle) * x
    position = np.add(camera.target, away).tolist()
    return Camera((position[0], position[1], position[2]), camera.target, camera.fov)


def whole(studio: Studio, scene: Scene, library: ShapeLibrary, camera: Camera, size: tuple[int, int]) -> bool:
    """Whether nothing of the scene touches the border of the picture."""
    solid = studio.picture(scene, library, camera, size=size, transparent=True)[..., 3] > 0
    border = np.concatenate([solid[0], solid[-1], solid[:, 0], solid[:, -1]])
    return bool(solid.any() and not border.any())


@pytest.mark.parametrize("scale", [0.6, 0.75, 1.5])
def test_tiles_of_any_resolution_are_free_of_specks(studio: Studio, scale: float) -> None:
    """Where texels and pixels do not coincide, ties between texels must not pick an empty one."""
    library = ShapeLibrary([sphere(columns=48, rows=24)], resolution=64)
    places = [(0, (2.4 * (k % 5), 0, 2.4 * (k // 5)), 0.1 * k, 0.3 + 0.03 * k) for k in range(25)]
    scene = scene_of(*places)
    scene.render.warp.tile_scale = scale
    camera = Camera((5.0, 4.0, 16.0), (5.0, 0.5, 5.0), 0.7)
    coarse = studio.picture(scene, library, camera, size=(320, 240))
    scene.render.warp.tile_scale = 1.0
    exact = studio.picture(scene, library, camera, size=(320, 240))
    assert (np.abs(coarse - exact).max(-1) > 0.1).mean() < 0.03
    assert coarse.min() >= 0 and np.isfinite(coarse).all()
