"""Where cylinders stand: the smallest circle, frames, and the choice of an axis."""

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from depthwalk.assets.asset_files import mesh_key
from depthwalk.bake.axis import candidate_axes, choose_axis
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.params import ModelParams
from depthwalk.bake.parts import bake_model
from depthwalk.bake.placement import cylinder_around, place_along, smallest_circle
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.sampling import footprints_by_layers, probe, sampled_footprints
from depthwalk.errors import InputError
from depthwalk.geometry.quaternions import rotate
from depthwalk.geometry.triangles import spread_directions
from depthwalk.ingest.mesh import Mesh
from depthwalk.scene.scene import MeshAsset
from depthwalk.types import Array
from files import write_ply
from shapes import box, joined, sphere


def circumcircle(a: Array, b: Array, c: Array) -> tuple[Array, float]:
    centre = np.linalg.solve(2 * np.array([b - a, c - a]), [b @ b - a @ a, c @ c - a @ a])
    return centre, np.hypot(*(a - centre))


@pytest.mark.parametrize("seed", range(20))
def test_the_smallest_circle_is_the_least_that_two_or_three_points_make(seed: int) -> None:
    points = np.random.default_rng(seed).normal(size=(9, 2)) * [3, 1]
    pairs = [((a + b) / 2, np.hypot(*(a - b)) / 2) for a, b in combinations(points, 2)]
    circles = pairs + [circumcircle(*three) for three in combinations(points, 3)]
    least = min(r for c, r in circles if np.hypot(*(points - c).T).max() <= r * (1 + 1e-9))
    centre, radius = smallest_circle(points)
    assert radius == pytest.approx(least, rel=1e-6)
    assert np.hypot(*(points - centre).T).max() == pytest.approx(radius)


@pytest.mark.parametrize(
    ("points", "centre", "radius"),
    [
        ([[2, 3]], [2, 3], 0),
        ([[0, 0], [0, 0], [4, 0]], [2, 0], 2),
        ([[0, 0], [1, 0], [2, 0], [5, 0]], [2.5, 0], 2.5),
        ([[0, 0], [0, 2], [2, 0], [2, 2]], [1, 1], 2**0.5),
    ],
)
def test_smallest_circles_of_few_points(points: Sequence[Sequence[int]], centre: Sequence[int], radius: int) -> None:
    found = smallest_circle(np.array(points, float))
    assert found[0] == pytest.approx(np.array(centre, float)) and found[1] == pytest.approx(radius)


@pytest.mark.parametrize("axis", [(0, 1, 0), (1, 0, 0), (0, -1, 0), (3, 4, 5)])
def test_placements_turn_y_to_the_axis_and_centre_what_is_seen_along_it(axis: tuple[int, int, int]) -> None:
    points = np.random.default_rng(1).normal((5, 6, 7), size=(50, 3))
    placement = place_along(axis, points)
    assert placement.rotation.apply([0, 1, 0]) == pytest.approx(np.array(axis) / np.linalg.norm(axis))
    seen = placement.into_object(points)
    centre, _ = smallest_circle(seen[:, [0, 2]])
    assert centre == pytest.approx([0, 0], abs=1e-9)
    assert placement.into_asset(seen) == pytest.approx(points, abs=1e-5)


def test_y_turns_nothing() -> None:
    assert place_along((0, 1, 0), np.eye(3)).rotation.as_quat() == pytest.approx([0, 0, 0, 1], abs=0)


def test_directions_are_spread_evenly() -> None:
    directions = spread_directions(200)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1)
    assert np.abs(directions.mean(0)).max() < 0.01
    assert (directions.T @ directions / 200).ravel() == pytest.approx(np.eye(3).ravel() / 3, abs=0.01)


def test_probes_know_from_where_they_are_seen() -> None:
    """A ball within a ball is seen by nobody, its shell from everywhere."""
    kernel = sphere(0.5, columns=48, rows=24)
    kernel.positions[:, 1] += 0.5
    shells = joined(sphere(1.0, columns=48, rows=24), kernel)
    probes = probe(shells, RayCaster(shells), 500)
    inner = np.linalg.norm(probes.point - [0, 1, 0], axis=1) < 0.51
    assert inner.sum() > 50 and (probes.weight[inner] == 0).all() and probes.weight[~inner].mean() > 0.95


def tower() -> Mesh:
    """Five plates one above the other, 3 cm apart."""
    return joined(*(box(2.0, 0.02, 2.0, (0, 0.05 * number, 0)) for number in range(5)))


@pytest.mark.parametrize("layers", [1, 2, 3])
def test_footprints_end_where_the_layers_do(layers: int) -> None:
    """Rays from above reach the upper sides of so many plates, those from below the lower sides."""
    mesh, params = tower(), ModelParams(resolution=32, layers=layers)
    caster, placement = RayCaster(mesh), place_along((0, 1, 0), mesh.positions)
    probes = probe(mesh, caster, 1000)
    found = sampled_footprints(caster, probes, placement, cylinder_around(placement, mesh.positions), params)
    flat = np.abs(probes.normal[:, 1]) > 0.9
    assert np.isfinite(found[flat]).mean() == pytest.approx(layers / 5, abs=0.02)
    assert np.isfinite(found[~flat]).all()
    cylinder = cylinder_around(placement, mesh.positions)
    at_once = footprints_by_layers(caster, probes, placement, cylinder, params, range(1, 6))  # with the same rays
    np.testing.assert_array_equal(at_once[layers - 1], found)


def choose(mesh: Mesh, **params: Any) -> tuple[float, float, float]:
    caster = RayCaster(mesh)
    return choose_axis(caster, mesh.positions, probe(mesh, caster, 500), ModelParams(resolution=64, layers=1, **params))


def test_the_axis_leans_where_that_shows_what_upright_images_miss() -> None:
    """Rays between the plates of a loose tower come from aslant."""
    plates = joined(*(box(1.0, 0.05, 1.0, (0, 0.5 * number, 0)) for number in range(5)))
    assert 0.1 < choose(plates)[1] < 0.9
    assert choose(sphere(columns=48, rows=24)) == (0, 1, 0)


def test_no_candidate_points_down() -> None:
    ball = sphere(columns=48, rows=24)
    axes = candidate_axes(probe(ball, RayCaster(ball), 300))
    assert (axes[:, 1] >= 0).all() and axes[0].tolist() == [0, 1, 0]
    assert np.linalg.norm(axes, axis=1) == pytest.approx(1)


@pytest.mark.parametrize("axis", ["x", "z", (1.0, 2.0, -0.5)])
def test_what_a_turned_cylinder_holds_lies_on_the_surface(
    axis: Literal["x", "z"] | tuple[float, float, float],
) -> None:
    mesh = sphere(0.5, columns=128, rows=64)
    mesh.positions[:] += [3, 1, -2]
    (baked,) = bake_model(mesh, ModelParams(resolution=32, layers=1, axis=axis), "").parts
    assert baked.cylinder.radius == pytest.approx(0.5, rel=2e-3)
    for image in baked.images:
        points = FaceGrid.of(baked.cylinder, image).points(image.depth)[np.isfinite(image.depth)]
        points = rotate(np.array(baked.rotation), points) + np.array(baked.position)
        assert np.linalg.norm(points - [3, 1.5, -2], axis=1) == pytest.approx(0.5, abs=2e-3)


def test_keys_name_axis_and_parts_unless_they_are_the_default(tmp_path: Path) -> None:
    spec = MeshAsset(
        name="ball",
        mesh=write_ply(tmp_path / "ball.ply", sphere(columns=8, rows=4)),
        texture=None,
        up="y",
        height=None,
        dpci=None,
    )
    every = [
        ModelParams(resolution=64, layers=1, **more)
        for more in ({}, {"axis": "x"}, {"axis": (1.0, 0.0, 0.0)}, {"parts": "auto"})
    ]
    assert len({mesh_key(spec, params) for params in every}) == 4
    assert mesh_key(spec, ModelParams(resolution=64, layers=1, axis="y", parts=1)) == mesh_key(spec, every[0])


@pytest.mark.parametrize("axis", [(0.0, 0.0, 0.0), (np.nan, 0.0, 1.0), (np.inf, 0.0, 0.0)])
def test_no_axis_without_a_direction(axis: tuple[float, float, float]) -> None:
    with pytest.raises(InputError, match=r"^axis \(.*\): must be a direction"):
        ModelParams(axis=axis)
