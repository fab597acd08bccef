"""Where in a pixel an impostor's surface is seen, of four texels (shaders/composite/partial_coverage.glsl)."""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program
from depthwalk.types import Array

COUNT = 9  # pixels across, from the middle of the second column of texels to that of the third
NEAR, ANGLE = 0.2, 0.01  # stored depth on the left; of a pixel, radians
TOLERANCE = 8 * ANGLE * (1 - NEAR)  # that one surface may differ by from texel to texel
ACROSS = np.linspace(0, 1, COUNT + 2)[1:-1]  # part of the way from column to column
VERTEX = """
flat out vec4 tile;
flat out uint objects;
out vec2 uv;
void main() {
    uv = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0);
    tile = vec4(0.0, 0.0, 4.0, 4.0);
    objects = 1u;
}
"""
FRAGMENT = """
uniform float pixel_angle;
uniform float count;
in vec2 uv;
#include "composite/partial_coverage.glsl"
layout(location = 0) out vec4 found;
void main() {
    ivec2 nearest;
    float uncovered;
    vec2 aside;
    float across = (uv.x * count + 0.5) / (count + 1.0);
    float stored = tile_depth(vec2(1.5 + across, 2.0), nearest, uncovered, aside);
    found = vec4(stored, aside.x, uncovered, float(nearest.x));
}
"""


def seen(device: Device, folder: Path, right: float) -> Array:
    """What pixels (COUNT, 4) between texels of depths NEAR and `right` show: depth, how far right, uncovered, owner."""
    for name, text in (("test.vert", VERTEX), ("test.frag", FRAGMENT)):
        (folder / name).write_text(f"// Tests.\n{text}")
    scope = device.scope("test")
    try:
        program = Program(scope, folder / "test.vert", folder / "test.frag", ("PARTIAL",))
        depth = np.tile(np.array([NEAR, NEAR, right, right], np.float32), (4, 1))
        scope.texture((4, 4), 1, "f4", depth.tobytes()).use(0)
        program.set(atlas_depth=0, pixel_angle=ANGLE, count=float(COUNT))
        target = scope.texture((COUNT, 1), 4, "f4")
        with scope.state(into=scope.framebuffer([target])):
            program.fill()
        return np.frombuffer(target.read(), np.float32).reshape(COUNT, 4).astype(float)
    finally:
        scope.release()


@pytest.mark.parametrize("part", [0.1, 0.6])
def test_a_steep_surface_is_seen_on_it_and_not_in_the_air(gl_device: Device, tmp_path: Path, part: float) -> None:
    """A gentle slope is interpolated. Halfway up a step there is nothing: a point there looks up the colours of another
    place, dark specks along edges, so the pixel shows what the nearer texel does, as far aside as that lies."""
    right = NEAR + part * TOLERANCE
    depth, aside, uncovered, owner = seen(gl_device, tmp_path, right).T
    second = (ACROSS >= 0.5).astype(float)
    assert uncovered == pytest.approx(0, abs=1e-6) and owner == pytest.approx(1 + second)
    if part < 0.3:
        assert depth == pytest.approx(NEAR + ACROSS * (right - NEAR), abs=1e-6) and aside == pytest.approx(0, abs=1e-6)
    else:
        assert depth == pytest.approx(np.where(second > 0, right, NEAR), abs=1e-6)
        assert aside == pytest.approx(0.5 * (second - ACROSS), abs=1e-5)  # texels are half a pixel wide


def test_of_two_surfaces_the_one_in_front_is_seen_and_leaves_the_rest_uncovered(
    gl_device: Device, tmp_path: Path
) -> None:
    """Else an outline before a wall has the wall's colour, or no soft edge."""
    depth, aside, uncovered, owner = seen(gl_device, tmp_path, NEAR + 1.5 * TOLERANCE).T
    assert depth == pytest.approx(NEAR, abs=1e-6) and owner == pytest.approx(1)
    assert uncovered == pytest.approx(ACROSS, abs=1e-5) and aside == pytest.approx(-0.5 * ACROSS, abs=1e-5)
