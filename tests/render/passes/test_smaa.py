"""Edges of brightness redrawn as lines, against areas that are known."""

import moderngl
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from depthwalk.gpu.device import Device
from depthwalk.gpu.shader_source import ShaderSource
from depthwalk.reference.smaa import areas_cut
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.scene import Scene
from depthwalk.types import Array
from shapes import ShapeLibrary, mesh_of, scene_of
from studio import Studio

SIZE = (160, 120)
CAMERA = Camera((0, 1, 5), (0, 1, 0), 0.7)


@pytest.fixture(scope="module")
def edges() -> tuple[Array, Array, Array]:
    """Ends, and heights at both, of 500 random edges of pixels."""
    rng = np.random.default_rng(4)
    before, after = rng.integers(0, 20, (2, 500)).astype(np.float32)
    return before, after, rng.integers(-1, 2, (500, 2)).astype(np.float32) / 2


def test_what_a_line_cuts_off_is_an_area(edges: tuple[Array, Array, Array]) -> None:
    """By counting, along both halves of the line."""
    for before, after, heights in zip(*edges, strict=True):
        span = before + 1 + after
        at = (before + (np.arange(2000) + 0.5) / 2000) / span
        line = np.interp(at, (0, 0.5, 1), (heights[0], 0, heights[1]))
        exact = np.maximum(line, 0).mean(), np.maximum(-line, 0).mean()
        assert areas_cut(before, after, heights) == pytest.approx(exact, abs=1e-3)


def test_the_shader_matches_its_twin(gl_device: Device, edges: tuple[Array, Array, Array]) -> None:
    source = ShaderSource("smaa/line.glsl").text + (
        "in float before, after; in vec2 heights; out vec2 areas;\n"
        "void main() { areas = areas_cut(before, after, heights); }\n"
    )
    scope = gl_device.scope("test")
    program = gl_device.context.program(vertex_shader=source, varyings=("areas",))
    content = [(scope.buffer(np.column_stack(edges)), "1f 1f 2f", "before", "after", "heights")]
    array = gl_device.context.vertex_array(program, content)
    out = scope.buffer(reserve=8 * 500)
    scope.framebuffer([scope.texture((4, 4), 4)]).use()
    array.transform(out, moderngl.POINTS, vertices=500)
    found = np.frombuffer(out.read(), np.float32).reshape(500, 2)
    array.release()
    program.release()
    scope.release()
    assert found == pytest.approx(areas_cut(*edges), abs=1e-6)


def half_plane(angle: float) -> tuple[Scene, ShapeLibrary]:
    """What is above a line through the middle of the picture, at so many radians to the horizontal."""
    turn = Rotation.from_euler("z", angle).as_matrix()
    corners = np.array([[-9, 0, 0], [9, 0, 0], [9, 9, 0], [-9, 9, 0]])
    mesh = mesh_of([0, 1, 0] + corners @ turn.T, [[0, 1, 2], [0, 2, 3]], np.tile([0.0, 0, 1], (4, 1)))
    return scene_of((0, (0, 0, 0), 0.0, 1.0), representation=Representation.MESH), ShapeLibrary([mesh], [None])


def test_edges_are_followed_as_far_as_is_set(studio: Studio) -> None:
    """Along steps of 40 pixels, so many next to each step are blended, on either side of it."""
    scene, library = half_plane(1 / 40)
    hard = studio.picture(scene, library, CAMERA, SIZE, transparent=True)[..., 3]
    scene.render.aa = "smaa"
    for distance in (2, 8):
        scene.render.smaa.max_search_distance = distance
        alpha = studio.picture(scene, library, CAMERA, SIZE, transparent=True)[..., 3]
        blended = np.flatnonzero((alpha != hard).any(0))
        runs = np.split(blended, np.flatnonzero(np.diff(blended) > 1) + 1)
        assert [len(run) for run in runs] == 4 * [2 * distance]


@pytest.mark.parametrize("angle", [0.07, 0.2, 0.45, 1.3, 1.85, 3.3])
def test_a_half_plane_is_covered_in_part(studio: Studio, angle: float) -> None:
    """Root mean square of the error in alpha along its border. Without it is that of a coin, 0.29; lines near the
    diagonal make edges that are too short to tell them."""
    scene, library = half_plane(angle)
    scene.render.aa = "smaa"
    alpha = studio.picture(scene, library, CAMERA, SIZE, transparent=True)[..., 3]
    scene.render.aa = "none"
    fine = studio.picture(scene, library, CAMERA, (SIZE[0] * 8, SIZE[1] * 8), transparent=True)[..., 3]
    exact = fine.reshape(SIZE[1], 8, SIZE[0], 8).mean((1, 3))
    middle = np.s_[10:-10, 10:-10]  # an edge that leaves the picture is not known to its end
    border = ((exact > 0) & (exact < 1))[middle]
    assert np.sqrt(np.mean((alpha - exact)[middle][border] ** 2)) < 0.11
    assert np.abs(alpha - exact)[middle][~border].max() < 0.3
