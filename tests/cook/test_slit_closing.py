"""Slits between sheets of a surface are closed; leaves, folds, overlaps and sheets far apart are left as they are."""

import numpy as np
import pytest

from depthwalk.bake.raycast import RayCaster
from depthwalk.cook.slit_closing import close_slits
from depthwalk.ingest.mesh import positions_only
from depthwalk.types import Array, Ints

TEXEL = 0.01
CELLS = 8
Surface = tuple[Array, Ints]


def sheet(corner: tuple[float, ...], right: tuple[float, ...], up: tuple[float, ...], cells: int = CELLS) -> Surface:
    """A parallelogram of cells, lengths in texels; it faces along right × up."""
    u, v = np.meshgrid(np.linspace(0, 1, cells + 1), np.linspace(0, 1, cells + 1))
    point = np.array(corner) + u.reshape(-1, 1) * np.array(right) + v.reshape(-1, 1) * np.array(up)
    row, column = np.divmod(np.arange(cells * cells), cells)
    first = row * (cells + 1) + column
    halves = [(first, first + 1, first + cells + 2), (first, first + cells + 2, first + cells + 1)]
    return TEXEL * point, np.concatenate([np.stack(half, -1) for half in halves])


def together(*sheets: Surface) -> Surface:
    before = np.cumsum([0, *(len(point) for point, _ in sheets)])
    triangles = [triangles + start for (_, triangles), start in zip(sheets, before, strict=False)]
    return np.concatenate([point for point, _ in sheets]), np.concatenate(triangles)


def seen_through(surface: Surface, at: Array, along: tuple[float, float, float]) -> float:
    """Which part of the rays through points `at` (n, 3), texels, meets nothing."""
    direction = np.array(along) / np.linalg.norm(along)
    caster = RayCaster(positions_only(*surface), two_sided=True)
    start = TEXEL * (at - 20 * direction)
    return float(np.isinf(caster.first(start, np.broadcast_to(direction, start.shape)).distance).mean())


def line(start: tuple[float, ...], end: tuple[float, ...], count: int = 301) -> Array:
    return np.linspace(start, end, count)


def unchanged(surface: Surface) -> bool:
    point, triangles = close_slits(*surface, TEXEL)
    return np.array_equal(point, surface[0]) and np.array_equal(triangles, surface[1])


@pytest.mark.parametrize("width", [0.2, 0.6, 1.2])
@pytest.mark.parametrize("cells", [8, 5, 3])
def test_a_slit_between_half_planes_is_closed(width: float, cells: int) -> None:
    """Of five or three cells, the vertices of one side are not opposite those of the other."""
    other = sheet((8 + width, 0, 0), (8, 0, 0), (0, 8, 0), cells)
    surface = together(sheet((0, 0, 0), (8, 0, 0), (0, 8, 0)), other)
    inside = line((8 + width / 2, 0.2, 0), (8 + width / 2, 7.8, 0))
    assert seen_through(surface, inside, (0, 0, -1)) == 1
    point, triangles = close_slits(*surface, TEXEL)
    assert seen_through((point, triangles), inside, (0, 0, -1)) == 0
    assert np.array_equal(point, surface[0])  # nothing that could be extended
    added = point[triangles[len(surface[1]) :]]
    across = np.cross(added[:, 1] - added[:, 0], added[:, 2] - added[:, 0])
    assert (across[:, 2] > 0).all()  # they face as the half planes do
    # In a plane they neither overlap nor leave gaps.
    assert across[:, 2].sum() / 2 == pytest.approx(width * 8 * TEXEL**2, rel=1e-6)


def test_a_slit_along_the_edge_of_a_box_is_closed() -> None:
    """The top ends before the edge, and so does the side."""
    surface = together(sheet((0, 0, 0), (7.7, 0, 0), (0, 8, 0)), sheet((8, 0, -0.4), (0, 0, -8), (0, 8, 0), cells=7))
    slanting = line((7.85, 0.5, -0.2), (7.85, 7.5, -0.2))
    assert seen_through(surface, slanting, (-1, 0, -1)) == 1
    assert seen_through(close_slits(*surface, TEXEL), slanting, (-1, 0, -1)) == 0


@pytest.mark.parametrize("gap", [0.1, 0.6])
def test_a_wall_is_extended_to_the_floor(gap: float) -> None:
    """It ends above the floor, which goes on below it: no vertex of the floor's end is near."""
    floor = sheet((-8, 0, 0), (16, 0, 0), (0, 8, 0))
    wall = sheet((0, 0, gap), (0, 8, 0), (0, 0, 8))
    point, triangles = close_slits(*together(floor, wall), TEXEL)
    assert len(triangles) == len(floor[1]) + len(wall[1])
    ends = point[len(floor[0]) :].reshape(CELLS + 1, CELLS + 1, 3)[0, 1:-1]
    assert np.allclose(ends[:, 2], -0.05 * TEXEL, atol=1e-3 * TEXEL)  # a little into the floor
    assert np.allclose(ends[:, 0], 0)


def test_a_wall_that_another_sheet_continues_is_not_extended() -> None:
    floor = sheet((-8, 0, 0), (16, 0, 0), (0, 8, 0))
    wall = sheet((0, 0, 0.5), (0, 8, 0), (0, 0, 8))
    before = sheet((0.3, -1, -1), (0, 10, 0), (0, 0, 4))
    point, _ = close_slits(*together(floor, wall, before), TEXEL)
    first = len(floor[0])
    assert np.array_equal(point[first : first + len(wall[0])], wall[0])


def test_overlapping_sheets_stay() -> None:
    """Of one plane, as where owners meet; each ends on the other."""
    assert unchanged(
        together(sheet((0, 0, 0), (8, 0, 0), (0, 8, 0)), sheet((6.5, 0, 0.01), (8, 0, 0), (0, 8, 0), cells=7))
    )


def test_a_slit_that_a_third_sheet_covers_stays() -> None:
    sides = sheet((0, 0, 0), (8, 0, 0), (0, 8, 0)), sheet((8.5, 0, 0), (8, 0, 0), (0, 8, 0))
    assert not unchanged(together(*sides))
    assert unchanged(together(*sides, sheet((6, 0, -0.5), (5, 0, 0), (0, 8, 0))))


def test_sheets_farther_apart_stay() -> None:
    assert unchanged(together(sheet((0, 0, 0), (8, 0, 0), (0, 8, 0)), sheet((9.6, 0, 0), (8, 0, 0), (0, 8, 0))))


def test_the_two_sides_of_a_thin_slab_stay_apart() -> None:
    """A leaf: its sides end at the same edge, half a texel from each other, but look away from it alike."""
    assert unchanged(together(sheet((0, 0, 0.5), (8, 0, 0), (0, 8, 0)), sheet((0, 0, 0), (0, 8, 0), (8, 0, 0))))


def test_a_thin_slab_beside_another_one_is_joined_side_by_side() -> None:
    """Top to top and bottom to bottom, never top to bottom."""
    slabs = [(sheet((x, 0, 0.6), (8, 0, 0), (0, 8, 0)), sheet((x, 0, 0), (0, 8, 0), (8, 0, 0))) for x in (0.0, 8.5)]
    surface = together(*slabs[0], *slabs[1])
    point, triangles = close_slits(*surface, TEXEL)
    height = point[triangles[len(surface[1]) :]][..., 2]
    assert len(height) == 0 or np.ptp(height, axis=1).max() == 0


def test_a_fold_and_a_closed_surface_stay() -> None:
    """The fold's two sides share their edge; its other ends are far from each other."""
    fold = together(sheet((0, 0, 0), (8, 0, 0), (0, 8, 0)), sheet((8, 0, 0), (1, 0, -8), (0, 8, 0)))
    point, number = np.unique(np.round(fold[0] / TEXEL, 6), axis=0, return_inverse=True)
    assert unchanged((point * TEXEL, number.ravel()[fold[1]]))
    tetrahedron = TEXEL * np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    assert unchanged((tetrahedron, np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])))


def test_no_triangles_stay() -> None:
    point, triangles = close_slits(np.zeros((0, 3)), np.zeros((0, 3), np.int64), TEXEL)
    assert point.shape == (0, 3) and triangles.shape == (0, 3)
