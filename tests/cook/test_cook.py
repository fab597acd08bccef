"""What cooking yields: grids or simplified levels, and what drawing must know before it loads them."""

import numpy as np
import pytest

from depthwalk.bake.images import BakedObject, Face
from depthwalk.cook.cook import CookedObject, CookOptions, bare_image, cook_object
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.geometry.bounding_hull import CORNERS
from shapes import bake, leaves, sphere


@pytest.fixture(scope="module")
def ball() -> BakedObject:
    return bake(sphere(0.5, 48, 24), 40)


@pytest.fixture(scope="module")
def cooked(ball: BakedObject) -> CookedObject:
    return cook_object(ball, CookOptions())


def test_small_solid_objects_are_grids(ball: BakedObject, cooked: CookedObject) -> None:
    geometry, _ = cooked.load()
    np.testing.assert_array_equal(geometry.indices, build_grid_lods(ball).indices)


@pytest.mark.slow
def test_foliage_is_simplified_at_any_size() -> None:
    foliage = bake(leaves(200, 0.1), 32)
    simplified, stepped = (cook_object(foliage, CookOptions(stepped=stepped)).load()[0] for stepped in (False, True))
    assert len(simplified.drawn(0)) < 0.4 * len(stepped.drawn(0))
    assert (simplified.texels == -1).all() and (stepped.texels >= 0).any()


def test_large_images_are_simplified(monkeypatch: pytest.MonkeyPatch, ball: BakedObject) -> None:
    monkeypatch.setattr("depthwalk.cook.cook.GRID_TEXELS", 32)
    assert len(cook_object(ball, CookOptions()).load()[0].drawn(0)) < 0.5 * len(build_grid_lods(ball).drawn(0))


def test_drawing_knows_the_object_before_it_is_loaded(ball: BakedObject, cooked: CookedObject) -> None:
    geometry, texture = cooked.load()
    assert cooked.first is geometry.first and cooked.error is geometry.error
    assert cooked.hull.shape == (CORNERS, 3)
    centre = [0, (ball.cylinder.bottom + ball.cylinder.top) / 2, 0]
    assert np.linalg.norm(cooked.hull - centre, axis=1) == pytest.approx(0.5, rel=0.1)
    assert cooked.bytes > geometry.vertices.nbytes + texture.normals.nbytes
    outline = cooked.outline
    assert outline.cylinder == ball.cylinder and not outline.boundary_strips
    assert [image.depth.shape for image in outline.images] == [image.depth.shape for image in ball.images]


def test_a_bare_image_is_empty_and_takes_no_memory() -> None:
    image = bare_image(Face.TOP, 2, (512, 256))
    assert image.depth.shape == (512, 256) and np.isinf(image.depth).all() and image.layer == 2
    assert image.depth.strides == (0, 0) and image.albedo.shape == (512, 256, 4) and (image.owner == Face.TOP).all()
