"""The grids of one face: what they hold of the object, how vertices are numbered, and what is marked."""

import numpy as np
import pytest

from depthwalk.bake.images import BakedObject, Face
from depthwalk.cook.face_grids import FaceGrids, Run, build_face_grids
from depthwalk.cook.lod_geometry import EDGE, FACE_SHIFT
from depthwalk.types import Rows
from shapes import bake, box, joined, sphere


@pytest.fixture(scope="module")
def baked() -> BakedObject:
    return bake(joined(sphere(0.5, 48, 24), box(1.2, 0.2, 1.0, (0.2, -0.4, 0.1))), 48)  # as test_grid_lods


def triangles(grids: FaceGrids, level: int = 0) -> Rows:
    return np.concatenate([grids.runs[level, run] for run in Run]).astype(int)


@pytest.mark.parametrize("face", [Face.TOP, Face.SIDE, Face.FRONT])
def test_vertices_are_those_of_the_face_and_all_are_used(baked: BakedObject, face: Face) -> None:
    grids = build_face_grids(baked, face, 0.07, False)
    assert (grids.vertices[:, 3] >> FACE_SHIFT & 7 == face).all()
    used = np.unique(np.concatenate([triangles(grids, level).ravel() for level in range(baked.steps)]))
    np.testing.assert_array_equal(used, np.arange(len(grids.vertices)))


@pytest.mark.parametrize(("face", "run"), [(Face.TOP, Run.TOP), (Face.BOTTOM, Run.BOTTOM), (Face.LEFT, Run.BOX_FACES)])
def test_other_faces_than_the_side_hold_their_own_alone(baked: BakedObject, face: Face, run: Run) -> None:
    grids = build_face_grids(baked, face, 0.07, True)
    assert {kind for (_, kind), corners in grids.runs.items() if len(corners)} == {run}


def test_the_side_keeps_what_others_own_for_the_papers_cases(baked: BakedObject) -> None:
    plain, paper = (build_face_grids(baked, Face.SIDE, 0.07, cases) for cases in (False, True))
    assert len(paper.runs[0, Run.SIDE_OF_TOP]) and not len(plain.runs[0, Run.SIDE_OF_TOP])
    assert len(paper.runs[0, Run.SIDE]) == len(plain.runs[0, Run.SIDE])


def test_only_triangles_beside_a_discontinuity_are_marked(baked: BakedObject) -> None:
    grids = build_face_grids(baked, Face.TOP, -np.inf, False)
    last = grids.vertices[triangles(grids)[:, 2], 3]
    assert 0 < (last & EDGE > 0).mean() < 0.5
    assert not (grids.vertices[triangles(grids)[:, :2], 3] & EDGE).any()


def test_neighbouring_triangles_share_near_vertices(baked: BakedObject) -> None:
    """Blocks of vertices: the numbers of a triangle's corners differ little, mostly."""
    corners = triangles(build_face_grids(baked, Face.TOP, -np.inf, False))
    assert np.median(np.ptp(corners, axis=1)) < 100
