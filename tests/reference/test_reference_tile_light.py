"""Light in pass 1: where its texels lie, what they show, and how pass 2 filters them."""

from dataclasses import replace

import numpy as np
import pytest

from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.reference.light import Surfaces, reflected
from depthwalk.reference.tile_light import filtered_light, forward_light, shadowed_light, surface_point
from depthwalk.reference.warp import unwarp, warp
from depthwalk.render.impostors.warp_planes import NO_DIAGONALS, Planes
from depthwalk.types import Array


def plane_before(viewer: Array, count: int) -> Planes:
    """The plane z = 0 as a viewer (3,) before it has it, `count` times."""
    one = np.ones((count, 1))
    return Planes(
        face=np.zeros(count, int),
        right=one * [1.0, 0, 0],
        up=one * [0.0, 1, 0],
        normal=one * [0.0, 0, 1],
        distance=viewer[2] * one[:, 0],
        epipole=viewer[:2] * one,
        offset=np.zeros(count),
        low=-one * [1.0, 1],
        high=one * [1.0, 1],
        diagonals=one * NO_DIAGONALS,
    )


def test_a_texel_shows_the_point_where_its_ray_meets_the_triangle() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        viewer = rng.uniform(-1, 1, 3) + np.array([0, 0, 2])
        corners = rng.uniform(-1, 1, (3, 3)) * [1, 1, 0.5] - [0, 0, 0.6]
        position, lam = warp(corners, plane_before(viewer, 3))
        share = rng.dirichlet([1, 1, 1], 8)
        found = surface_point(corners, lam, share)
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        assert (found - corners[0]) @ normal == pytest.approx(np.zeros(8), abs=1e-9)
        shown = unwarp(share @ position, share @ lam, viewer, plane_before(viewer, 8))
        assert found == pytest.approx(shown)


def test_the_middle_between_two_samples_is_nearer_to_the_nearer_one() -> None:
    corners = np.array([[0.0, 0, 0], [0, 0, -3], [1, 0, -1]])
    _, lam = warp(corners, plane_before(np.array([1.0, 0, 1]), 3))
    assert surface_point(corners, lam, np.array([[0.5, 0.5, 0]]))[0, 2] == pytest.approx(-0.6)


def test_light_is_the_same_in_the_frame_of_the_object_and_of_the_world() -> None:
    rng = np.random.default_rng(4)
    normal, view = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in rng.normal(size=(2, 50, 3)))
    rotation = np.array([0.1, -0.7, 0.3, 0.4])
    rotation /= np.linalg.norm(rotation)
    to_sun = np.array([0.6, 0.8, 0.0])
    albedo, ambient, sun = rng.uniform(size=(50, 3)), rng.uniform(size=(50, 3)), np.array([1.0, 0.9, 0.7])
    specular, shininess = rng.uniform(size=50), rng.uniform(1, 40, 50)
    surfaces = Surfaces(albedo=albedo, specular=specular, normal=normal, shininess=shininess)
    every = np.tile(rotation, (50, 1))
    turned = replace(surfaces, normal=rotate(every, normal))
    expected = albedo * ambient + sun * reflected(turned, rotate(every, view), to_sun)
    found = forward_light(surfaces, view, rotation, to_sun, sun, ambient)
    assert found == pytest.approx(expected)
    back = rotate(conjugate(rotation[None]), to_sun[None])[0]
    assert rotate(rotation[None], back[None])[0] == pytest.approx(to_sun)


def test_the_filter_is_bilinear_and_leaves_empty_texels_out() -> None:
    light = np.array([[[0.0], [1.0], [9.0]], [[2.0], [3.0], [9.0]]]) * np.ones(3)
    filled = np.array([[True, True, False], [True, True, False]])
    position = np.array([[1.0, 1.0], [0.5, 0.5], [0.75, 0.5], [2.0, 0.5]])
    assert filtered_light(light, filled, position)[:, 0] == pytest.approx([1.5, 0.0, 0.25, 1.0])


def test_shadow_keeps_its_part_of_each_colour() -> None:
    tile = np.array([[0.5, 0.4, 0.3], [0.5, 0.4, 0.3]])
    unshadowed = np.array([[1.0, 0.8, 0.0], [1.0, 0.8, 0.6]])
    lit = np.array([[0.5, 0.2, 0.0], [1.0, 0.8, 0.6]])
    assert shadowed_light(tile, lit, unshadowed) == pytest.approx(np.array([[0.25, 0.1, 0.3], [0.5, 0.4, 0.3]]))
