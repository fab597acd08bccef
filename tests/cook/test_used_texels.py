"""Which sub-tiles triangles touch: all of them, and little else."""

from dataclasses import replace

import numpy as np
import pytest

from depthwalk.bake.images import BakedObject, Face
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.cook.lod_geometry import FACE_SHIFT, PAST_AXIS, LodGeometry
from depthwalk.cook.used_texels import SUB_TILE, TILE, tile_counts, used_sub_tiles
from shapes import bake, box, joined, sphere


@pytest.fixture(scope="module")
def baked() -> BakedObject:
    return bake(
        joined(
            sphere(
                0.4,
                48,
                24,
            ),
            box(1.2, 0.2, 1.0, (0.2, -0.4, 0.1)),
        ),
        64,
    )


@pytest.fixture(scope="module")
def grids(baked: BakedObject) -> LodGeometry:
    return build_grid_lods(baked)


@pytest.mark.parametrize(("size", "tiles"), [(64, 8), (65, 9), (1, 1)])
def test_tiles_cover_an_image(size: int, tiles: int) -> None:
    assert tile_counts((size, TILE)) == (tiles, 1)


def test_the_sub_tiles_of_all_drawn_samples_are_used(baked: BakedObject, grids: LodGeometry) -> None:
    (used,) = used_sub_tiles(baked, grids, [1])
    assert used.shape == (len(baked.images), 16, 16)
    drawn = np.unique(grids.drawn(0))
    drawn = drawn[grids.texels[drawn, 0] >= 0]
    codes = grids.vertices[drawn, 3]
    faces = [image.face for image in baked.images]
    image = np.searchsorted(faces, codes >> FACE_SHIFT & 7) + (codes & 7)
    column, row = grids.texels[drawn].T // SUB_TILE
    assert used[image, row, column].all()


def test_empty_parts_of_images_are_not_used(baked: BakedObject, grids: LodGeometry) -> None:
    (used,) = used_sub_tiles(baked, grids, [1])
    for image, mask in zip(baked.images, used, strict=True):
        if image.face is Face.SIDE:
            continue
        solid = np.isfinite(image.depth).reshape(16, SUB_TILE, 16, SUB_TILE).any((1, 3))
        around = np.pad(solid, 1)
        near = np.any([around[i : i + 16, j : j + 16] for i in range(3) for j in range(3)], axis=0)
        assert not (mask & ~near).any(), image.name
    assert used.mean() < 0.7


def test_more_levels_use_more(baked: BakedObject, grids: LodGeometry) -> None:
    fine, both = used_sub_tiles(baked, grids, [1, 3])
    assert (both >= fine).all()


@pytest.mark.parametrize("past", [0, PAST_AXIS])
def test_triangles_are_looked_up_in_their_own_image_whatever_their_vertices_carry(
    baked: BakedObject, grids: LodGeometry, past: int
) -> None:
    """As those of simplified levels are: the last vertex alone says which image it is."""
    first, last = grids.indices[:3].astype(np.int64), grids.indices[2]
    one = replace(
        grids,
        indices=grids.indices[:3],
        first=np.zeros_like(grids.first[:1]),
        count=np.eye(1, grids.count.shape[1], dtype=np.int64) * 3,
    )
    vertices = grids.vertices.copy()
    vertices[last, 3] = (Face.SIDE << FACE_SHIFT) + past
    found = []
    for others in (Face.SIDE << FACE_SHIFT) + past, Face.TOP << FACE_SHIFT, Face.SIDE << FACE_SHIFT:
        vertices[first[:2], 3] = others
        found.append(used_sub_tiles(baked, replace(one, vertices=vertices.copy()), [1])[0])
    assert found[0].any() and (found[0] == found[1]).all() and (found[0] == found[2]).all()
