"""One sample of each pixel at a time, out of those that were drawn."""

from pathlib import Path

import numpy as np
import pytest

from alone import MakeAlone
from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program
from depthwalk.gpu.state import ALWAYS
from depthwalk.render.passes.sample import SamplePass

SAMPLES = 4


_DRAWN = """
layout(location = 0) out uvec2 surface;
layout(location = 1) out uvec2 visibility;
void main() {
    surface = uvec2(0x01020304u, 0xf0e0d0c0u);
    visibility = uvec2(7u, 8u);
    gl_FragDepth = 0.25;
}
"""


def test_what_was_drawn_reaches_the_gbuffer(gl_device: Device, alone: MakeAlone, tmp_path: Path) -> None:
    if gl_device.max_samples < SAMPLES:
        pytest.skip("the device has fewer samples")
    sample = alone(SamplePass(), samples=SAMPLES)
    targets = sample.targets
    drawn = tmp_path / "drawn.frag"
    drawn.write_text(_DRAWN, encoding="utf-8")
    with sample.scope.state(into=targets.polygons, depth_test=ALWAYS):
        Program(sample.scope, "common/fullscreen.vert", drawn).fill()
    targets.one_sample.clear(depth=1.0)
    for number in range(SAMPLES):
        sample.draw(sample=number)
        assert (sample.read("surface", np.uint32, 2) == [0x01020304, 0xF0E0D0C0]).all()
        assert (sample.read("visibility_texture", np.uint32, 2) == [7, 8]).all()
        assert sample.read("depth", np.float32, 1) == pytest.approx(0.25, abs=1e-6)


def test_with_one_sample_there_is_nothing_to_copy(alone: MakeAlone) -> None:
    sample = alone(SamplePass())
    assert not sample.pass_.enabled(sample.frame(), sample.pass_.params)
