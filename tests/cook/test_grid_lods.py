"""Levels as grids: ever fewer triangles on the samples, sorted into pieces or into the paper's ranges."""

import numpy as np
import pytest

from depthwalk.bake.images import BakedObject, Face
from depthwalk.cook.cases import BOTTOM_PIECE, PIECES, SIDE_OF_BOTTOM, SIDE_OF_TOP, TOP_PIECE, piece_numbers
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.cook.lod_geometry import BORDER, FACE_SHIFT, LodGeometry
from shapes import bake, box, joined, sphere


@pytest.fixture(scope="module")
def baked() -> BakedObject:
    return bake(joined(sphere(0.5, 48, 24), box(1.2, 0.2, 1.0, (0.2, -0.4, 0.1))), 48)


@pytest.fixture(scope="module")
def grids(baked: BakedObject) -> LodGeometry:
    return build_grid_lods(baked)


def test_each_step_has_fewer_triangles_and_a_larger_error(baked: BakedObject, grids: LodGeometry) -> None:
    counts = [len(grids.drawn(level)) for level in range(baked.steps)]
    assert (np.diff(counts) < 0).all() and (np.diff(grids.error) > 0).all() and grids.error[0] == 0


def test_vertices_are_the_samples_that_they_say(baked: BakedObject, grids: LodGeometry) -> None:
    from depthwalk.bake.face_grid import FaceGrid

    codes = grids.vertices[:, 3] & (1 << FACE_SHIFT + 3) - 1
    sampled = grids.texels[:, 0] >= 0
    assert (grids.vertices[~sampled, 3] & BORDER > 0).all()
    for image in baked.images:
        chosen = np.flatnonzero(sampled & (codes == (image.face << FACE_SHIFT) + image.layer))
        column, row = grids.texels[chosen].T
        expected = FaceGrid.of(baked.cylinder, image).points(image.depth)[row, column]
        np.testing.assert_allclose(grids.positions[chosen], expected, atol=1e-4)


def test_triangles_are_sorted_into_their_pieces(grids: LodGeometry) -> None:
    level = 1
    for piece in range(PIECES):
        first, count = int(grids.first[level, piece]), int(grids.count[level, piece])
        corners = grids.positions[grids.triangles(first, count)]
        assert (piece_numbers(corners) == piece).all()
    assert grids.count[level, TOP_PIECE] and grids.count[level, BOTTOM_PIECE]


def test_the_papers_cases_have_what_only_they_draw(baked: BakedObject, grids: LodGeometry) -> None:
    paper = build_grid_lods(baked, paper_cases=True)
    assert paper.count[0, SIDE_OF_TOP] and paper.count[0, SIDE_OF_BOTTOM] and not grids.count[0, PIECES:].any()
    assert len(paper.drawn(0)) == len(grids.drawn(0)) and (paper.horizon == -np.inf).all()
    top = paper.triangles(int(paper.first[0, TOP_PIECE]), int(paper.count[0, TOP_PIECE]))
    assert (paper.vertices[top[:, 2], 3] >> FACE_SHIFT & 7 == Face.TOP).all()


def test_no_tolerance_keeps_every_cell_and_smooth_surfaces_need_fewer(baked: BakedObject, grids: LodGeometry) -> None:
    every = build_grid_lods(baked, tolerance=-np.inf)
    assert len(grids.drawn(0)) < 0.8 * len(every.drawn(0))
    area = [
        np.linalg.norm(np.cross(*np.diff(kind.positions[kind.drawn(0)], axis=1).swapaxes(0, 1)), axis=1).sum()
        for kind in (grids, every)
    ]
    assert area[0] == pytest.approx(area[1], rel=0.01)


def test_out_of_pieces_all_are_in_the_first(baked: BakedObject, grids: LodGeometry) -> None:
    plain = build_grid_lods(baked, in_pieces=False)
    assert not plain.count[:, 1:].any() and plain.count[:, 0].tolist() == grids.count.sum(1).tolist()
