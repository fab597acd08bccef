"""A moved picture in cases that can be computed by hand."""

import numpy as np
import pytest

from depthwalk.reference.finished_picture import beside_nearer, nearest_in_cells, roughness
from depthwalk.reference.reprojection import nearest_seen, sources, tiles
from depthwalk.render.reprojection.nearest_cells import CELL
from depthwalk.render.reprojection.reprojection import BEYOND, REFLECTED
from depthwalk.render.reprojection.smooth_tiles import ROUGHNESS_CELL, TILE, TileClass
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera

SIZE = (80, 60)
AHEAD = View(Camera((0.0, 1.0, 4.0), (0.0, 1.0, 3.0), 0.8), SIZE, near=0.1, far=100.0)


def pixels() -> np.ndarray:
    x, y = np.meshgrid((np.arange(80) + 0.5) / 80, (np.arange(60) + 0.5) / 60)
    return np.stack([x, y], -1)


def test_a_camera_that_stands_still_sees_every_pixel_where_it_is() -> None:
    distances = np.random.default_rng(1).uniform(1, 9, SIZE[::-1])
    assert sources(AHEAD, distances, AHEAD) == pytest.approx(pixels())


def test_a_wall_moves_by_its_parallax() -> None:
    """One metre to the right, before a wall 5 m away, whose picture is 2 · 5 · tan 0.4 high."""
    aside = View(Camera((1.0, 1.0, 4.0), (1.0, 1.0, 3.0), 0.8), SIZE)
    height = 2 * 5 * np.tan(0.4)
    found = sources(AHEAD, np.full(SIZE[::-1], 5.0), aside)
    expected = pixels() + np.array([1 / (height * 80 / 60), 0])
    beyond = np.maximum(expected - 1, 0)  # up to 0.18: mirrored, and back again
    expected = np.minimum(expected, 1) - np.where(beyond < REFLECTED, beyond, 2 * REFLECTED - beyond)
    assert found == pytest.approx(expected)


def test_far_beyond_an_edge_is_what_lies_along_it() -> None:
    """Ground goes on as ground, also for who has looked down so far that half of the view is below the picture."""
    down = View(Camera((0.0, 1.0, 4.0), (0.0, 0.4, 3.0), 0.8), SIZE)
    found = sources(AHEAD, np.full(SIZE[::-1], BEYOND), down)
    beyond = found[:28]  # of 60 rows, those that look below
    assert beyond[..., 1].min() == pytest.approx(0, abs=0.02) and beyond[..., 1].max() <= REFLECTED + 1e-9


def test_the_sky_turns_but_does_not_move() -> None:
    elsewhere = View(Camera((3.0, 2.0, 0.0), (3.0, 2.0, -1.0), 0.8), SIZE)
    assert sources(AHEAD, np.full(SIZE[::-1], BEYOND), elsewhere) == pytest.approx(pixels(), abs=1e-5)
    turned = View(Camera((0.0, 1.0, 4.0), (-0.1, 1.0, 3.0), 0.8), SIZE)
    found = sources(AHEAD, np.full(SIZE[::-1], BEYOND), turned)[30, 40]
    assert found[0] == pytest.approx(0.506 - 0.1 / (2 * np.tan(0.4) * 80 / 60), abs=2e-3)


def test_what_something_hid_is_filled_from_behind_it() -> None:
    """A post 2 m away moves aside by more than its width; where it was, the wall of 10 m is seen."""
    distances = np.full(SIZE[::-1], 10.0)
    distances[:, 36:44] = 2.0
    aside = View(Camera((0.3, 1.0, 4.0), (0.3, 1.0, 3.0), 0.8), SIZE)
    column = np.minimum((sources(AHEAD, distances, aside)[30, :, 0] * 80).astype(int), 79)
    from_post = np.flatnonzero((column >= 36) & (column < 44))
    shift = 0.3 / (2 * 2 * np.tan(0.4) * 80 / 60) * 80
    assert shift > 8 and from_post[[0, -1]] == pytest.approx([36 - shift, 43 - shift], abs=1)
    assert len(from_post) in (7, 8, 9)


def test_the_nearest_surface_is_known_in_each_cell() -> None:
    distances = np.full((96, 160), 7.0)
    distances[40:46, 70:76] = 3.0
    found = nearest_in_cells(distances)
    assert found.shape == (6, 10)
    assert np.argwhere(found == 3.0).tolist() == [[2, 4]] and set(found.ravel().tolist()) == {3.0, 7.0}


def test_the_nearest_surface_is_looked_for_where_it_has_come() -> None:
    """A post 2 m away in the fourth column of cells, before the sky, that moves by two columns and a half."""
    size = (10 * CELL, 6 * CELL)
    picture = View(AHEAD.camera, size, near=0.1, far=100.0)
    distances = np.full(size[::-1], float(BEYOND))
    distances[:, 4 * CELL + 2 : 4 * CELL + 10] = 2.0
    metres = 2 * 2 * np.tan(0.4) * size[0] / size[1] / 10  # that a cell covers there
    assert np.unique(np.argwhere(nearest_seen(picture, distances, picture) == 2.0)[:, 1]).tolist() == [3, 4, 5]
    aside = View(Camera((2.5 * metres, 1.0, 4.0), (2.5 * metres, 1.0, 3.0), 0.8), size)
    found = nearest_seen(picture, distances, aside)
    assert np.unique(np.argwhere(found < BEYOND)[:, 1]).tolist() == [1, 2]
    assert found[found < BEYOND] == pytest.approx(2.0)


def test_a_plane_is_not_rough_and_a_step_is_as_rough_as_it_is_high() -> None:
    """A plane has inverse distances that are linear in the picture, however slanting it is."""
    size = 5 * ROUGHNESS_CELL
    y, x = np.indices((size, size))
    slanting = 1 / (0.2 + 0.001 * x + 0.002 * y)
    assert roughness(slanting)[:-1, :-1] == pytest.approx(0, abs=1e-12)
    stepped = np.full((size, size), 5.0)
    stepped[:, 2 * ROUGHNESS_CELL :] = 2.0
    found = roughness(stepped)
    assert set(np.flatnonzero(found[0] > 1e-9).tolist()) == {1}  # cells share their edges
    assert 0.1 < found[0, 1] <= 0.3 + 1e-9


def test_a_narrow_thing_that_comes_into_an_even_tile_is_searched_for() -> None:
    """A wire before a wall: no corner of a tile shows it, neither where it was nor where it comes."""
    size = 8 * TILE, 6 * TILE
    picture = View(AHEAD.camera, size, near=0.1, far=100.0)
    distances = np.full(size[::-1], 10.0)
    distances[:, 4 * TILE + 3 : 4 * TILE + 5] = 2.0
    aside = View(Camera((0.1, 1.0, 4.0), (0.1, 1.0, 3.0), 0.8), size)
    classes, _ = tiles(picture, distances, aside)
    shown = sources(picture, distances, aside)[3 * TILE, :, 0] * size[0]
    columns = np.unique(np.flatnonzero((shown >= 4 * TILE + 3) & (shown < 4 * TILE + 5)) // TILE)
    assert len(columns) > 0 and (classes[1:-1, columns] == TileClass.SEARCHED).all()
    assert (classes[1:-1, 0] == TileClass.SMOOTH).all()


@pytest.mark.parametrize(("nearer", "keeps"), [(3.0, True), (6.5, True), (6.8, False)])
def test_only_what_is_farther_than_what_is_beside_it_keeps_to_itself(nearer: float, keeps: bool) -> None:
    """Else what stands half a metre before a wall has a halo of its own colours there; of a slope nothing keeps so."""
    distances = np.full((3, 6), 7.0)
    distances[:, 2:4] = nearer
    assert beside_nearer(distances)[1].tolist() == [False, keeps, False, False, keeps, False]
