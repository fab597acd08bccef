"""Where the samples of a pixel lie."""

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.gpu.multisampling import sample_offsets


@pytest.mark.parametrize("samples", [2, 4])
def test_samples_lie_apart_within_the_pixel(gl_device: Device, samples: int) -> None:
    if gl_device.max_samples < samples:
        pytest.skip("no shaders per sample here")
    before = dict(+gl_device.live)
    offsets = sample_offsets(gl_device, samples)
    assert dict(+gl_device.live) == before
    assert offsets.shape == (samples, 2) and (np.abs(offsets) <= 0.5).all()
    assert len(np.unique(offsets, axis=0)) == samples
    assert offsets.mean(0) == pytest.approx([0, 0], abs=0.3)
