"""What points of impostor tiles show, in the shaders as in their twin."""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program
from depthwalk.reference.impostor_tile import Tile, across_cracks, surface_at, surface_texels
from depthwalk.types import Array

SIDE, ANGLE, NEAREST = 96, 0.01, 0.5
MIDDLE, STEPS = 0.8, 3  # λ where the search begins, and steps of it
VERTEX = """
// Tests.
uniform sampler2D atlas_depth;
uniform uint shown;
flat out vec4 tile;
flat out uint objects;
flat out float nearest;
flat out vec3 parallax;
out vec3 texel_near;
out vec3 texel_far;
void main() {
    vec2 uv = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2), side = vec2(textureSize(atlas_depth, 0));
    gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0);
    tile = vec4(0.0, 0.0, side);
    objects = shown;
    nearest = 0.5;
    parallax = vec3(1.0, 0.8, 1.0);
    texel_near = vec3(uv * side, 1.0);
    texel_far = vec3(uv * side + 8.371, 1.247);
}
"""
RESAMPLED = """
// Tests.
uniform float pixel_angle;
#include "composite/partial_coverage.glsl"
uniform sampler2D points;
layout(location = 0) out vec4 found;
layout(location = 1) out vec2 owner;
void main() {
    ivec2 texel;
    float uncovered;
    vec2 aside;
    float stored = tile_depth(texelFetch(points, ivec2(gl_FragCoord.xy), 0).xy, texel, uncovered, aside);
    found = vec4(stored, uncovered, aside);
    owner = vec2(texel);
}
"""
SEARCHED = """
// Tests.
uniform float pixel_angle;
#include "composite/parallax.glsl"
layout(location = 0) out vec4 found;
void main() { found = vec4(surface_texel(), pixel_angle); }
"""


def rough(seed: int) -> Array:
    """A tile (SIDE, SIDE) of slopes, steps, holes of a texel and of more, and empty corners."""
    rng = np.random.default_rng(seed)
    rows, columns = np.mgrid[:SIDE, :SIDE] / SIDE
    depth = 0.3 + 0.3 * columns + 0.2 * (rows > 0.5) + 0.03 * rng.random((SIDE, SIDE))
    depth[rng.random((SIDE, SIDE)) < 0.15] = 1
    depth[np.hypot(rows - 0.5, columns - 0.5) > 0.55] = 1
    return depth.astype(np.float32).astype(float)


def test_a_flat_surface_is_interpolated() -> None:
    depth = np.tile(np.linspace(0.2, 0.21, 8), (8, 1))
    points = np.random.default_rng(1).uniform(0.5, 7.5, (50, 2))
    found = surface_at(Tile(depth=depth, pixel_angle=ANGLE), points)
    assert found.stored == pytest.approx(np.interp(points[:, 0] - 0.5, np.arange(8), depth[0]))
    assert (found.owner == np.floor(points)).all() and (found.uncovered == 0).all() and (found.aside == 0).all()


def test_an_outline_runs_where_half_of_the_weight_is_empty() -> None:
    depth = np.full((6, 6), 0.2)
    depth[:, 3:] = 1
    across = np.array([2.4, 2.9, 3.1, 3.6])
    points = np.stack([across, np.full(4, 3.5)], 1)
    assert surface_at(Tile(depth=depth, pixel_angle=ANGLE), points).stored == pytest.approx([0.2, 0.2, 1, 1])
    found = surface_at(Tile(depth=depth, pixel_angle=ANGLE, partial=True), points)
    assert found.stored == pytest.approx([0.2, 0.2, 0.2, 1])  # the last is of empty texels only
    assert found.uncovered == pytest.approx([0, 0.4, 0.6, 0])
    assert found.aside[:3, 0] == pytest.approx([0, -0.2, -0.3])


@pytest.mark.parametrize(("beyond", "closes"), [(0.21, True), (0.5, False)])
def test_a_crack_in_one_surface_is_closed_and_a_gap_between_two_is_not(beyond: float, closes: bool) -> None:
    depth = np.full((5, 5), 0.2)
    depth[:, 3:] = beyond
    depth[:, 2] = 1
    at = np.array([[2, 2]])
    stored, owner = across_cracks(Tile(depth=depth, pixel_angle=ANGLE), at, at)
    assert stored == pytest.approx([beyond if closes else 1])
    assert not closes or owner.tolist() == [[3, 2]]  # the farther
    points = np.array([[2.5, 2.5]])
    assert (surface_at(Tile(depth=depth, pixel_angle=ANGLE), points).stored[0] < 1) == closes
    assert surface_at(Tile(depth=depth, pixel_angle=ANGLE, single=False), points).stored == pytest.approx([1])


def test_the_search_finds_a_plane_seen_from_elsewhere() -> None:
    """Of a plane with one λ everywhere, the texel is at this λ between those of the plane and of infinity."""
    lam = 0.6
    depth = np.full((16, 16), 1 - NEAREST * lam)
    near, far = np.array([[9.0, 8, 1]]), np.array([[5.0, 4, 1]])
    moved = np.array([True])
    found = surface_texels(
        Tile(depth=depth, pixel_angle=ANGLE), near, far, nearest=NEAREST, middle=0.9, moved=moved, steps=3
    )
    assert found == pytest.approx(far + lam * (near - far))


@pytest.mark.gl
@pytest.mark.parametrize("partial", [False, True])
@pytest.mark.parametrize("single", [False, True])
def test_the_shaders_resample_as_their_twin(gl_device: Device, tmp_path: Path, partial: bool, single: bool) -> None:
    depth = rough(2)
    points = np.random.default_rng(3).uniform(-1, SIDE + 1, (SIDE * SIDE, 2)).astype(np.float32)
    (tmp_path / "test.vert").write_text(VERTEX)
    (tmp_path / "test.frag").write_text(RESAMPLED)
    scope = gl_device.scope("test")
    program = Program(scope, tmp_path / "test.vert", tmp_path / "test.frag", ("PARTIAL",) * partial)
    scope.texture((SIDE, SIDE), 1, "f4", depth.astype(np.float32).tobytes()).use(0)
    scope.texture((SIDE, SIDE), 2, "f4", points.tobytes()).use(1)
    program.set(atlas_depth=0, points=1, shown=1 if single else 2, pixel_angle=ANGLE)
    written = [scope.texture((SIDE, SIDE), 4, "f4"), scope.texture((SIDE, SIDE), 2, "f4")]
    with scope.state(into=scope.framebuffer(written)):
        program.fill()
    found, owner = (np.frombuffer(texture.read(), np.float32).reshape(SIDE * SIDE, -1) for texture in written)
    scope.release()
    twin = surface_at(Tile(depth=depth, pixel_angle=ANGLE, single=single, partial=partial), points.astype(float))
    shown = twin.stored < 1
    off = np.abs(found - np.column_stack([twin.stored, twin.uncovered, twin.aside])).max(1)
    assert np.mean(off < 1e-4) > 0.999  # others lie between two cases
    assert (owner == twin.owner)[shown].all(1).mean() > 0.999
    assert 0.4 < shown.mean() < 0.95


@pytest.mark.gl
def test_the_shader_searches_as_its_twin(gl_device: Device, tmp_path: Path) -> None:
    depth = rough(4)
    (tmp_path / "test.vert").write_text(VERTEX)
    (tmp_path / "test.frag").write_text(SEARCHED)
    scope = gl_device.scope("test")
    program = Program(scope, tmp_path / "test.vert", tmp_path / "test.frag", (f"STEPS={STEPS}",))
    scope.texture((SIDE, SIDE), 1, "f4", depth.astype(np.float32).tobytes()).use(0)
    program.set(atlas_depth=0, shown=1, pixel_angle=ANGLE)
    target = scope.texture((SIDE, SIDE), 4, "f4")
    with scope.state(into=scope.framebuffer([target])):
        program.fill()
    found = np.frombuffer(target.read(), np.float32).reshape(-1, 4)[:, :3]
    scope.release()
    pixels = np.stack(np.meshgrid(*[np.arange(SIDE) + 0.5] * 2), -1).reshape(-1, 2)
    near, far = (
        np.column_stack([pixels + shift, np.full(len(pixels), w)]) for shift, w in ((0.0, 1.0), (8.371, 1.247))
    )
    moved = np.ones(len(pixels), bool)
    tile = Tile(depth=depth, pixel_angle=ANGLE)
    twin = surface_texels(tile, near, far, nearest=NEAREST, middle=MIDDLE, moved=moved, steps=STEPS)
    off = np.abs(found - twin).max(1)
    assert np.mean(off < 1e-3) > 0.995  # others looked at the next texel
    assert np.abs(twin - far - MIDDLE * (near - far)).max(1).mean() > 0.3  # the search leads somewhere
