"""Where the hardware takes a pixel's samples."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program


def sample_offsets(device: Device, samples: int) -> NDArray[np.float64]:
    """Where the samples of a pixel are (samples, 2), pixels to the right and up of its middle."""
    scope = device.scope("samples")
    drawn, row = scope.multisampled_texture((1, 1), samples, 2, "f4"), scope.texture((samples, 1), 2, "f4")
    for shader, target in (("where", drawn), ("row", row)):
        program = Program(scope, "common/fullscreen.vert", f"sample/{shader}.frag")
        drawn.use(0)
        with scope.state(into=scope.framebuffer([target])):
            program.fill()
    offsets = np.frombuffer(row.read(), np.float32).reshape(samples, 2) - 0.5
    scope.release()
    return offsets.astype(np.float64)
