"""One sample of each pixel at a time, out of those that were drawn."""

import numpy as np
import pytest

from alone import MakeAlone
from depthwalk.gpu.device import Device
from depthwalk.render.passes.sample import SamplePass

SAMPLES = 4


def test_what_was_drawn_reaches_the_gbuffer(gl_device: Device, alone: MakeAlone) -> None:
    if gl_device.max_samples < SAMPLES:
        pytest.skip("the device has fewer samples")
    sample = alone(SamplePass(), samples=SAMPLES)
    targets = sample.targets
    targets.one_sample.clear(depth=1.0)
    targets.polygons.clear(0.2, 0.4, 0.6, 0.8, depth=0.25)
    for number in range(SAMPLES):
        sample.draw(sample=number)
        assert sample.read("albedo", np.uint8, 4)[3, 5] == pytest.approx([51, 102, 153, 204], abs=1)
        assert sample.read("surface", np.uint16, 4)[3, 5] == pytest.approx(
            np.array([0.2, 0.4, 0.6, 0.8]) * 65535, abs=1
        )
        assert sample.read("depth", np.float32, 1) == pytest.approx(0.25, abs=1e-6)


def test_with_one_sample_there_is_nothing_to_copy(alone: MakeAlone) -> None:
    sample = alone(SamplePass())
    assert not sample.pass_.enabled(sample.frame(), sample.pass_.params)
