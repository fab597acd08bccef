"""Quadrics of colours: what is left after the colours that suit a position best."""

import numpy as np

from depthwalk.cook.colour_quadrics import best_colours, colour_quadrics, reduced
from depthwalk.cook.kernels.collapse_costs import COLOUR
from depthwalk.cook.quadrics import squared_distances


def _fan() -> tuple[np.ndarray, np.ndarray]:
    """A centre with six neighbours around it, not in a plane, and its triangles."""
    angle = np.arange(6) * np.pi / 3
    around = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.cos(3 * angle)], 1)
    return np.concatenate([[[0, 0, 0]], around]), np.array([[0, k + 1, (k + 1) % 6 + 1] for k in range(6)])


def test_they_are_the_least_squares_of_all_colour_functions() -> None:
    """The reference solves for the colour by least squares, with a function fitted to each triangle's corners."""
    point, corners = _fan()
    colours = np.random.default_rng(0).random((7, 3))
    quadric, tint = colour_quadrics(point, corners, colours[corners], np.ones(7, bool))
    at = np.array([[0.2, -0.1, 0.05]])
    values, weights = [], []
    for triangle in corners:
        a, b, c = point[triangle]
        normal = np.cross(b - a, c - a)
        gradient = np.linalg.solve([b - a, c - a, normal], [*(colours[triangle[1:]] - colours[triangle[0]]), [0, 0, 0]])
        values.append(colours[triangle[0]] + (at[0] - a) @ gradient)
        weights.append(COLOUR**2 * (normal @ normal) / 4)
    best = np.average(values, axis=0, weights=weights)
    expected = np.sum(np.array(weights)[:, None] * (values - best) ** 2)
    np.testing.assert_allclose(squared_distances(reduced(quadric[:1].T, tint[:1].T), at), [expected], rtol=1e-9)
    np.testing.assert_allclose(best_colours(tint[:1].T, at), [best.clip(0, 1)], rtol=1e-9)


def test_colours_that_are_linear_cost_nothing_anywhere_in_the_plane() -> None:
    point, corners = _fan()
    point[:, 2] = 0
    colours = 0.5 + point @ np.array([[0.2, 0, 0.1], [0, 0.3, -0.2], [0, 0, 0]])
    quadric, tint = colour_quadrics(point, corners, colours[corners], np.ones(7, bool))
    at = np.array([[0.3, 0.4, 0]])
    both = (quadric[0] + quadric[1])[:, None], (tint[0] + tint[1])[:, None]
    assert abs(squared_distances(reduced(*both), at)[0]) < 1e-12
    np.testing.assert_allclose(best_colours(both[1], at), [[0.56, 0.62, 0.45]], atol=1e-12)


def test_beyond_a_surface_colours_do_not_leave_their_range() -> None:
    """Else a vertex that moves past the end of a gradient is brighter than white, or wraps around to black."""
    point, corners = _fan()
    colours = np.clip(0.5 + 0.5 * point[:, [0, 0, 1]] * [1, -1, 1], 0, 1)
    _, tint = colour_quadrics(point, corners, colours[corners], np.ones(7, bool))
    np.testing.assert_allclose(best_colours(tint[:1].T, np.array([[3.0, 0, 0]])), [[1, 0, 0.5]], atol=1e-9)


def test_places_with_several_colours_have_none() -> None:
    point, corners = _fan()
    single = np.arange(7) != 0
    found = colour_quadrics(point, corners, np.random.default_rng(0).random((6, 3, 3)), single)
    for values in found:
        assert (values[0] == 0).all() and (values[1:] != 0).any(1).all()
