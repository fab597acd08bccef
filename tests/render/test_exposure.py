"""What hardly anybody outside sees is told from what a few do, and looked up in fewer texels."""

from dataclasses import replace

import numpy as np
import pytest

from depthwalk.bake.face_grid import FaceGrid
from depthwalk.render.exposure import hardly_seen
from depthwalk.render.pages import build_pages
from depthwalk.render.residency import BLOCK
from depthwalk.render.surface_levels import build_levels
from shapes import bake, sphere


def bottle(opening):
    """A thin shell around (0, 1, 0), of radius 1, without what is higher than `opening`."""
    whole = sphere(columns=96, rows=64)
    kept = whole.positions[whole.faces][..., 1].mean(1) < opening
    return replace(whole, faces=whole.faces[kept], parts=(replace(whole.parts[0], face_count=int(kept.sum())),))


@pytest.fixture(scope="module")
def narrow():
    baked = bake(bottle(1.99), resolution=160, layers=2)
    return baked, build_levels(baked)


def test_the_inside_of_a_bottle_is_hardly_seen(narrow):
    baked, grids = narrow
    hidden = hardly_seen(baked, grids)
    inside = [
        np.einsum("hwi,hwi->hw", image.normal, FaceGrid.of(baked.cylinder, image).points(image.depth)) < 0
        for image in baked.images
    ]
    for image, blocks, inner in zip(baked.images, hidden, inside, strict=True):
        found = np.isfinite(image.depth)[BLOCK // 2 :: BLOCK, BLOCK // 2 :: BLOCK]
        if image.layer == 0:
            assert not blocks.any()
        elif found.sum() > 20:
            assert inner[np.isfinite(image.depth)].mean() > 0.9
            assert blocks[found].mean() > 0.8, image.name


def test_a_bowl_is_seen():
    baked = bake(bottle(1.0), resolution=160, layers=2)
    assert not hardly_seen(baked, build_levels(baked)).any()


def test_it_is_stored_in_fewer_texels(narrow, monkeypatch):
    baked, grids = narrow
    few = build_pages(baked, grids)
    monkeypatch.setattr("depthwalk.render.exposure._LEAST", 0.0)
    assert few.normals.size < 0.75 * build_pages(baked, grids).normals.size
