"""Normal maps in frames from derivatives along the screen."""

import numpy as np
import pytest

from depthwalk.reference.normal_map import mapped_normals
from depthwalk.types import Array
from normal_mapped import TILT, tilted_globe_normals

RIGHT, UP = np.array([[1.0, 0, 0]]), np.array([[0, 1.0, 0]])


def texel(mapped: Array) -> Array:
    return (mapped + 1) / 2


def test_a_globe_seen_from_any_side_has_its_analytic_normals() -> None:
    """Its texture is mirrored on one half; pixels lie on the surface, as far apart as rounding allows."""
    random = np.random.default_rng(3)
    normal = random.normal(size=(500, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    east = np.cross([0.0, 1, 0], normal)
    circle = np.linalg.norm(east, axis=1)
    north = np.cross(normal, east) / circle[:, None]
    steps = random.normal(size=(2, 500, 2))  # radians to the east, and to the north
    steps[1] *= np.sign(steps[0, :, :1] * steps[1, :, 1:] - steps[0, :, 1:] * steps[1, :, :1])  # seen from outside
    places = [along[:, :1] * east + along[:, 1:] * north for along in steps]
    mirrored = np.where(normal[:, :1] > 0, 1, -1) * [1, 0] + [0, 1]
    found = mapped_normals(normal, tuple(places), tuple(steps * mirrored), np.tile(texel(TILT), (500, 1)))
    assert found == pytest.approx(tilted_globe_normals(normal), abs=1e-9)


def test_scale_flattens_or_deepens() -> None:
    normal = np.array([[0.0, 0, 2]])  # of any length
    uv = RIGHT[:, :2], UP[:, :2]
    for scale in (0.0, 0.5, 1.0, -2.0):
        expected = TILT * [scale, scale, 1]
        found = mapped_normals(normal, (RIGHT, UP), uv, texel(TILT)[None], scale)
        assert found[0] == pytest.approx(expected / np.linalg.norm(expected))
