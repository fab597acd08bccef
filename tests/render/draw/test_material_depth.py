"""What is in front, told apart by number, and shaded once per pixel."""

from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from moderngl import Texture

from depthwalk.cook.lod_geometry import IMAGE_BITS
from depthwalk.gpu.device import Device
from depthwalk.gpu.instances import RecordTexture
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import LESS
from depthwalk.render.draw.draw_lists import ImpostorDraws
from depthwalk.render.draw.material_depth import FULL_COVERAGE, MATERIAL_DEPTH_STEPS, SURFACE_RECORD
from depthwalk.render.image import read_pixels
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.bounds import Bounds, extents
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from shapes import ShapeLibrary, box, leaves, scene_of, sphere
from stage import OnScreen, Stage, view_of
from studio import Studio

SIZE = (240, 180)


def test_spheres_lie_within_their_extents() -> None:
    """Random points of random spheres, some about the viewer, as the camera sees them."""
    rng = np.random.default_rng(3)
    view = View(Camera((1.0, 2.0, 5.0), (0.5, 1.0, 0.0), 0.9), SIZE, near=0.1, far=100)
    bounds = Bounds(rng.uniform(-8, 8, (500, 3)), rng.uniform(0.1, 3, 500))
    low, high = extents(view, bounds)
    direction = rng.normal(size=(500, 40, 3))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    points = bounds.centre[:, None] + direction * bounds.bounding_radius[:, None, None]
    x, y, forward = np.moveaxis((points - view.position) @ view.axes.T, -1, 0)
    seen = np.stack([x, y], -1) / np.where(forward > 0.1, forward, np.nan)[..., None] / view.half_extent
    outside = ((seen < low[:, None] - 1e-9) | (seen > high[:, None] + 1e-9)) & (np.abs(seen) <= 1).all(
        -1, keepdims=True
    )
    assert not outside.any()
    assert ((high - low).prod(1) < 1).mean() > 0.2  # of 4: they are not all the whole picture


def test_records_are_fetched_by_number(gl_device: Device) -> None:
    """More than a row of them, and more than there was room for at first; number 0 is no object."""
    records = np.zeros(2500, SURFACE_RECORD)
    records["material_depth"][:, 0] = np.arange(2500) / 65536
    records["material_depth"][0, 0] = 1
    scope = gl_device.scope("test")
    texture = RecordTexture(scope, SURFACE_RECORD)
    texture.upload(records[:10])
    texture.upload(records)
    numbers = np.array([[0, 7, 1023, 1024], [2047, 2048, 2400, 2499]])
    visible = scope.texture(
        (4, 2), 2, "u4", np.stack([numbers << IMAGE_BITS, 0 * numbers], -1).astype(np.uint32).tobytes()
    )
    out = scope.depth_texture((4, 2))
    framebuffer = scope.framebuffer([], out)
    framebuffer.use()
    framebuffer.clear(depth=1.0)
    program = Program(scope, "common/rectangle.vert", "material_resolve/material_depth.frag")
    program.set(corners=(-1.0, -1.0, 1.0, 1.0), objects=0, visibility_texture=1)
    texture.use(0)
    visible.use(1)
    with scope.state(depth_test=LESS):
        program.rectangles()
    found = np.frombuffer(out.read(), np.float32).reshape(2, 4)
    assert found == pytest.approx(np.where(numbers == 0, 1, numbers / 65536), abs=1e-7)
    scope.release()


def test_depths_of_assets_are_the_same_however_a_gpu_rounds_them() -> None:
    """To 24 bits: exactly, or in float32, which below 1 is no finer; to the nearest, or by adding a half."""
    part = np.arange(1, int(FULL_COVERAGE * MATERIAL_DEPTH_STEPS)) / MATERIAL_DEPTH_STEPS
    assert len(part) > 1 << 16  # assets
    for depth in (part, FULL_COVERAGE + part):
        single, steps = depth.astype(np.float32), np.float32((1 << 24) - 1)
        np.testing.assert_array_equal(single, depth)
        stored = np.rint(depth * ((1 << 24) - 1))
        np.testing.assert_array_equal(np.rint(single * steps), stored)
        np.testing.assert_array_equal(np.floor(single * steps + np.float32(0.5)), stored)
        in_clip_space = np.float32(2) * single - np.float32(1)  # as rectangle.vert has it
        np.testing.assert_array_equal(np.float32(0.5) * in_clip_space + np.float32(0.5), single)
        assert (np.diff(stored) >= 1).all()


@pytest.mark.parametrize("position", [(0.3, 1.2, 4.2), (0.4, 0.9, 1.2)])
def test_pixels_as_texels_show_what_resampling_shows(
    gl_device: Device, monkeypatch: pytest.MonkeyPatch, position: tuple[float, float, float]
) -> None:
    """The same tiles by either variant of pass 2: where texels are pixels there is nothing to resample."""
    library = ShapeLibrary([sphere(0.5, 48, 24), box(0.8, 0.8, 0.8)], resolution=64)
    scene = scene_of((0, (-0.6, 0, 0), 0.3, 1.0), (1, (0.6, 0, -0.5), 0.5, 1.0), sky={})
    scope = gl_device.scope("test")
    screen = scope.framebuffer([scope.texture(SIZE, 4)])
    renderer = Renderer(gl_device, scene, library)
    pictures = []
    for whole in (False, True):
        renderer.render(View(Camera(position, (0, 0.4, 0), 0.9), SIZE), screen)
        assert renderer.plan is not None
        assert renderer.plan.composite.aligned == (0 if whole else 2)
        pictures.append(read_pixels(screen).astype(int))
        monkeypatch.setattr(
            "depthwalk.render.draw.planner.ImpostorDraws",
            lambda records, aligned, rows: ImpostorDraws(records=records, aligned=0, rows=rows),
        )
    renderer.release()
    scope.release()
    difference = np.abs(pictures[0] - pictures[1]).max(-1)
    assert (difference > 2).mean() < 1e-3
    assert np.ptp(pictures[0][..., :3]) > 100


def test_a_variant_is_made_when_asked_for(gl_device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "one"
    folder.mkdir()
    (folder / "a.vert").write_text("void main() { gl_Position = vec4(0.0); }\n")
    (folder / "a.frag").write_text(
        "uniform float plain;\n#ifdef SPECIAL\nuniform float special;\n#else\nconst float special = 0.0;\n#endif\n"
        "out vec4 c;\nvoid main() { c = vec4(plain + special); }\n"
    )
    monkeypatch.setattr("depthwalk.gpu.shader_source.shader_root", lambda: tmp_path)
    scope = gl_device.scope("test")
    programs = Variants(lambda defines: Program(scope, "one/a.vert", "one/a.frag", defines))
    assert not programs
    assert "special" not in programs[()].gl and "special" in programs["SPECIAL",].gl
    assert programs[()] is programs[()] and len(programs) == 2
    scope.release()


@pytest.mark.parametrize("show_tiles", [False, True])
def test_an_asset_alone_looks_as_it_does_among_others(
    gl_device: Device, monkeypatch: pytest.MonkeyPatch, show_tiles: bool
) -> None:
    """Its pixels told by the depth buffer, and by depths that stand for assets."""
    scene = scene_of((0, (-0.6, 0, 0), 0.3, 1.0), (0, (0.6, 0, -0.5), 0.5, 1.0), sky={})
    scene.render.composite.show_tiles = show_tiles
    scope = gl_device.scope("test")
    screen = scope.framebuffer([scope.texture(SIZE, 4)])
    renderer = Renderer(gl_device, scene, ShapeLibrary([box(0.8, 0.8, 0.8)], resolution=64))
    pictures, levels = [], []
    for _ in range(2):
        renderer.render(View(Camera((0.3, 1.2, 4.2), (0, 0.4, 0), 0.9), SIZE), screen)
        pictures.append(read_pixels(screen))
        assert renderer.targets is not None
        attachment = renderer.targets.material_depth.depth_attachment
        assert isinstance(attachment, Texture)
        levels.append(np.frombuffer(attachment.read(), np.float32))
        monkeypatch.setattr("depthwalk.render.passes.material_resolve._alone", lambda frame, shading: False)
    assert not (levels[0] == levels[1]).all()
    np.testing.assert_array_equal(pictures[0], pictures[1])
    renderer.release()
    scope.release()


@pytest.mark.parametrize("mode", ["deferred", "forward"])
def test_leaves_show_the_side_that_is_seen(studio: Studio, mode: Literal["deferred", "forward"]) -> None:
    """Simplified ones, from all around: no normal faces away, and they are as light as those of the mesh."""
    library, light = ShapeLibrary([leaves(400, 0.12)], resolution=48), []
    for representation in (Representation.MESH, Representation.DPCI):
        scene = scene_of((0, (0, 0, 0), 0.0, 1.0), representation=representation, sun={"direction": (0, -1, 0)})
        scene.render.light.mode, scene.render.lod.error = mode, 4.0
        with Stage(studio, scene, library, sun=False) as stage:
            for angle in np.arange(8) * np.pi / 4:
                view = view_of((2.2 * np.sin(angle), 0.8, 2.2 * np.cos(angle)), (0, 0.5, 0))
                stage.draw(view)
                sight, there = stage.points() - view.position, stage.points()[..., 1] > -100
                sight /= np.linalg.norm(sight, axis=-1, keepdims=True)
                assert there.sum() > 1000 and (stage.normals() * sight).sum(-1)[there].max() < 0.01
                light.append(stage.lit()[there].mean())
    assert np.mean(light[8:]) == pytest.approx(np.mean(light[:8]), rel=0.02)


@pytest.mark.parametrize("count", [1, 3])
def test_looking_surfaces_up_costs_some_times_what_lighting_them_does(gl_device: Device, count: int) -> None:
    """One to five times, the least of several frames. Where lanes without a surface began at a segment far below 0, a
    software rasteriser walked through some hundred times that, and all pictures stayed right."""
    library = ShapeLibrary([sphere(0.5 + 0.1 * k, 128, 64) for k in range(count)], resolution=128, layers=1)
    scene = scene_of(*((k, (1.2 * k - 0.6 * (count - 1), 0, 0), 0.0, 1.0) for k in range(count)))
    with OnScreen(gl_device, scene, library) as stage:
        times = []
        for _ in range(8):
            stage.renderer.timers.time_next()
            stage.draw(view_of((0.0, 0.5, 2.0), (0.0, 0.5, 0.0)))
            times.append(
                [stage.renderer.timers.milliseconds.get(name, np.inf) for name in ("material_resolve", "light")]
            )
    resolve, light = np.min(times, axis=0)
    assert resolve < 30 * light
