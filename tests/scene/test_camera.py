"""A camera's look, and its matrices."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyglm import glm

from depthwalk.render.view.view import matrix_array
from depthwalk.scene.arrays import Camera
from depthwalk.scene.camera import clip_from_view, view_from_world

coordinate = st.floats(-1000, 1000)
point = st.tuples(coordinate, coordinate, coordinate)


@given(point, point, point)
def test_a_moved_camera_keeps_its_look_and_comes_back(
    position: tuple[float, float, float], target: tuple[float, float, float], shift: tuple[float, float, float]
) -> None:
    camera, moved = Camera(position, target, 1.0), Camera(position, target, 1.0).moved(glm.dvec3(*shift))
    np.testing.assert_allclose(camera.look, np.subtract(target, position), rtol=1e-15)
    np.testing.assert_allclose(moved.position, np.add(position, shift), rtol=1e-15)
    np.testing.assert_allclose(moved.look, camera.look, atol=1e-12)
    back = moved.moved(-glm.dvec3(*shift))
    np.testing.assert_allclose((*back.position, *back.target), (*position, *target), atol=1e-12)


@pytest.mark.parametrize(
    ("position", "target"),
    [
        ((3, 2, 5), (0, 1, 0)),
        ((0, 5, 0), (0, 0, 0)),
        ((0, -5, 0), (0, 0, 0)),
        ((1, 2, 3), (1, 2, 3)),
        ((0, 1, 0), (1e-9, 5, 0)),
        ((1e6, 1, 1e6), (1e6, 1, 1e6 - 1)),
    ],
)
def test_view_is_a_rotation_that_looks_at_the_target(position: tuple[float, ...], target: tuple[float, ...]) -> None:
    view = matrix_array(view_from_world(Camera(position, target, 1.0)))  # type: ignore[arg-type]
    np.testing.assert_allclose(view[:3, :3] @ view[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(view[:3, :3]) == pytest.approx(1)
    np.testing.assert_allclose(view @ [*position, 1], [0, 0, 0, 1], atol=1e-9)
    distance = math.dist(position, target)
    np.testing.assert_allclose(view @ [*target, 1], [0, 0, -distance, 1], atol=1e-6)


def test_up_stays_up() -> None:
    view = matrix_array(view_from_world(Camera((3, 2, 5), (0, 1, 0), 1.0)))
    assert (view @ [0, 1, 0, 0])[1] > 0.9
    assert (view @ [0, 1, 0, 0])[0] == pytest.approx(0)


def test_straight_down_has_minus_z_on_top() -> None:
    view = matrix_array(view_from_world(Camera((0, 5, 0), (0, 0, 0), 1.0)))
    np.testing.assert_allclose(view @ [0, 0, -1, 0], [0, 1, 0, 0], atol=1e-12)


@pytest.mark.parametrize("far", [100.0, math.inf])
def test_clip_planes_and_angle(far: float) -> None:
    clip = matrix_array(clip_from_view(math.radians(60), 1.5, 0.1, far))
    near_point = clip @ [0, 0, -0.1, 1]
    assert near_point[2] / near_point[3] == pytest.approx(-1)
    far_point = clip @ [0, 0, -min(far, 1e12), 1]
    assert far_point[2] / far_point[3] == pytest.approx(1)
    edge = clip @ [1.5 * math.tan(math.radians(30)), math.tan(math.radians(30)), -1, 1]
    np.testing.assert_allclose(edge[:2] / edge[3], [1, 1])


@given(point, st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(-9, 9)))
def test_the_camera_is_found_again_in_its_matrix(
    position: tuple[float, float, float], look: tuple[float, float, float]
) -> None:
    target = tuple(np.add(position, look).tolist())
    camera = Camera(position, target, 1.0)
    world_from_view = glm.inverse(view_from_world(camera))
    np.testing.assert_allclose(world_from_view[3].xyz, position, atol=1e-9)
    distance = glm.length(camera.look)
    if distance > 0:
        found = world_from_view * glm.dvec4(0, 0, -distance, 1)
        np.testing.assert_allclose(found.xyz, target, atol=1e-8)
