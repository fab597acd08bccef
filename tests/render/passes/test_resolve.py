"""The mean of a pixel's samples, and the depth of the nearest."""

import numpy as np
import pytest

from alone import MakeAlone
from depthwalk.gpu.device import Device
from depthwalk.render.passes.resolve import ResolvePass

SAMPLES = 4


def test_light_is_averaged_and_the_nearest_depth_kept(gl_device: Device, alone: MakeAlone) -> None:
    if gl_device.max_samples < SAMPLES:
        pytest.skip("the device has fewer samples")
    resolve = alone(ResolvePass(), samples=SAMPLES)
    resolve.targets.visibility.clear(depth=0.75)
    for repeat in range(2):  # the second frame starts from nothing again
        for number in range(SAMPLES):
            resolve.targets.lighting.clear(depth=1.0)
            resolve.fill_lit((float(number), 8.0 * (number == 2), repeat, 1.0))
            resolve.draw(sample=number)
        expected = [1.5, 2.0, repeat, 1.0]
        assert resolve.lit() == pytest.approx(np.broadcast_to(expected, resolve.lit().shape), abs=2e-3)
        assert resolve.read("depth", np.float32, 1) == pytest.approx(0.75, abs=1e-6)


def test_with_one_sample_there_is_nothing_to_average(alone: MakeAlone) -> None:
    resolve = alone(ResolvePass())
    assert not resolve.pass_.enabled(resolve.frame(), resolve.pass_.params)
