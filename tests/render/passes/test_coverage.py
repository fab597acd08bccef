"""Pixels that are covered in part show as much of what is behind them."""

from types import SimpleNamespace

import numpy as np
import pytest

from alone import Alone, MakeAlone
from depthwalk.cook.lod_geometry import IMAGE_BITS
from depthwalk.render.draw.material_depth import FULL_COVERAGE
from depthwalk.render.passes.coverage import CoveragePass
from depthwalk.scene.render_settings import RenderSettings
from modes import AaName

UNCOVERED = 4 / 12  # of the steps that the visibility buffer has for it
IN_THE_MIDDLE = 0b1010 << 4  # of the pixel, where the surface is seen
SHADING = SimpleNamespace(assets=np.array([0]), low=np.array([[-1.0, -1.0]]), high=np.array([[1.0, 1.0]]))
COLUMN = 6


@pytest.fixture
def silhouette(alone: MakeAlone) -> Alone:
    """Red depth images on the left, 2 m away, up to a column that they cover in part; white far behind on the right."""
    coverage = alone(CoveragePass())
    targets, (width, height) = coverage.targets, coverage.view.size
    near, far = coverage.view.depth_range
    depth = far / (far - near) - near * far / (far - near) / 2.0
    light, visibility = np.ones((height, width, 4)), np.zeros((height, width, 2), np.uint32)
    light[:, : COLUMN + 1] = 1, 0, 0, 1
    inverse = np.array([0.5], np.float32).view(np.uint32)[0] & ~np.uint32(255)
    visibility[:, : COLUMN + 1] = 1 << IMAGE_BITS, inverse
    visibility[:, COLUMN, 1] |= np.uint32(round(12 * UNCOVERED) | IN_THE_MIDDLE)
    targets.lighting.clear(depth=1.0)
    targets.lighting.clear(depth=depth, viewport=(0, 0, COLUMN + 1, height))
    coverage.fill_lit(light)
    targets.visibility_texture.write(visibility.tobytes())
    targets.material_depth.clear(depth=1.0)
    targets.material_depth.clear(depth=FULL_COVERAGE + 0.1, viewport=(0, 0, COLUMN, height))
    targets.material_depth.clear(depth=0.1, viewport=(COLUMN, 0, 1, height))
    return coverage


def test_a_pixel_shows_what_it_leaves_uncovered(silhouette: Alone) -> None:
    before = silhouette.lit()
    silhouette.draw(materials=SHADING)
    after = silhouette.lit()
    assert after[:, COLUMN, 0] == pytest.approx(1.0)
    assert after[:, COLUMN, 1] == pytest.approx(UNCOVERED, abs=2e-3)
    others = np.delete(np.arange(before.shape[1]), COLUMN)
    np.testing.assert_array_equal(after[:, others], before[:, others])


@pytest.mark.parametrize(
    ("aa", "assets", "expected"), [("coverage", 1, True), ("coverage", 0, False), ("none", 1, False)]
)
def test_it_is_asked_for_and_there_are_depth_images(silhouette: Alone, aa: AaName, assets: int, expected: bool) -> None:
    materials = SimpleNamespace(assets=np.arange(assets))
    frame = silhouette.frame(settings=RenderSettings.model_validate({"aa": aa}), materials=materials)
    assert silhouette.pass_.enabled(frame, silhouette.pass_.params) is expected
