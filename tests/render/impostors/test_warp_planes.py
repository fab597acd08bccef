"""Pass 1's geometry: warp, bounds and cropping, against the NumPy twin and by table."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from depthwalk.bake.images import Face
from depthwalk.geometry.bounding_hull import bounding_hull, prism_corners
from depthwalk.reference.warp import table, unwarp, warp
from depthwalk.render.impostors.frustum_crop import crop_to_frustum
from depthwalk.render.impostors.warp_planes import (
    Planes,
    Volumes,
    choose_planes,
    depths_behind,
    tile_sizes,
)
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.types import Array

R, Y0, Y1 = 0.7, -0.2, 1.9


def cylinder(count: int = 1) -> Volumes:
    one = np.ones(count)
    hull = np.tile(prism_corners(np.full(4, R), Y0, Y1), (count, 1, 1))
    return Volumes(radius=R * one, bottom=Y0 * one, top=Y1 * one, hull=hull, has_side=one > 0)


def assert_within(position: Array, planes: Planes, slack: float) -> None:
    """Points (n, 2) are within the outlines of their planes, or outside by a part `slack` of their places at most."""
    s, v = position.T
    for value, least, greatest in (
        (s, planes.low[:, 0], planes.high[:, 0]),
        (v, planes.low[:, 1], planes.high[:, 1]),
        (s + v, *planes.diagonals[:, :2].T),
        (s - v, *planes.diagonals[:, 2:].T),
    ):
        outside = slack * (1 + np.abs(value).max())
        assert (value >= least - outside).all() and (value <= greatest + outside).all()


coordinates = st.floats(-8, 8, allow_nan=False, width=32)
viewers = arrays(np.float64, (3,), elements=coordinates).filter(
    lambda c: max(np.hypot(c[0], c[2]) - R, c[1] - Y1, Y0 - c[1]) > 0.05
)
inside = st.tuples(st.floats(0, 1), st.floats(0, 2 * np.pi), st.floats(Y0, Y1)).map(
    lambda p: np.array([R * p[0] * np.cos(p[1]), p[2], R * p[0] * np.sin(p[1])])
)


@given(viewers, inside)
def test_a_warped_sample_leads_back_to_its_point(viewer: Array, point: Array) -> None:
    planes = choose_planes(viewer[None], cylinder())
    position, lam = warp(point[None], planes)
    assert 0 < lam[0] <= 1 + 1e-9
    assert np.allclose(unwarp(position, lam, viewer[None], planes), point, atol=1e-6 * (1 + 1 / lam[0]))


@given(viewers, inside)
def test_the_rectangle_holds_every_sample(viewer: Array, point: Array) -> None:
    planes = choose_planes(viewer[None], cylinder())
    position, _ = warp(point[None], planes)
    assert_within(position, planes, 1e-8)


@given(viewers, arrays(np.float64, (12, 3), elements=st.floats(-0.49, 0.49)))
def test_the_rectangle_of_a_lopsided_object_holds_its_samples(viewer: Array, points: Array) -> None:
    points[:, 1] += 0.85
    one = np.ones(1)
    hull = bounding_hull(points)[None]
    volumes = Volumes(radius=R * one, bottom=Y0 * one, top=Y1 * one, hull=hull, has_side=one > 0)
    planes = choose_planes(viewer[None], volumes)
    many = Planes(**{each.name: np.repeat(getattr(planes, each.name), len(points), 0) for each in fields(Planes)})
    position, lam = warp(points, many)
    assert_within(position, many, 1e-8)
    nearest, farthest = depths_behind(planes, volumes)[0]
    depth = planes.distance * (1 / lam - 1)
    assert (depth >= nearest - 1e-9).all() and (depth <= farthest + 1e-9).all()


def test_a_ball_is_seen_in_an_octagon() -> None:
    """Whose corners are cut off as those of the octagon around a circle."""
    rng = np.random.default_rng(7)
    ball = rng.normal(size=(4000, 3))
    ball = 0.7 * ball / np.linalg.norm(ball, axis=1, keepdims=True) + [0, 0.85, 0]
    one = np.ones(1)
    volumes = Volumes(radius=R * one, bottom=Y0 * one, top=Y1 * one, hull=bounding_hull(ball)[None], has_side=one > 0)
    planes = choose_planes(np.array([[3.0, 0.85, 40.0]]), volumes)
    size = (planes.high - planes.low)[0]
    assert size == pytest.approx(2 * 0.7 * planes.distance[0] / (planes.distance[0] + R), rel=0.05)
    middle = (planes.low + planes.high)[0] / 2
    half = np.sqrt(0.5) * size.sum() / 2
    along = np.repeat([middle.sum(), middle[0] - middle[1]], 2)
    np.testing.assert_allclose(planes.diagonals[0], along + half * np.array([-1, 1, -1, 1]), atol=0.05)


def test_a_viewer_close_before_a_hull_sees_the_cylinder() -> None:
    """Corners of a hull may reach in front of the plane, even beyond the viewer."""
    near = cylinder()
    near.hull[0, 0] = [2.0, 1.0, 0.0]
    planes = choose_planes(np.array([[1.0, 1.0, 0.0]]), near)
    low, high = planes.low[0], planes.high[0]
    np.testing.assert_allclose(planes.diagonals[0], [low.sum(), high.sum(), low[0] - high[1], high[0] - low[1]])
    far = np.sqrt(0.3 / 1.7)
    assert planes.high[0, 0] == pytest.approx(R * far) == pytest.approx(-planes.low[0, 0])


@given(viewers, inside, st.floats(0, 2 * np.pi), st.floats(-1.2, 1.2))
def test_cropping_keeps_what_the_camera_sees(viewer: Array, point: Array, heading: float, pitch: float) -> None:
    forward = np.array([np.cos(heading) * np.cos(pitch), np.sin(pitch), np.sin(heading) * np.cos(pitch)])
    view = View(Camera(tuple(viewer), tuple(viewer + forward), 0.9), (160, 90))
    planes = choose_planes(view.position[None], cylinder())
    cropped, seen = crop_to_frustum(planes, view, np.array([[0.0, 0, 0, 1]]))
    right, up, ahead = view.axes @ (point - view.position)
    tan_x, tan_y = view.half_extent
    if ahead > 1e-3 and abs(right) < tan_x * ahead and abs(up) < tan_y * ahead:
        position, _ = warp(point[None], planes)
        assert seen.visible[0]
        assert_within(position, cropped, 1e-6)
    assert (cropped.low >= planes.low - 1e-6).all() or not seen.visible[0]


@given(viewers, arrays(np.float64, (9, 3), elements=st.floats(-0.4, 0.4)), st.floats(0, 6), st.floats(-1, 1))
def test_what_an_outline_shows_lies_in_its_tile(viewer: Array, points: Array, heading: float, pitch: float) -> None:
    """Pass 2 draws the outline; beyond the tile are other tiles."""
    forward = np.array([np.cos(heading) * np.cos(pitch), np.sin(pitch), np.sin(heading) * np.cos(pitch)])
    view = View(Camera(tuple(viewer), tuple(viewer + forward), 0.9), (160, 90))
    one = np.ones(1)
    hull = bounding_hull(points + np.array([0, 0.85, 0]))[None]
    volumes = Volumes(radius=R * one, bottom=Y0 * one, top=Y1 * one, hull=hull, has_side=one > 0)
    planes, seen = crop_to_frustum(choose_planes(viewer[None], volumes), view, np.array([[0.0, 0, 0, 1]]))
    if not seen.visible[0]:
        return
    s, v = np.meshgrid(*(np.linspace(low, high, 40) for low, high in zip(planes.low[0], planes.high[0], strict=True)))
    ends = planes.diagonals[0]
    within = (s + v >= ends[0]) & (s + v <= ends[1]) & (s - v >= ends[2]) & (s - v <= ends[3])
    x, y, z = seen.camera[0] @ np.stack([s[within], v[within], np.full(within.sum(), -planes.distance[0])])
    tan_x, tan_y = view.half_extent
    shown = (np.abs(x) < tan_x * z) & (np.abs(y) < tan_y * z)
    pixel = (np.stack([x / tan_x, y / tan_y], -1)[shown] / z[shown, None] + 1) / 2 * view.size
    assert (pixel >= seen.pixel_low[0] - 1e-3).all() and (pixel <= seen.pixel_high[0] + 1e-3).all()


def test_the_papers_shift_on_the_tangent_plane() -> None:
    viewer = np.array([[0.0, 1.0, 2.8]])  # on +z: the plane touches at E = (0, ·, R), t = (1, 0, 0)
    planes = choose_planes(viewer, cylinder())
    assert planes.face[0] == Face.SIDE and planes.distance[0] == pytest.approx(2.8 - R)
    point = np.array([[0.3, 1.4, 0.2]])
    position, lam = warp(point, planes)
    expected = (2.8 - R) / (2.8 - 0.2)  # λ = (ρ − R) / (ρ − B·n)
    assert lam[0] == pytest.approx(expected)
    assert position[0] == pytest.approx([expected * 0.3, expected * 0.4])
    assert 1 - lam[0] == pytest.approx(table(np.array(R - 0.2), 2.8 - R))


@pytest.mark.parametrize(
    ("viewer", "face", "distance"),
    [
        ((2.0, 1.0, 0.0), Face.SIDE, 1.3),
        ((0.0, 1.0, -3.0), Face.SIDE, 2.3),
        ((0.1, 4.0, 0.0), Face.TOP, 2.1),
        ((0.1, -2.0, 0.0), Face.BOTTOM, 1.8),
        ((1.5, 4.0, 0.0), Face.TOP, 2.1),
        ((4.0, 2.5, 0.0), Face.SIDE, 3.3),
        ((0.2, 1.0, 0.1), Face.SIDE, np.hypot(0.2, 0.1) - R),  # inside: no plane, the distance says so
    ],
)
def test_which_plane(viewer: tuple[float, float, float], face: Face, distance: float) -> None:
    planes = choose_planes(np.array([viewer]), cylinder())
    assert planes.face[0] == face
    assert planes.distance[0] == pytest.approx(distance)
    assert np.cross(planes.right[0], planes.up[0]) == pytest.approx(planes.normal[0])


def test_a_tile_has_the_resolution_of_the_screen() -> None:
    """Seen squarely from afar, a tile has as many texels as its rectangle covers pixels."""
    planes = choose_planes(np.array([[0.0, 0.85, 100.0]]), cylinder())
    focal = 800.0
    width, height = tile_sizes(planes, focal, 4096)[0]
    assert width == pytest.approx(focal * (planes.high - planes.low)[0, 0] / planes.distance[0], abs=1)
    assert height == pytest.approx(focal * (Y1 - Y0) / planes.distance[0], abs=1)


def test_no_part_of_a_tile_is_coarser_than_the_screen() -> None:
    """The number of texels follows from the largest angle that a step covers anywhere, and from no larger one."""
    rng, focal = np.random.default_rng(3), 1e4
    planes = choose_planes(np.array([[0.0, 0.85, 100.0]]), cylinder()).take(np.zeros(200, int))
    low = rng.uniform(-2, 2, (200, 2))
    high = low + rng.uniform(0.1, 2, (200, 2))
    distance = rng.uniform(0.05, 3, 200)
    sizes = tile_sizes(replace(planes, low=low, high=high, distance=distance), focal, 1 << 30)
    for size, first, last, ahead in zip(sizes, low, high, distance, strict=True):
        s, v = np.meshgrid(*np.linspace(first, last, 201).T)
        for along, across, texels, length in zip((s, v), (v, s), size, last - first, strict=True):
            transverse = ahead**2 + across**2
            steepest = (np.sqrt(transverse) / (transverse + along**2)).max()
            assert texels == pytest.approx(focal * steepest * length, rel=2e-3, abs=2)
