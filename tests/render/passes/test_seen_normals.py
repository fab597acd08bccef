"""The normal of a visible surface never faces away from who sees it (shaders/common/seen_surface.glsl)."""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program

ANGLES = np.radians([0, 60, 89, 91, 100, 108, 112, 135, 180])  # between the normal and the way to the viewer
VIEW = np.array([0.48, -0.6, -0.64])  # from the viewer to the surface
ASIDE = np.array([0.8, 0.0, 0.6])
FRAGMENT = """
#include "common/seen_surface.glsl"
uniform vec3 to_surface;
uniform vec3 aside;
uniform float angles[9];
layout(location = 0) out vec4 found;
void main() {
    float angle = angles[int(gl_FragCoord.x)];
    found = vec4(seen_normal(sin(angle) * aside - cos(angle) * to_surface, to_surface), 0.0);
}
"""


@pytest.mark.gl
def test_normals_that_face_away_are_those_of_a_thin_things_other_side(gl_device: Device, tmp_path: Path) -> None:
    """Else a bush has half as many black specks again where the sun is behind the viewer, and light from behind an
    object shows on its outline."""
    (tmp_path / "test.frag").write_text(f"// Tests.\n{FRAGMENT}")
    scope = gl_device.scope("test")
    try:
        program = Program(scope, "common/fullscreen.vert", tmp_path / "test.frag")
        program.set(to_surface=tuple(VIEW), aside=tuple(ASIDE), angles=ANGLES.tolist())
        target = scope.texture((len(ANGLES), 1), 4, "f4")
        with scope.state(into=scope.framebuffer([target])):
            program.fill()
        found = np.frombuffer(target.read(), np.float32).reshape(-1, 4)[:, :3]
    finally:
        scope.release()
    normal = np.sin(ANGLES)[:, None] * ASIDE - np.cos(ANGLES)[:, None] * VIEW
    expected = np.concatenate([normal[:3], [ASIDE] * 3, -normal[6:]])  # to 20° away: the nearest that does not
    assert pytest.approx(0) == VIEW @ ASIDE and found == pytest.approx(expected, abs=1e-5)
    assert (found @ VIEW).max() < 1e-5
