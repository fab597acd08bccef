"""Which lamps reach which part of the view, against asking every cluster."""

import numpy as np
import pytest

from depthwalk.render.lighting.light_clusters import (
    FADE,
    SLICES,
    SLICES_PER_DOUBLING,
    SQUARE,
    cluster_lists,
    lamp_table,
    visible_lamps,
)
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import LampParams

VIEW = View(Camera((1.0, 2.0, 3.0), (0.0, 1.0, -9.0), 1.0), (320, 200), near=0.1, far=200.0)


def lamps_of(count: int, seed: int = 4) -> list[LampParams]:
    rng = np.random.default_rng(seed)
    place = VIEW.position + rng.normal(0, 12, (count, 3))
    return [
        LampParams(position=tuple(p), range=float(r)) for p, r in zip(place, rng.uniform(0.3, 9, count), strict=True)
    ]


def test_boxes_are_listed_in_every_cluster_that_they_overlap() -> None:
    rng = np.random.default_rng(1)
    shape = (5, 4, 3)
    first = rng.uniform(-2, 5, (40, 3))
    last = first + rng.uniform(0, 4, (40, 3))
    cells, lists = cluster_lists(first, last, np.array(shape), 7)
    starts, counts, mapped, _ = cells.astype(int).T
    numbers = lists.ravel()
    low = np.clip(np.floor(first), 0, np.array(shape) - 1)
    high = np.clip(np.floor(last), 0, np.array(shape) - 1)
    for cluster in range(np.prod(shape)):
        place = np.array([cluster % 5, cluster // 5 % 4, cluster // 20])
        expected = np.flatnonzero(((low <= place) & (place <= high)).all(1))
        np.testing.assert_array_equal(numbers[starts[cluster] : starts[cluster] + counts[cluster]], expected)
        assert mapped[cluster] == (expected < 7).sum()


def test_no_lamps_leave_every_cluster_empty() -> None:
    clusters = visible_lamps(VIEW, lamp_table([]))
    assert len(clusters.records) == len(clusters.lists) == 0
    assert clusters.across == (10, 7) and len(clusters.cells) == 10 * 7 * SLICES
    assert (clusters.cells["numbers"][:, 1] == 0).all()


@pytest.mark.slow
def test_every_point_finds_the_lamps_that_reach_it() -> None:
    lamps = lamps_of(60)
    clusters = visible_lamps(VIEW, lamp_table(lamps))
    lists = clusters.lists["numbers"].ravel()
    rng = np.random.default_rng(9)
    reached = 0
    for _ in range(1500):
        pixel, forward = rng.uniform(0, VIEW.size), rng.uniform(0.1, 40)
        screen = np.append(pixel / VIEW.size * 2 - 1, 1.0)
        point = VIEW.position + forward * (VIEW.ray_from_screen @ screen)
        column, row = (pixel // SQUARE).astype(int)
        slice_ = int(np.clip(np.floor(SLICES_PER_DOUBLING * np.log2(max(forward, 1))), 0, SLICES - 1))
        begin, count, _, _ = clusters.cells["numbers"][(slice_ * 7 + row) * 10 + column].astype(int)
        listed = {tuple(clusters.records["place"][int(k)]) for k in lists[begin : begin + count]}
        for lamp in lamps:
            if np.linalg.norm(point - lamp.position) < lamp.range:
                reached += 1
                assert tuple(np.array([*(lamp.position - VIEW.position), lamp.range], np.float32)) in listed
    assert reached > 200


def test_lamps_behind_the_viewer_are_left_out() -> None:
    behind = VIEW.position - 5 * VIEW.axes[2]
    lamps = [LampParams(position=tuple(behind), range=reach) for reach in (4.0, 6.0)]
    assert visible_lamps(VIEW, lamp_table(lamps)).records["place"][:, 3].tolist() == [6.0]


def test_lamps_with_maps_come_first_and_know_their_tiles() -> None:
    ahead = VIEW.position + 5 * VIEW.axes[2]
    lamps = [LampParams(position=tuple(ahead), direction=(0, -1, 0), range=3.0 + k) for k in range(4)]
    clusters = visible_lamps(VIEW, lamp_table(lamps), {2: 7})
    assert clusters.records["shadow"][:, 3].tolist() == [7, -1, -1, -1]
    assert clusters.records["place"][0, 3] == 5
    cells = clusters.cells["numbers"]
    assert set(cells[cells[:, 1] == 4][:, 2]) == {1}
    half_width = 1 / np.linalg.norm(clusters.records["shadow"][0, :3])
    assert half_width == pytest.approx(np.tan(np.radians(lamps[2].angle / 2)), rel=1e-5)


def test_cones_fade_from_four_fifths_of_their_angle_on() -> None:
    lamps = [LampParams(position=(0, 0, 0), direction=(0, -2, 0), angle=60), LampParams(position=(0, 0, 0))]
    spot, point = lamp_table(lamps).records
    edge, full = np.cos(np.radians([30, FADE * 30]))
    assert spot["light"][3] == pytest.approx(edge) and spot["cone"][3] == pytest.approx(1 / (full - edge), rel=1e-5)
    assert spot["cone"][:3] == pytest.approx([0, -1, 0])

    def fade(record: np.void, cosine: float) -> float:
        return np.clip((cosine - record["light"][3]) * record["cone"][3], 0, 1)

    assert [fade(spot, cosine) for cosine in (edge, full)] == pytest.approx([0, 1], abs=1e-5)
    assert fade(point, -1.0) == 1
