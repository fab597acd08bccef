"""Look-ups in shadow maps whose depths are known."""

import numpy as np
import pytest

from depthwalk.reference.shadows import lifted, light_share
from depthwalk.render.shadows.cascades import Cascade

SIZE = 32
DOWN = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])  # right, up and towards a sun overhead
VIEW = Cascade(centre=(0.0, 0.0, 0.0), half=1.0, axes=DOWN, resolution=SIZE)
ABOVE, BELOW = np.array([[0.1, 0.4, 0.2]]), np.array([[0.1, -0.4, 0.2]])


@pytest.mark.parametrize("filter_width", [2, 3, 5])
def test_all_light_reaches_what_is_above_a_floor_and_none_what_is_below(filter_width: int) -> None:
    floor = np.full((SIZE, SIZE), 0.5)  # at the centre's height
    assert light_share(floor, VIEW, np.concatenate([ABOVE, BELOW]), filter_width) == pytest.approx([1, 0])
    assert light_share(np.ones((SIZE, SIZE)), VIEW, BELOW, filter_width) == pytest.approx([1])


def test_at_an_edge_the_filter_sees_half_of_it() -> None:
    """A plate covers x < 0: below its edge half the taps are lit, more or fewer beside it."""
    depth = np.ones((SIZE, SIZE))
    depth[:, : SIZE // 2] = 0.5
    texel = 2 / SIZE
    x = np.arange(-3, 4) * texel
    point = np.stack([x, np.full(7, -0.4), np.zeros(7)], -1)
    share = light_share(depth, VIEW, point, 4)
    assert share[3] == pytest.approx(0.5) and share[0] == 0 and share[-1] == 1
    assert share + share[::-1] == pytest.approx(np.ones(7)) and (np.diff(share) >= 0).all()


def test_outside_the_map_nothing_is_known() -> None:
    point = np.array([[1.2, 0.0, 0.0], [0.99, 0.0, 0.0], [0.0, 0.0, -1.01], [0.0, 3.0, 0.0]])
    assert np.isnan(light_share(np.ones((SIZE, SIZE)), VIEW, point, 4)).all()


@pytest.mark.parametrize("degrees", [0, 30, 60, 85])
def test_a_lifted_plane_does_not_shadow_itself(degrees: int) -> None:
    """A sloped plane through the centre, in a map that holds its depths at the middles of the texels."""
    angle = np.radians(degrees)
    normal = np.array([-np.sin(angle), np.cos(angle), 0])
    x = ((np.arange(SIZE) + 0.5) / SIZE * 2 - 1) * VIEW.half
    height = x * np.tan(angle)
    clip = VIEW.clip_from_centre
    depth = np.array([(clip * (0.0, float(y), 0.0, 1.0)).z for y in height]) / 2 + 0.5
    at = np.linspace(-0.05, 0.05, 41)
    point = np.stack([at, at * np.tan(angle), 0 * at], -1)
    moved = lifted(point, np.tile(normal, (41, 1)), DOWN[2], VIEW.texel, 4, 0.0)
    assert light_share(np.tile(depth, (SIZE, 1)), VIEW, moved, 4) == pytest.approx(np.ones(41))
    if degrees:
        assert light_share(np.tile(depth, (SIZE, 1)), VIEW, point, 4).min() < 0.9  # as they were, some are shadowed


def test_lifting_goes_along_the_normal_by_texels() -> None:
    moved = lifted(np.zeros((1, 3)), np.array([[0.0, 1, 0]]), np.array([0.0, 1, 0]), 0.1, 6, 1.5)
    assert moved == pytest.approx(np.array([[0, 0.2, 0]]))
    moved = lifted(np.zeros((1, 3)), np.array([[1.0, 0, 0]]), np.array([0.0, 1, 0]), 0.1, 6, 0.0)
    assert moved == pytest.approx(np.array([[0.35, 0, 0]]))
