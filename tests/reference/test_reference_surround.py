"""What was seen around a viewer, in cases that can be computed by hand."""

import numpy as np
import pytest

from depthwalk.geometry.view_directions import direction_from_square
from depthwalk.reference.surround import captured, places_around
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera

SIZE = 128
RAYS = np.random.default_rng(3).normal(size=(200, 3))
RAYS /= np.linalg.norm(RAYS, axis=1, keepdims=True)


def test_who_walks_within_a_ball_sees_its_wall_where_it_is() -> None:
    """The wall is 5 m from where it was seen; the viewer is 1 m beside that."""
    surfaces = np.tile([0.0, 1.0, 0.0, 5.0], (SIZE, SIZE, 1))
    viewer = np.array([0.6, 1.8, 0.0])
    place, known = places_around(surfaces, viewer, RAYS)
    found = np.array([0, 1, 0]) + 5 * direction_from_square(2 * place - 1, False) - viewer
    assert known.all()
    cosine = (found * RAYS).sum(1) / np.linalg.norm(found, axis=1)
    assert np.degrees(np.arccos(cosine.min())) < 2.5
    at_once = 5 * RAYS - (viewer - (0, 1, 0))  # without any step
    assert ((at_once * RAYS).sum(1) / np.linalg.norm(at_once, axis=1)).min() < np.cos(np.radians(10))


def test_a_picture_is_kept_in_its_directions_only() -> None:
    view = View(Camera((1.0, 2.0, 3.0), (2.0, 2.0, 3.0), 0.8), (80, 60))
    at = (np.arange(SIZE) + 0.5) / SIZE
    places = np.stack(np.meshgrid(at, at), -1).reshape(-1, 2)
    surfaces = captured(view, np.full((60, 80), 7.0), places)
    known = surfaces[:, 3] > 0
    assert 0.05 < known.mean() < 0.12 and (surfaces[known][:, :3] == (1, 2, 3)).all()
    assert surfaces[known][:, 3].min() == pytest.approx(7, rel=0.01)  # in the middle; farther at the edges
    rays = np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    place, ahead = places_around(surfaces.reshape(SIZE, SIZE, 4), view.position, rays)
    assert ahead.tolist() == [True, False] and place[0] == pytest.approx([1.0, 0.5], abs=0.01)
