"""Beyond the edge of a surface its texture coordinates go on as they went there."""

import numpy as np

from depthwalk.bake.images import COORDINATE_STEPS, HAS_COORDINATES, ONE_CHART, DepthImage, Face
from depthwalk.cook.coordinate_fill import filled_coordinates
from depthwalk.types import Array, Mask

SIZE = 24
ROW, COLUMN = np.mgrid[:SIZE, :SIZE]


def image_of(solid: Mask, u: Array, v: Array, chart: Array) -> DepthImage:
    """An image with these coordinates where it is solid; (SIZE, SIZE) each."""
    codes = np.round(np.stack([u, v], -1) % 1.0 * COORDINATE_STEPS).astype(np.int64).astype(np.uint16) & np.uint16(
        0xFFFE
    )
    codes[..., 0] |= np.uint16(HAS_COORDINATES)
    shown = np.where(solid, chart, -1)
    whole = (shown[:-1, :-1] >= 0) & (shown[1:, 1:] == shown[:-1, :-1])
    whole &= (shown[1:, :-1] == shown[:-1, :-1]) & (shown[:-1, 1:] == shown[:-1, :-1])
    codes[:-1, :-1, 1] |= whole.astype(np.uint16) * ONE_CHART
    codes[~solid] = 0
    return DepthImage(
        face=Face.FRONT,
        layer=0,
        depth=np.where(solid, np.float32(1), np.float32(np.inf)),
        normal=np.zeros((SIZE, SIZE, 3), np.float32),
        albedo=np.zeros((SIZE, SIZE, 4), np.float32),
        cells=(),
        owner=np.zeros((SIZE, SIZE), np.uint8),
        coordinates=codes,
    )


def test_coordinates_go_on_for_a_few_texels() -> None:
    u, v = 0.95 + 0.01 * COLUMN + 0.002 * ROW, 0.5 - 0.02 * ROW  # u passes 1, where the texture repeats
    solid = COLUMN < 10
    image = image_of(solid, u, v, np.zeros((SIZE, SIZE)))
    filled = filled_coordinates(image)
    np.testing.assert_array_equal(filled[solid, 0], image.coordinates[solid, 0])  # type: ignore[index]
    near = (COLUMN >= 10) & (COLUMN < 13)
    off = ((filled[near] & 0xFFFE) / COORDINATE_STEPS - np.stack([u, v], -1)[near] + 0.5) % 1.0 - 0.5
    assert np.abs(off).max() < 4 * 2 / COORDINATE_STEPS  # a step for each texel, and both ends are rounded
    assert (filled[near][:, 0] & HAS_COORDINATES).all()
    inside = near & (COLUMN < 12) & (ROW < SIZE - 1)
    assert (filled[inside][:, 1] & ONE_CHART).all()
    assert not filled[COLUMN > 15].any()


def test_charts_stay_apart() -> None:
    """Two of them with a gap of two texels between, which both fill from their side."""
    left = COLUMN < 10
    solid = left | (COLUMN >= 12)
    u = np.where(left, 0.01 * COLUMN, 0.8 + 0.01 * COLUMN)
    filled = filled_coordinates(image_of(solid, u, 0.01 * ROW, np.where(left, 0, 1)))
    found = (filled[..., 0] & 0xFFFE) / COORDINATE_STEPS
    np.testing.assert_allclose(found[5, 8:14], [0.08, 0.09, 0.10, 0.91, 0.92, 0.93], atol=1e-4)
    whole = filled[5, :, 1] & ONE_CHART > 0
    assert whole.tolist() == [column not in (10, SIZE - 1) for column in range(SIZE)]


def test_without_a_gap_or_a_cell_nothing_changes() -> None:
    full = image_of(np.ones((SIZE, SIZE), bool), 0.01 * COLUMN, 0.01 * ROW, np.zeros((SIZE, SIZE)))
    assert filled_coordinates(full) is full.coordinates
    lone = image_of((COLUMN == 3) & (ROW == 3), 0.01 * COLUMN, 0.01 * ROW, np.zeros((SIZE, SIZE)))
    assert filled_coordinates(lone) is lone.coordinates
