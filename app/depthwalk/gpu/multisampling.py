"""Find out where in a pixel the hardware takes its samples, as GL does not report it everywhere."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program


def sample_offsets(device: Device, samples: int) -> NDArray[np.float64]:
    """Return the positions of the samples of a pixel, by drawing them and reading them back.

    Parameters
    ----------
    device
        The device, which must offer that many samples (`Device.max_samples`).
    samples
        Samples per pixel.

    Returns
    -------
    numpy.ndarray
        (samples, 2) float64, pixels to the right of the pixel's centre and above it.
    """
    scope = device.scope("samples")
    try:
        drawn, row = scope.multisampled_texture((1, 1), samples, 2, "f4"), scope.texture((samples, 1), 2, "f4")
        for shader, target in (("where", drawn), ("row", row)):
            program = Program(scope, "common/fullscreen.vert", f"sample/{shader}.frag")
            drawn.use(0)
            with scope.state(into=scope.framebuffer([target])):
                program.fill()
        offsets = np.frombuffer(row.read(), np.float32).reshape(samples, 2) - 0.5
    finally:
        scope.release()
    return offsets.astype(np.float64)
