"""The three cases: which pieces of an object are left out, that nobody sees them, and that no picture changes."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from depthwalk.assets.library import SceneLibrary
from depthwalk.cook.cases import (
    ALL_PIECES,
    BOTTOM_PIECE,
    PIECES,
    TOP_PIECE,
    Case,
    drawn_cases,
    piece_horizons,
    piece_numbers,
    piece_runs,
    seen_pieces,
)
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.simplified_lods import build_simplified_lods
from depthwalk.gpu.device import Device
from depthwalk.render.draw import object_detail as plan
from depthwalk.render.image import read_pixels
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.scene.scene import Scene
from depthwalk.types import Array, Mask, Rows
from shapes import ShapeLibrary, bake, box, joined, scene_of, sphere
from stage import OnScreen


def random_triangles(rng: np.random.Generator, count: int) -> Array:
    """Of all slopes, a third of them nearly level."""
    corners = rng.normal(size=(count, 3, 3))
    corners[: count // 3, :, 1] *= 10 ** rng.uniform(-4, 0, (count // 3, 1))
    return corners


def facing(corners: Array, viewer: ArrayLike) -> Mask:
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.einsum("ij,ij->i", normal, np.asarray(viewer) - corners[:, 0]) > 0


@pytest.mark.slow
def test_whoever_is_left_out_turns_away() -> None:
    """Random small objects and random viewers: every triangle that faces the viewer is in a piece that is seen; and of
    what turns away some is left out."""
    rng = np.random.default_rng(4)
    seen_bits, left_out = np.zeros(PIECES, bool), 0
    for _ in range(300):
        corners = random_triangles(rng, 40) * 0.2 + rng.normal(size=3)
        piece = piece_numbers(corners)
        viewers = rng.normal(size=(30, 3)) * 10 ** rng.uniform(0, 2, (30, 1))
        horizon = np.broadcast_to(piece_horizons(corners, piece), (30, PIECES, 4))
        masks = seen_pieces(horizon, viewers)
        for viewer, mask in zip(viewers, masks.tolist(), strict=True):
            drawn = mask >> piece & 1 > 0
            assert drawn[facing(corners, viewer)].all()
            left_out += (~drawn).sum()
        seen_bits[piece] = True
    assert seen_bits.all()
    assert left_out > 0.2 * 300 * 30 * 40


def test_the_caps_are_what_lies_level() -> None:
    corners = joined(box(1.0, 1.0, 1.0), sphere(0.4, 64, 32))
    triangles = corners.positions[corners.faces].astype(float)
    piece = piece_numbers(triangles)
    up = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    slope = np.degrees(np.arccos(up[:, 1] / np.linalg.norm(up, axis=1)))
    assert ((piece == TOP_PIECE) == (slope < 0.5)).all() and (piece == TOP_PIECE).any()
    assert ((piece == BOTTOM_PIECE) == (slope > 179.5)).all() and (piece == BOTTOM_PIECE).any()


@pytest.fixture(scope="module", params=[build_grid_lods, build_simplified_lods])
def cube(request: pytest.FixtureRequest) -> LodGeometry:
    """A box of 1 m that stands on the origin, in both systems of geometry."""
    return request.param(bake(box(1.0, 1.0, 1.0, (0, 0.5, 0)), resolution=48))


@pytest.mark.parametrize(
    ("viewer", "case"),
    [
        ((0, 0.5, 9), Case.SIDE),
        ((0, 1.2, 9), Case.SIDE_AND_TOP),
        ((0, -0.2, 9), Case.SIDE_AND_BOTTOM),
        ((5, 9.0, 5), Case.SIDE_AND_TOP),
    ],
)
def test_a_box_from_beside_from_above_and_from_below(
    cube: LodGeometry, viewer: tuple[float, float, float], case: Case
) -> None:
    for level in range(len(cube.error)):
        mask = seen_pieces(cube.horizon[level][None], np.array([viewer], float))
        assert drawn_cases(mask).tolist() == [case]
        everything, drawn = cube.positions[cube.drawn(level)], cube.positions[cube.drawn(level, int(mask[0]))]
        assert facing(everything, viewer).sum() == facing(drawn, viewer).sum()
        assert len(drawn) < len(everything)
        if level == 0:  # of a cap that is left out, nothing is drawn
            up = np.cross(drawn[:, 1] - drawn[:, 0], drawn[:, 2] - drawn[:, 0])
            slope = up[:, 1] / np.linalg.norm(up, axis=1)
            assert (slope > 0.999).any() == (viewer[1] > 1) and (slope < -0.999).any() == (viewer[1] < 0)


def test_ranges_that_adjoin_are_drawn_at_once() -> None:
    count = np.zeros(29, int)
    count[[0, 3, 4, 9, 25]] = 6
    first = np.cumsum(count) - count
    assert piece_runs(first, count) == ((0, 30),)
    assert piece_runs(first, count, ALL_PIECES & ~(1 << 4)) == ((0, 12), (18, 12))
    assert piece_runs(first, count, 1 << 5) == ()


def whole(asset: Rows, *_: object) -> Rows:
    return np.full(len(asset), ALL_PIECES)


def table() -> tuple[Scene, ShapeLibrary]:
    library = ShapeLibrary([joined(box(1.6, 0.3, 1.0, (0, 0.85, 0)), box(0.1, 0.7, 0.1, (0, 0.35, 0)))], resolution=96)
    scene = scene_of((0, (0, 0, 0), 0.0, 1.0))
    scene.render.warp.reuse_error = 16.0  # its tile would be kept for ever but for what it lacks
    return scene, library


def test_who_walks_up_past_the_top_sees_it(gl_device: Device) -> None:
    """A tile that was warped without the top is warped anew as soon as the viewer is above, and only then."""
    views = [View(Camera((0.0, y, 5.0), (0.0, 0.6, 0.0), 0.5), (240, 180)) for y in (0.84, 0.86, 1.15, 1.17)]
    above = views[2]
    with OnScreen(gl_device, *table()) as table_top:
        pictures, cases, warped = [], [], []
        table_top.renderer.remembers = True
        for view in views:
            counts = table_top.draw(view)
            pictures.append(read_pixels(table_top.screen).astype(int))
            warped.append(counts["warped"])
            cases.append([name for name in counts if name.startswith("case_")])
    assert warped == [1, 0, 1, 0]
    assert cases[0] == cases[1] and cases[2] == cases[3]
    assert "top" not in cases[0][0] and "all" not in cases[0][0] and cases[0] != cases[2]
    with OnScreen(gl_device, *table()) as fresh:
        fresh.draw(above)
        assert np.abs(read_pixels(fresh.screen).astype(int) - pictures[2]).max() <= 1


def test_the_counts_tell_the_papers_step(gl_device: Device) -> None:
    """Whatever chose the level: texels of the side image per pixel, rounded down to a power of two."""
    with OnScreen(gl_device, *table()) as stage:
        counts = stage.draw(View(Camera((0.0, 0.5, 80.0), (0.0, 0.5, 0.0), 0.5), (240, 180)))
        placed = stage.renderer.world
        texel = placed.table().texel[placed.objects().asset[0]]
    step = 2 * 80 * np.tan(0.25) / (180 * texel)
    assert step > 4
    assert [name for name in counts if name.startswith("step_")] == [f"step_{1 << int(np.log2(step))}"]


def test_the_garden_has_all_three_cases_and_looks_as_with_all_images(
    gl_device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From eye height along its tour, and from above; without shadows, of which neither picture leaves a piece out."""
    root, size = Path(__file__).resolve().parents[2] / "scenes", (320, 180)
    without = {"render.warp.reuse_error": "0", "render.shadows.enabled": "false"}
    scene = load_scene(root / "garden.yaml", overrides=without)
    path = load_path(root / "paths" / "garden.yaml")
    cameras = [path.sample(time) for time in (0.0, 5.0, 8.0, 17.0)] + [Camera((10.0, 5.0, 24.0), (0.0, 1.0, 0.0), 0.9)]
    found = dict.fromkeys(("case_side", "case_side_and_top", "case_side_and_bottom", "case_all"), 0.0)
    triangles = np.zeros(2, int)
    with OnScreen(gl_device, scene, SceneLibrary(scene.assets), size) as stage:
        for camera in cameras:
            counts = stage.draw(View(camera, size))
            picture = read_pixels(stage.screen).astype(int)
            found = {name: count + counts.get(name, 0) for name, count in found.items()}
            with monkeypatch.context() as patch:
                patch.setattr(plan, "choose_pieces", whole)
                all_counts = stage.draw(View(camera, size))
            # Simplified foliage is open: through a gap, the back of a leaf may show that a whole picture has.
            assert (np.abs(read_pixels(stage.screen) - picture).max(-1) > 1).mean() < 1e-4
            assert all_counts["case_all"] == all_counts["dpci"]
            triangles += counts["warped_triangles"], all_counts["warped_triangles"]
    assert min(found.values()) > 0
    assert triangles[0] < 0.9 * triangles[1]
