"""Which image a piece of surface is looked up in."""

import numpy as np
import pytest

from depthwalk.bake.images import BakedObject, Face
from depthwalk.cook.lod_geometry import EDGE, FACE_SHIFT
from depthwalk.cook.view_selection import NOWHERE, select_views
from shapes import bake, box, joined, mesh_of


@pytest.fixture(scope="module")
def leaf() -> BakedObject:
    """A leaf that lies above a plinth, with normals bent to below its face."""
    corners = np.array([(-0.4, 0.5, 0.4), (0.4, 0.5, 0.4), (0.4, 0.5, -0.4), (-0.4, 0.5, -0.4)])
    blade = mesh_of(corners, [(0, 1, 2), (0, 2, 3)], np.tile((0.6, -0.8, 0.0), (4, 1)))
    return bake(joined(box(0.6, 0.2, 0.6), blade), resolution=32, layers=4)


@pytest.mark.parametrize(("turned", "face"), [(1, Face.TOP), (-1, Face.BOTTOM)])
def test_a_side_of_a_leaf_is_looked_up_from_where_it_is_seen(leaf: BakedObject, turned: int, face: Face) -> None:
    corners = np.array([(-0.1, 0.5, 0.1), (0.1, 0.5, 0.1), (0.1, 0.5, -0.1)])[::turned] - np.asarray(leaf.position)
    assert select_views(leaf, corners[None])[0] % EDGE >> FACE_SHIFT == face


def test_a_triangle_that_reaches_into_another_layer_is_looked_up_in_both() -> None:
    """Of a floor below a box: from above it is in the first layer beside the box, in the second behind it."""
    hall = bake(joined(box(1.1, 0.1, 1.1), box(0.36, 0.1, 0.36, (0, 0.5, 0))), resolution=64)
    corners = np.array([(-0.25, 0.05, 0), (0.5, 0.05, 0.1), (0.5, 0.05, -0.1)]) - np.asarray(hall.position)
    image = select_views(hall, corners[None])[0]
    assert image & EDGE and (image % EDGE) >> FACE_SHIFT == Face.TOP
    beside = np.array([(0.3, 0.05, -0.1), (0.3, 0.05, 0.1), (0.45, 0.05, 0)]) - np.asarray(hall.position)
    assert select_views(hall, beside[None])[0] == Face.TOP << FACE_SHIFT


def test_a_floor_under_two_shelves_is_looked_up_from_above() -> None:
    """It is in the first layer beside them, in the fifth below them, and in none between those."""
    shelves = (box(0.4, 0.02, 0.4, (0, height, 0)) for height in (0.4, 0.7))
    rack = bake(joined(box(1.1, 0.1, 1.1), *shelves), resolution=64, layers=5)
    corners = np.array([(0, 0.05, 0), (0.1, 0.05, 0.45), (0.45, 0.05, 0.1)]) - np.asarray(rack.position)
    image = select_views(rack, corners[None])[0]
    assert image & EDGE and (image % EDGE) >> FACE_SHIFT == Face.TOP


def test_a_triangle_is_probed_near_its_corners() -> None:
    """Three quarters of the way to this one's corner lies another layer, half of the way none."""
    hall = bake(joined(box(1.1, 0.1, 1.1), box(0.36, 0.1, 0.36, (0, 0.5, 0))), resolution=64)
    corners = np.array([(0.08, 0.05, 0), (0.5, 0.05, 0.2), (0.5, 0.05, -0.2)]) - np.asarray(hall.position)
    assert select_views(hall, corners[None])[0] & EDGE


@pytest.mark.parametrize("height", [0.002, 0.02])
def test_a_fold_below_a_rim_does_not_show_the_underside_of_its_slab(height: float) -> None:
    """It faces down, three texels above the only samples that do. Looked up in these, it would be a dark dash."""
    slab = bake(box(1.0, 0.1, 1.0), resolution=48)
    corners = np.array([(-0.05, 0.035, 0.495), (0.05, 0.035, 0.495), (0.0, 0.035, 0.495 + height)])
    assert select_views(slab, corners[None] - np.asarray(slab.position))[0] == NOWHERE
    turned = corners[::-1] + np.array([0, 0.015, -0.1])
    assert select_views(slab, turned[None] - np.asarray(slab.position))[0] % EDGE >> FACE_SHIFT == Face.TOP
