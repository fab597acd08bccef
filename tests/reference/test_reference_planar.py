"""Texture space against the world, in cases that can be computed by hand."""

from dataclasses import replace

import numpy as np
import pytest

from depthwalk.reference.light import Surfaces
from depthwalk.reference.light import phong as world_phong
from depthwalk.reference.planar import Placement, phong, view_vectors, warp_samples


def test_texture_space_has_depth_into_the_image() -> None:
    placement = Placement(np.array([1.0, 2.0, 3.0]), np.eye(3), 2.0)
    assert placement.world(np.array([0.5, 1.0, 0.25])) == pytest.approx([2.0, 4.0, 2.5])
    assert placement.point(np.array([2.0, 4.0, 2.5])) == pytest.approx([0.5, 1.0, 0.25])
    assert placement.direction(np.array([0.0, 0.0, 1.0])) == pytest.approx([0, 0, -1])


def test_samples_move_to_the_epipole_as_far_as_rays_would_have_them() -> None:
    """A sample as deep as the viewer is far goes half the way; one on the plane stays."""
    viewer = np.array([1.0, 2.0, -3.0])
    moved = warp_samples(np.array([[4.0, 5.0, 3.0], [4.0, 5.0, 0.0]]), viewer)
    assert moved == pytest.approx(np.array([[2.5, 3.5], [4.0, 5.0]]))


def test_view_vectors_go_from_samples_to_the_viewer() -> None:
    viewer, sample = np.array([1.0, 2.0, -3.0]), np.array([[4.0, 5.0, 3.0]])
    assert view_vectors(sample, viewer) == pytest.approx(np.array([[-3.0, -3.0, -6.0]]))


def test_lighting_needs_no_world() -> None:
    """An image that lies as the world does: only z turns round."""
    rng = np.random.default_rng(7)
    samples, viewer = rng.uniform(0, 1, (50, 3)), np.array([0.3, 0.6, -2.0])
    normal = rng.normal(size=(50, 3)) - [0, 0, 2]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    to_sun, sun, ambient = np.array([0.48, 0.64, -0.6]), np.array([1.0, 0.9, 0.8]), np.array([0.1, 0.2, 0.3])
    albedo, specular, shininess = rng.uniform(0, 1, (50, 3)), rng.uniform(0, 1, 50), rng.uniform(1, 40, 50)
    surfaces = Surfaces(albedo=albedo, specular=specular, normal=normal, shininess=shininess)
    found = phong(samples, surfaces, viewer, to_sun, np.array([0.0, 1, 0]), sun, ambient)
    turn = np.array([1, 1, -1])
    view = (samples - viewer) * turn
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    turned = replace(surfaces, normal=normal * turn)
    assert found == pytest.approx(world_phong(turned, view, to_sun * turn, sun, ambient))
