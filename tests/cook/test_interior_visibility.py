"""What hardly anybody outside sees is told from what a few do, and stored in fewer texels."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from depthwalk.bake.face_grid import FaceGrid, square_texel
from depthwalk.bake.images import BakedObject
from depthwalk.cook.interior_visibility import hardly_seen
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.simplified_lods import build_simplified_lods
from depthwalk.cook.used_texels import TILE
from depthwalk.cook.virtual_texture import build_virtual_texture
from depthwalk.ingest.mesh import Mesh
from depthwalk.types import Array, Mask
from shapes import bake, sphere


def bottle(opening: float) -> Mesh:
    """A thin shell around (0, 1, 0), of radius 1, without what is higher than `opening`."""
    whole = sphere(columns=96, rows=64)
    kept = whole.positions[whole.faces][..., 1].mean(1) < opening
    return replace(whole, faces=whole.faces[kept], parts=(replace(whole.parts[0], face_count=int(kept.sum())),))


@pytest.fixture(scope="module")
def narrow() -> tuple[BakedObject, LodGeometry]:
    baked = bake(bottle(1.98), resolution=160, layers=2)
    return baked, build_simplified_lods(baked)


def test_the_inside_of_a_bottle_is_hardly_seen(narrow: tuple[BakedObject, LodGeometry]) -> None:
    baked, grids = narrow
    compared = 0
    for image, tiles in zip(baked.images, hardly_seen(baked, grids), strict=True):
        points = FaceGrid.of(baked.cylinder, image).points(image.depth)
        solid = np.isfinite(image.depth)
        found = solid[TILE // 2 :: TILE, TILE // 2 :: TILE]
        if image.layer == 0:
            assert not tiles.any()
        elif found.sum() > 20:
            middle = np.array([0, points[solid][:, 1].mean(), 0])
            inside = np.einsum("ni,ni->n", image.normal[solid], points[solid] - middle) < 0
            assert inside.mean() > 0.9
            assert tiles[found].mean() > 0.8, image.name
            compared += 1
    assert compared


def test_a_bowl_is_seen() -> None:
    baked = bake(bottle(1.0), resolution=160, layers=2)
    assert not hardly_seen(baked, build_simplified_lods(baked)).any()


class _SeenAt:
    """In place of a ray caster: all rays escape that begin at some points, and no others."""

    def __init__(self, points: Array) -> None:
        self._tree = cKDTree(points)

    def escapes(self, start: Array, direction: Array) -> Mask:
        return np.asarray(self._tree.query(start)[0] < 1e-6)


def test_a_tile_beside_a_small_visible_part_is_kept(
    narrow: tuple[BakedObject, LodGeometry], monkeypatch: pytest.MonkeyPatch
) -> None:
    baked, grids = narrow
    number, image = next(
        (number, image)
        for number, image in enumerate(baked.images)
        if image.layer == 1 and np.isfinite(image.depth[64:96, 64:96]).all()
    )
    points = FaceGrid.of(baked.cylinder, image).points(image.depth) + square_texel(baked) * image.normal
    visible = points[81:83, 83:86].reshape(-1, 3)  # two rows of three texels, at the edge of a tile
    monkeypatch.setattr("depthwalk.cook.interior_visibility.RayCaster", lambda *_, **__: _SeenAt(visible))
    tiles = hardly_seen(baked, grids)[number]
    assert not tiles[9:12, 9:12].any()
    assert tiles[8, 8]


def test_what_is_hardly_seen_is_stored_in_fewer_texels(
    narrow: tuple[BakedObject, LodGeometry], monkeypatch: pytest.MonkeyPatch
) -> None:
    few = build_virtual_texture(*narrow)
    monkeypatch.setattr("depthwalk.cook.interior_visibility._LEAST", 0.0)
    assert few.normals.size < 0.75 * build_virtual_texture(*narrow).normals.size
