"""The bound on the error of tiles that are reused, and the order in which they are warped again."""

import numpy as np

from depthwalk.geometry.bounding_hull import box_corners
from depthwalk.reference.warp import warp
from depthwalk.render.impostors.reprojection_error import HARDEST, coarseness, due, parallax
from depthwalk.render.impostors.tile_mapping import Tiles
from depthwalk.render.impostors.tile_records import tile_records
from depthwalk.render.impostors.warp_planes import Volumes, choose_planes, depths_behind
from depthwalk.types import Array

FOCAL = 800.0


def angle_between(a: Array, b: Array) -> Array:
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ni,ni->n", a, b))


def test_no_point_is_shown_farther_off_than_the_bound() -> None:
    """Random points in boxes, seen by random viewers from tiles that were warped for others."""
    rng = np.random.default_rng(2)
    count = 20000
    one = np.ones(count)
    half = rng.uniform(0.2, 0.7, (2, count))
    hull = box_corners(np.stack([half[0], 1.05 * one, half[1]], -1)) + np.array([0, 0.85, 0])
    volumes = Volumes(radius=0.7 * one, bottom=-0.2 * one, top=1.9 * one, hull=hull, has_side=one > 0)
    there = rng.normal(size=(count, 3))
    there *= (rng.uniform(2.4, 30, count) / np.linalg.norm(there, axis=1))[:, None]
    moved = rng.normal(size=(count, 3))
    moved *= (np.linalg.norm(there, axis=1) * 10 ** rng.uniform(-3, -0.3, count) / np.linalg.norm(moved, axis=1))[
        :, None
    ]
    here = there + moved
    planes = choose_planes(there, volumes)
    tiles = Tiles(
        texel=np.tile(np.eye(3), (count, 1, 1)), nearest=one, size=np.ones((count, 2), int), pixel=np.zeros((count, 2))
    )
    records = tile_records(there, planes, depths_behind(planes, volumes), tiles, np.zeros((count, 2), int))
    bound = parallax(records, here, FOCAL)

    angle, radius = rng.uniform(0, 2 * np.pi, count), 0.7 * np.sqrt(rng.uniform(0, 1, count))
    point = np.stack([radius * np.cos(angle), rng.uniform(-0.2, 1.9, count), radius * np.sin(angle)], -1)
    inside = (np.abs(point[:, 0]) <= half[0]) & (np.abs(point[:, 2]) <= half[1]) & np.isfinite(bound)
    position, _ = warp(point, planes)
    # What the texel shows is drawn at the middle λ of its object.
    middle = records["high"][:, 2:].mean(1)
    axes = position[:, :1] * planes.right + position[:, 1:] * planes.up - planes.distance[:, None] * planes.normal
    drawn = there + axes / middle[:, None]
    off = FOCAL * angle_between(drawn - here, point - here)
    slack = 1e-3 + 1e-4 * bound
    assert inside.sum() > 5000
    assert (off <= bound + slack)[inside].all()
    assert np.quantile((off / bound)[inside], 0.99) > 0.3  # and not far from it


def test_tiles_wait_for_their_turn_but_not_for_ever() -> None:
    error = np.array([0.5, 3.0, 1.5, 5.0, 2.0, np.inf])
    triangles, area = np.full(6, 100), np.full(6, 50.0)
    assert due(error, triangles, area, 1000).tolist() == [False, True, True, True, True, True]
    assert due(error, triangles, area, 300).tolist() == [False, True, False, True, False, True]
    assert due(error, triangles, area, 0).tolist() == [False, False, False, True, False, True]


def test_tiles_that_are_cheap_for_what_they_cover_come_first() -> None:
    error, triangles = np.array([3.0, 2.0, 2.0, 2.0]), np.array([900, 100, 100, 100])
    area = np.array([300.0, 400.0, 400.0, 100.0])
    assert due(error, triangles, area, 300).tolist() == [False, True, True, True]  # the worst alone would not fit
    assert due(error, triangles, area, 200).tolist() == [False, True, True, False]
    error[0] = 1.01 * HARDEST  # and then it takes the whole budget
    assert due(error, triangles, area, 300).tolist() == [True, False, False, False]


def test_turns_by_cost_and_area_leave_less_error_than_turns_by_error() -> None:
    rng = np.random.default_rng(3)
    triangles = np.where(np.arange(200) < 20, 20_000, 300)  # trees and flags
    area, speed = np.where(triangles > 300, 8000.0, 400.0), rng.uniform(0.2, 0.4, 200)

    def left_over(weight: Array) -> float:
        error, total = np.zeros(200), 0.0
        for _ in range(200):
            error += speed
            error[due(error, triangles, weight, 60_000)] = 0
            total += float((np.sqrt(area) * error).sum())  # it shows along outlines
        return total

    assert left_over(area) < 0.9 * left_over(triangles.astype(float) ** 2)  # where the greatest error comes first
    assert left_over(area) < 0.98 * left_over(area**2)  # where whole areas count


def test_resolutions_are_as_far_off_upward_as_downward() -> None:
    made, wanted = np.array([100.0, 100.0, 125.0]), np.array([100.0, 125.0, 100.0])
    np.testing.assert_allclose(coarseness(made, wanted), [0, 1, 1], atol=1e-12)
