"""Normals and colours of simplified meshes, fitted to the original's."""

from dataclasses import replace

import numpy as np
import pytest

from depthwalk.bake.level_looks import barycentric, fitted_looks, sample_looks
from depthwalk.ingest.mesh import Mesh
from shapes import joined, sphere

APART = 100.0  # metres between charts


def of_normals(mesh: Mesh, bump: float) -> Mesh:
    """With normals that waver by `bump` from vertex to vertex, as those of a scan do, about the smooth ones."""
    noise = np.random.default_rng(1).normal(0, bump, mesh.normals.shape)
    normals = mesh.normals + noise.astype(np.float32)
    return replace(mesh, normals=normals / np.linalg.norm(normals, axis=1, keepdims=True))


def one_chart(mesh: Mesh) -> np.ndarray:
    return np.zeros(len(mesh.positions), np.int64)


def test_fitted_normals_are_the_mean_of_many() -> None:
    """The fine sphere's normals waver; those of a coarse one come near the smooth ones, and what is left is told."""
    fine, coarse = of_normals(sphere(columns=64, rows=32), 0.3), sphere(columns=12, rows=6)
    single = of_normals(coarse, 0.3)
    fitted, left = fitted_looks(single, sample_looks(fine, one_chart(fine), APART), one_chart(coarse), APART)

    def off(mesh: Mesh) -> float:
        return float(np.sqrt(np.mean(np.sum((mesh.normals - coarse.normals) ** 2, 1))))

    assert off(fitted) < 0.5 * off(single)
    assert np.allclose(np.linalg.norm(fitted.normals, axis=1), 1, atol=1e-5)
    samples = sample_looks(fine, one_chart(fine), APART)
    smooth = (samples.place[:, :3] - [0, 1, 0]) / np.linalg.norm(samples.place[:, :3] - [0, 1, 0], axis=1)[:, None]
    wavers = np.sqrt(np.mean(np.sum((samples.normal - smooth) ** 2, 1)))
    assert left == pytest.approx(wavers, rel=0.15)


def test_what_fits_is_left_as_it_is() -> None:
    mesh = sphere(columns=48, rows=24, colour=(10, 200, 90))
    fitted, left = fitted_looks(mesh, sample_looks(mesh, one_chart(mesh), APART), one_chart(mesh), APART)
    assert (fitted.colours == mesh.colours).all() and left < 0.01
    assert np.einsum("ij,ij->i", fitted.normals, mesh.normals).min() > 0.999


def test_a_pattern_that_is_lost_is_told() -> None:
    """Stripes finer than a coarse sphere's triangles: what is left of them is grey, 0.5 from black and white."""
    fine, coarse = sphere(columns=128, rows=64), sphere(columns=12, rows=6)
    colours = np.where(np.arange(len(fine.positions))[:, None] // 2 % 2, 255, 0).repeat(3, 1).astype(np.uint8)
    samples = sample_looks(replace(fine, colours=colours), one_chart(fine), APART)
    _, left = fitted_looks(coarse, samples, one_chart(coarse), APART)
    mean = samples.colour.mean(0)
    wavers = np.sqrt(np.mean(np.sum((samples.colour - mean) ** 2, 1))) / 255
    assert left == pytest.approx(wavers, rel=0.1) and left > 0.5


def test_charts_and_sides_that_lie_upon_each_other_keep_their_own_looks() -> None:
    """Two spheres at one place, of two colours, the inner side of one shown: neither takes part in the other's fit."""
    red, blue = sphere(columns=32, rows=16, colour=(255, 0, 0)), sphere(columns=32, rows=16, colour=(0, 0, 255))
    inward = replace(blue, faces=blue.faces[:, ::-1], normals=-blue.normals)
    for other, chart in ((blue, 1), (inward, 0)):
        both = joined(red, other)
        charts = np.repeat([0, chart], [len(red.positions), len(other.positions)])
        fitted, _ = fitted_looks(both, sample_looks(both, charts, APART), charts, APART)
        assert np.array_equal(fitted.colours, both.colours)
        assert np.einsum("ij,ij->i", fitted.normals, both.normals).min() > 0.99


def test_barycentric_coordinates_give_the_point_back() -> None:
    random = np.random.default_rng(0)
    corners, weights = random.normal(size=(20, 3, 3)), random.dirichlet([1, 1, 1], 20)
    assert np.allclose(barycentric(np.einsum("ij,ijk->ik", weights, corners), corners), weights)
    flat = np.zeros((1, 3, 3))
    assert np.array_equal(barycentric(np.ones((1, 3)), flat), [[1, 0, 0]])
