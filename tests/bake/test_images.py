"""The volume that images enclose, and the faces around it."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthwalk.bake.images import (
    BOX_FACES,
    PAPER_FACES,
    Cylinder,
    Face,
    enclosing_cylinder,
    face_outward,
    plane_axes,
    with_margins,
)

PLANAR = [face for face in Face if face is not Face.SIDE]


@given(st.integers(0, 2**32 - 1), st.sampled_from([(1, 1, 1), (1, 0, 1), (0, 1, 0), (5, 0.1, 0.2)]))
def test_the_cylinder_holds_all_points_but_hardly_more(seed: int, extent: tuple[int, float, float]) -> None:
    points = np.random.default_rng(seed).normal(size=(20, 3)) * extent
    cylinder = enclosing_cylinder(points)
    radius = np.hypot(points[:, 0], points[:, 2]).max()
    assert cylinder.bottom < points[:, 1].min() and points[:, 1].max() < cylinder.top
    assert radius < cylinder.radius == cylinder.half_width == cylinder.half_depth
    largest = max(radius, np.ptp(points[:, 1]))
    assert cylinder.radius - radius <= 2.1e-4 * largest and cylinder.height - np.ptp(points[:, 1]) <= 2.1e-4 * largest


def test_margins_are_a_texel_of_the_higher_cylinder_in_single_precision() -> None:
    plain = enclosing_cylinder(np.array([[0.3, 0.1, 0], [0, 1.2, -0.4]]))
    higher = with_margins(plain, 64)
    texel = higher.height / 64
    assert plain.bottom - higher.bottom == pytest.approx(texel, rel=1e-4)
    assert higher.top - plain.top == pytest.approx(texel, rel=1e-4)
    assert all(value == np.float32(value) for value in (higher.radius, higher.bottom, higher.top))


def test_the_box_is_the_cylinders() -> None:
    low, size = Cylinder(radius=2.0, bottom=-1.0, top=4.0, half_width=1.5, half_depth=0.5).box
    assert low.tolist() == [-1.5, -1.0, -0.5] and size.tolist() == [3.0, 5.0, 1.0]


@pytest.mark.parametrize("face", PLANAR)
def test_u_v_and_the_way_out_are_the_three_axes(face: Face) -> None:
    out = face_outward(face)
    assert sorted([*plane_axes(face), int(np.abs(out).argmax())]) == [0, 1, 2] and np.abs(out).sum() == 1


def test_opposite_faces_look_apart() -> None:
    pairs = (Face.TOP, Face.BOTTOM), (Face.FRONT, Face.BACK), (Face.RIGHT, Face.LEFT)
    for (one, other), axis in zip(pairs, (1, 2, 0), strict=True):
        assert face_outward(one)[axis] == 1 and (face_outward(one) == -face_outward(other)).all()
    assert sorted([*PAPER_FACES, *BOX_FACES]) == sorted(Face)


def test_numbers_are_named_and_stay() -> None:
    with pytest.raises(TypeError, match="positional"):
        Cylinder(1.0, 0.0, 2.0, 1.0, 1.0)  # type: ignore[call-arg]
    cylinder = enclosing_cylinder(np.eye(3))
    with pytest.raises(FrozenInstanceError):
        cylinder.radius = 2.0  # type: ignore[misc]
