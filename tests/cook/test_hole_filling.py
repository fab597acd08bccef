"""Small holes of a surface are closed, and nothing else."""

import numpy as np
import pytest
import trimesh

from depthwalk.cook.hole_filling import _Boundary, _shortest_rim, _shortest_rims, fill_holes
from depthwalk.geometry.indexed_triangles import distinct_triangles, opposite_edges
from depthwalk.types import Array, Ints, Mask

BALL = trimesh.creation.icosphere(subdivisions=3)
POINT, TRIANGLES = np.asarray(BALL.vertices), np.asarray(BALL.faces, np.int64)
EDGE = float(BALL.edges_unique_length.max())


def around(direction: tuple[float, float, float], size: float) -> Mask:
    """Which triangles of the ball are within `size` of a point on it."""
    towards = np.array(direction) / np.linalg.norm(direction)
    return np.asarray(np.linalg.norm(POINT[TRIANGLES].mean(1) - towards, axis=1) < size)


def boundary_edges(triangles: Ints) -> int:
    return int((opposite_edges(triangles) < 0).sum())


def volume(triangles: Ints) -> float:
    a, b, c = (POINT[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def test_holes_in_a_ball_are_closed_from_outside() -> None:
    """One of a single triangle, and those of all triangles around two vertices."""
    fans = np.isin(TRIANGLES, [0, int(TRIANGLES[(TRIANGLES == 0).any(1)].max())]).any(1)
    pierced = TRIANGLES[~(fans | around((1, 2, 3), EDGE / 2))]
    assert boundary_edges(pierced) > 8
    closed = fill_holes(POINT, pierced, 16 * EDGE, 12)
    assert boundary_edges(closed) == 0
    assert volume(closed) == pytest.approx(volume(TRIANGLES), rel=2e-3)


def test_two_holes_that_share_a_corner_are_both_closed() -> None:
    corner = int(np.argmax(np.bincount(TRIANGLES.ravel())))
    fan = np.flatnonzero(np.isin(TRIANGLES, corner).any(1))
    apart = next(k for k in fan if len(np.intersect1d(TRIANGLES[k], TRIANGLES[fan[0]])) == 1)
    pierced = np.delete(TRIANGLES, [fan[0], apart], axis=0)
    closed = fill_holes(POINT, pierced, 16 * EDGE, 12)
    assert boundary_edges(closed) == 0 and len(closed) == len(TRIANGLES)


def test_a_hole_with_a_longer_rim_stays() -> None:
    pierced = TRIANGLES[~around((1, 2, 3), 4 * EDGE)]
    assert boundary_edges(fill_holes(POINT, pierced, 16 * EDGE, 12)) == boundary_edges(pierced)
    one = np.delete(TRIANGLES, 0, axis=0)
    rim = POINT[TRIANGLES[0]]
    length = np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1).sum()
    assert len(fill_holes(POINT, one, 0.99 * length, 12)) == len(one)
    assert len(fill_holes(POINT, one, 1.01 * length, 12)) == len(TRIANGLES)


def test_a_hole_of_more_edges_stays() -> None:
    pierced = TRIANGLES[~np.isin(TRIANGLES, int(TRIANGLES[(TRIANGLES == 0).any(1)].max())).any(1)]
    assert boundary_edges(pierced) == 6
    assert boundary_edges(fill_holes(POINT, pierced, 16 * EDGE, 5)) == 6
    assert boundary_edges(fill_holes(POINT, pierced, 16 * EDGE, 6)) == 0


@pytest.mark.parametrize("bend", [0.0, 0.3])
def test_the_rim_of_a_leaf_is_no_hole(bend: float) -> None:
    """Flat or bent: triangles across its rim would be its back."""
    leaf: Array = np.array([(0, 0, bend), (1, 0, 0), (0.5, 0.9, 0), (-0.5, 0.9, 0), (-1, 0, 0), (0, -1, 0)])
    triangles = np.array([(0, k, k % 5 + 1) for k in range(1, 6)])
    assert len(fill_holes(leaf, triangles, 100.0, 12)) == len(triangles)


def test_a_closed_surface_and_none_stay() -> None:
    assert len(fill_holes(POINT, TRIANGLES, 1.0, 12)) == len(TRIANGLES)
    assert fill_holes(POINT, TRIANGLES[:0], 1.0, 12).shape == (0, 3)


def test_rims_are_found_as_alone() -> None:
    pierced = TRIANGLES[np.random.default_rng(1).random(len(TRIANGLES)) < 0.6]
    edge = np.flatnonzero(opposite_edges(pierced) < 0)
    ends, starts = pierced.ravel()[edge], np.roll(pierced, -1, 1).ravel()[edge]
    both = _shortest_rims(POINT, starts, ends, np.arange(len(edge)), 7 * EDGE, 9)
    rims = sorted(walk for walks in both for walk in walks.tolist())
    alone = [_shortest_rim(_Boundary(starts, ends), POINT, k, 7 * EDGE, 9) for k in range(len(edge))]
    assert rims == [walk for walk in alone if walk]
    assert len(set(map(len, rims))) > 4 and [] in alone


def test_an_edge_is_closed_no_more_often_than_it_is_open() -> None:
    """Of triangles at random, whose holes share edges."""
    random = np.random.default_rng(0)

    def edges(triangles: Ints) -> Ints:
        """Count the edges (30, 30) from each vertex to each."""
        start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
        return np.bincount(30 * start + end, minlength=900).reshape(30, 30)

    for _ in range(10):
        point, soup = random.normal(size=(30, 3)), distinct_triangles(random.integers(0, 30, (90, 3)))
        filled = fill_holes(point, soup, 12.0, 6)
        added = filled[~(filled[:, None] == soup).all(2).any(1)]
        is_open = edges(soup).T * (edges(soup) == 0)
        assert len(added) > 10 and (edges(added) - edges(added).T <= is_open).all()
