"""Edges of brightness are blurred, and nothing else."""

import numpy as np
import pytest

from alone import MakeAlone
from depthwalk.reference.fxaa import fxaa
from depthwalk.render.passes.fxaa import FxaaPass
from depthwalk.scene.render_settings import RenderSettings


def test_only_its_own_mode_enables_it(alone: MakeAlone) -> None:
    fxaa = alone(FxaaPass())
    for aa, expected in (("fxaa", True), ("smaa", False), ("none", False)):
        frame = fxaa.frame(settings=RenderSettings.model_validate({"aa": aa}))
        assert fxaa.pass_.enabled(frame, fxaa.pass_.params) is expected


def test_gradual_light_stays_as_it_is(alone: MakeAlone) -> None:
    fxaa = alone(FxaaPass())
    light = np.ones((8, 12, 4)) * np.linspace(0.5, 0.52, 12)[:, None]
    light[..., 3] = 1
    fxaa.fill_lit(light)
    before = fxaa.lit()
    fxaa.draw()
    np.testing.assert_array_equal(fxaa.lit(), before)


def test_a_stair_is_smoothed_beside_its_step(alone: MakeAlone) -> None:
    fxaa = alone(FxaaPass())
    light = np.zeros((8, 12, 4))
    light[..., 3] = 1
    light[:4, :6, :3], light[:5, 6:, :3] = 1, 1  # an edge along x that rises by a pixel in the middle
    fxaa.fill_lit(light)
    fxaa.draw()
    after = fxaa.lit()[..., 0]
    assert ((after > 0.05) & (after < 0.95))[3:6, 5:7].any()
    np.testing.assert_array_equal(after[:2], 1)  # far from the edge
    np.testing.assert_array_equal(after[-2:], 0)


def test_the_shader_matches_its_twin(alone: MakeAlone) -> None:
    """Noise over steps of brightness, between pixels that are partly transparent."""
    made, random = alone(FxaaPass()), np.random.default_rng(2)
    light = np.ones((8, 12, 4)) * np.repeat([0.05, 0.8, 0.3], 4)[:, None] * random.uniform(0.6, 1, (8, 12, 1))
    light[3:, :, :3] *= 0.4
    light[..., 3] = np.where(random.random((8, 12)) < 0.2, 0.5, 1.0)
    made.fill_lit(light)
    before = made.lit()
    made.draw()
    expected = fxaa(before, made.pass_.params.edge_threshold)
    assert (expected != before).any(-1).mean() > 0.5
    assert made.lit() == pytest.approx(expected, abs=2e-3)
