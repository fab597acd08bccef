"""Displacement by reliefs whose effect is known."""

import numpy as np
import pytest

from depthwalk.bake.images import Face
from depthwalk.bake.meso import Meso, tiling_slopes
from depthwalk.reference.meso import displaced, lay, relief_at, tilted, wind
from depthwalk.types import Array

RADIUS = 1.0


def level(depth: float) -> Meso:
    """A tile that is as deep everywhere."""
    relief = np.zeros((4, 4, 3), np.float32)
    relief[..., 0] = depth
    return Meso(relief=relief, tile=(0.5, 0.25), height=0.1)


def waves(size: int = 64) -> Meso:
    """A tile with one wave to the right."""
    x = (np.arange(size) + 0.5) / size
    depth = np.tile(0.02 * (1 - np.cos(2 * np.pi * x)), (size, 1)).astype(np.float32)
    tile = (0.5, 0.25)
    return Meso(relief=np.dstack([depth, tiling_slopes(depth, tile)]), tile=tile, height=0.04)


def ring(count: int = 12) -> tuple[Array, Array]:
    angle = (np.arange(count) + 0.25) / count * 2 * np.pi
    outward = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], -1)
    return RADIUS * outward + [0, 0.3, 0], outward


def test_a_level_relief_shrinks_a_cylinder() -> None:
    points, normals = ring()
    meso = level(0.05)
    moved = displaced(points, normals, Face.SIDE, meso, RADIUS)
    assert np.hypot(moved[:, 0], moved[:, 2]) == pytest.approx(np.full(12, 0.95), abs=1e-6)
    assert moved[:, 1] == pytest.approx(points[:, 1])
    assert tilted(normals, moved, Face.SIDE, meso, RADIUS) == pytest.approx(normals, abs=1e-6)


def test_a_level_relief_lowers_a_cap() -> None:
    rng = np.random.default_rng(3)
    points, normals = np.column_stack([rng.uniform(-1, 1, (20, 2)), np.ones(20)])[:, [0, 2, 1]], np.eye(3)[[1] * 20]
    moved = displaced(points, normals, Face.TOP, level(0.05), RADIUS)
    assert moved[:, 1] == pytest.approx(np.full(20, 0.95), abs=1e-6)


def test_near_the_axis_relief_is_shallower() -> None:
    points = np.array([[0.01, 0.5, 0.0], [0.1, 0.5, 0.0], [0.9, 0.5, 0.0]])
    moved = displaced(points, np.eye(3)[[1, 1, 1]], Face.SIDE, level(0.05), RADIUS)
    step = (points - moved)[:, 0]
    assert step[0] < step[1] < step[2] == pytest.approx(0.05, abs=1e-6)
    assert (step < points[:, 0]).all()


def test_a_whole_number_of_tiles_goes_round() -> None:
    meso = waves()
    points, _ = ring(1000)
    uv = wind(points, meso, RADIUS).uv
    assert meso.tiles_per_turn(RADIUS) == round(2 * np.pi / 0.5)
    step = np.diff(uv[:, 0]) % meso.tiles_per_turn(RADIUS)
    assert step == pytest.approx(np.full(999, 1 - 1e-3) * meso.tiles_per_turn(RADIUS))


@pytest.mark.parametrize("face", [face for face in Face if face is not Face.SIDE])
def test_a_flat_tile_has_its_axes_in_the_face(face: Face) -> None:
    placed = lay(np.array([[0.3, 0.2, -0.1]]), face, waves())
    axes = np.concatenate([placed.right, placed.up, placed.outward])
    assert axes @ axes.T == pytest.approx(np.eye(3)) and np.linalg.det(axes) == pytest.approx(1)


def test_relief_repeats() -> None:
    meso = waves()
    uv = np.random.default_rng(0).uniform(0, 1, (30, 2))
    assert relief_at(meso, uv + np.array([3, -2])) == pytest.approx(relief_at(meso, uv), abs=1e-6)
    assert relief_at(meso, np.array([[0.5, 0.5]]))[0, 0] == pytest.approx(0.04, abs=1e-4)


def test_tilted_normals_are_those_of_the_displaced_surface() -> None:
    """Against differences of displaced neighbours on the cylinder, shallow slopes taken to first order."""
    meso, step = waves(), 1e-3
    angle = np.linspace(0.1, 6.1, 60)

    def at(angle: Array) -> Array:
        outward = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], -1)
        return displaced(outward, outward, Face.SIDE, meso, RADIUS)

    along = at(angle + step) - at(angle - step)
    expected = np.cross([0.0, 1.0, 0.0], along)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    outward = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], -1)
    expected *= np.sign((expected * outward).sum(1))[:, None]
    found = tilted(outward, at(angle), Face.SIDE, meso, RADIUS)
    assert (found * expected).sum(1).min() > 0.995
    assert (expected * outward).sum(1).min() < 0.98  # the surface does turn
