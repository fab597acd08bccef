"""The surface of an asset: triangles in a box, what is inside, and what of it stops nobody."""

from dataclasses import replace

import numpy as np
import pytest

from barriers import box, place, sheet
from depthwalk.ingest.mesh import Material, Mesh, Part
from depthwalk.walk.collision.collider import collider
from depthwalk.walk.collision.collider_builder import from_mesh, from_triangles, level_of, merged
from depthwalk.walk.collision.foliage import thin_leaves
from shapes import sphere


def leaves(rng: np.random.Generator, count: int, middle: float, spread: float) -> tuple[np.ndarray, np.ndarray]:
    """Chaotic triangles about a sphere of radius `middle`."""
    way = rng.normal(size=(count, 3))
    centre = way / np.linalg.norm(way, axis=1)[:, None] * (middle + spread * rng.random((count, 1)))
    corners = centre[:, None] + 0.06 * rng.normal(size=(count, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def test_triangles_in_a_box_are_found() -> None:
    rng = np.random.default_rng(1)
    points = rng.random((3000, 3)) + np.repeat(rng.random((1000, 3)) * 9, 3, 0)
    surface = collider(points, np.arange(3000).reshape(-1, 3))
    low, high = np.array([2, 2, 2.0]), np.array([4, 5, 6.0])
    corners = points.astype(np.float32).reshape(-1, 3, 3)
    wanted = ((corners.min(1) <= high) & (corners.max(1) >= low)).all(1).sum()
    assert len(surface.near(low, high)) == wanted > 20
    assert len(surface.near(low + 50, high + 50)) == 0
    assert len(collider(points, np.zeros((0, 3), int)).near(low, high)) == 0


@pytest.mark.parametrize(("point", "wound"), [((0.3, 0.5, 0.2), 1), ((2, 0.5, 0), 0), ((0, 30, 0), 0)])
def test_a_solid_winds_around_its_inside(point: tuple[float, ...], wound: float) -> None:
    low, high = (-1, 0, -1), (1, 2, 1)
    assert box(low, high).winding_number(np.array(point)) == pytest.approx(wound, abs=1e-6)
    assert box(low, high, inward=True).winding_number(np.array(point)) == pytest.approx(-wound, abs=1e-6)


def test_who_is_in_an_object_is_told() -> None:
    solid, heights = place(box((-1, 0, -1), (1, 2, 1)), (5, 0, 0), scale=2.0), np.array([0.4, 1.0, 1.8])
    assert solid.holds(np.array([6.0, 0, 1]), heights) and not solid.holds(np.array([2.0, 0, 0]), heights)
    table = place(sheet((-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1)))
    assert table.holds(np.zeros(3), heights) and not table.holds(np.zeros(3), heights + 1)


def test_leaves_in_the_air_are_thin_and_those_around_a_volume_are_not() -> None:
    rng = np.random.default_rng(2)
    points, triangles = leaves(rng, 300, 0.1, 0.2)
    assert thin_leaves(points, triangles).mean() > 0.9
    points, triangles = leaves(rng, 9000, 0.6, 0.1)
    assert thin_leaves(points, triangles).mean() < 0.02
    for size in (0.1, 2.0):  # a cube is none, however small
        cube = box((-size, 0, -size), (size, size, size))
        assert not thin_leaves(cube.points, cube.triangles).any()


def test_cut_out_surfaces_stop_nobody_and_glass_does() -> None:
    mesh = sphere(columns=24, rows=12)
    assert len(from_mesh(mesh, 1.0).triangles) == len(mesh.faces)
    cards = replace(mesh, materials=tuple(replace(each, cutoff=0.5) for each in mesh.materials))
    assert len(from_mesh(cards, 1.0).triangles) == 0
    none, part = mesh.faces[:0], Part(0, len(mesh.faces), 0)
    glass = Mesh(
        positions=mesh.positions,
        normals=mesh.normals,
        colours=mesh.colours,
        uv=mesh.uv,
        faces=none,
        parts=(),
        materials=(Material(opacity=0.3),),
        translucent_faces=mesh.faces,
        translucent_parts=(part,),
    )
    assert len(from_mesh(glass, 1.0).triangles) == len(mesh.faces)


def test_dense_surfaces_are_reduced_and_stay_where_they_are() -> None:
    side = np.linspace(0, 1, 80)
    points = np.stack([*np.meshgrid(side, side), np.zeros((80, 80))], -1).reshape(-1, 3)
    number = np.arange(6400).reshape(80, 80)
    corners = [number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]]
    a, b, c, d = (corner.ravel() for corner in corners)
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    surface = from_triangles(points, triangles, 1.0)
    assert 50 < len(surface.triangles) < 3000 and np.abs(surface.points[:, 2]).max() == 0
    assert surface.points[:, :2].min() < 0.06 and surface.points[:, :2].max() > 0.94
    few, _ = merged(points, triangles, 0.5)
    assert len(few) <= 9


def test_the_coarsest_level_that_is_accurate_is_taken() -> None:
    error = np.array([0.004, 0.009, 0.03])
    assert [level_of(error, scale) for scale in (1.0, 0.5, 3.0, 20.0)] == [1, 2, 0, 0]
