"""Caps and flanks keep what is drawn of them and no more."""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.bake.baker import bake_object
from depthwalk.bake.file import read_baked, write_baked
from depthwalk.bake.images import BOX_FACES, BakedObject, Face
from depthwalk.bake.model import BakedModel
from depthwalk.bake.params import BakeParams
from depthwalk.cook.cases import PAPER_PIECES, Case
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.ingest.mesh import Mesh
from depthwalk.types import Rows
from shapes import bake, box, joined, sphere

pytestmark = pytest.mark.slow  # all need the same two bakes
PACKED = np.array([1 << 32, 1 << 16, 1])


def statue() -> Mesh:
    return joined(sphere(0.7, 48, 24), box(0.3, 1, 0.9, (0.5, 1.2, 0)), box(1.2, 0.1, 0.1, (0, 0.9, 0.3)))


@pytest.fixture(scope="module")
def untrimmed() -> BakedObject:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("depthwalk.bake.baker.trim", lambda images, borders, each: (images, borders))
        return bake_object(statue(), BakeParams(resolution=64, layers=2), "untrimmed")


@pytest.fixture(scope="module")
def trimmed() -> BakedObject:
    return bake(statue(), resolution=64, layers=2)


def grids_of(baked: BakedObject) -> LodGeometry:
    """All triangles of the grids: larger ones depend on what is around."""
    return build_grid_lods(baked, paper_cases=True, tolerance=-np.inf)


@pytest.fixture(scope="module")
def grids(trimmed: BakedObject, untrimmed: BakedObject) -> tuple[LodGeometry, LodGeometry]:
    return grids_of(trimmed), grids_of(untrimmed)


def triangles(grids: LodGeometry, level: int, case: Case = Case.ALL) -> Rows:
    """The triangles drawn, in an order of their own: positions (n, 3) packed into numbers, smallest first in each."""
    positions = grids.vertices[grids.drawn(level, int(PAPER_PIECES[case])), :3].astype(np.int64) @ PACKED
    rows = np.sort(positions, axis=1)
    return rows[np.lexsort(rows.T)]


@pytest.mark.parametrize("level", [0, 1, 3])
@pytest.mark.parametrize("case", Case)
def test_what_is_drawn_stays(grids: tuple[LodGeometry, LodGeometry], level: int, case: Case) -> None:
    trimmed, untrimmed = (triangles(each, level, case) for each in grids)
    np.testing.assert_array_equal(trimmed, untrimmed)


def test_the_rest_goes(
    trimmed: BakedObject, untrimmed: BakedObject, grids: tuple[LodGeometry, LodGeometry], tmp_path: Path
) -> None:
    def samples(baked: BakedObject, faces: set[Face]) -> int:
        return sum(int(np.isfinite(image.depth).sum()) for image in baked.images if image.face in faces)

    others = {Face.TOP, Face.BOTTOM, *BOX_FACES}
    assert samples(trimmed, others) < 0.85 * samples(untrimmed, others)
    assert samples(trimmed, {Face.SIDE}) == samples(untrimmed, {Face.SIDE})
    write_baked(tmp_path / "trimmed.dpci.exr", BakedModel(parts=(trimmed,)))
    again = read_baked(tmp_path / "trimmed.dpci.exr").parts[0]
    np.testing.assert_array_equal(triangles(grids_of(again), 0), triangles(grids[0], 0))
