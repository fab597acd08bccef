"""What casts its shadow on something in the view meets its prism; pictures do not change by leaving out the rest."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthwalk.gpu.device import Device
from depthwalk.render.image import read_pixels
from depthwalk.render.shadows.cascades import light_axes
from depthwalk.render.shadows.seen_prism import SeenPrism
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.scene import Scene
from shapes import ShapeLibrary, box, scene_of, sphere
from stage import OnScreen

SIZE = (160, 120)
directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


@given(directions, directions, st.integers(0, 2**32 - 1))
def test_no_sphere_that_shadows_a_seen_point_is_left_out(sun: Any, ahead: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    position = rng.uniform(-50, 50, 3)
    camera = Camera(tuple(position), tuple(position + np.array(ahead)), rng.uniform(0.3, 2.0))
    view = View(camera, SIZE, near=0.1, far=rng.uniform(1, 200), shear=tuple(rng.uniform(-0.2, 0.2, 2)))
    toward = np.array(sun) / np.linalg.norm(sun)
    distance = rng.uniform(0.5, 300)
    screen = np.column_stack([rng.uniform(-1, 1, (64, 2)), np.ones(64)])
    ray = screen @ view.ray_from_screen.T
    near, far = view.depth_range
    away = rng.uniform(near, far, 64)
    seen = position + ray * away[:, None]
    seen = seen[np.linalg.norm(ray, axis=1) * away < distance]
    radius = rng.uniform(0.01, 3, len(seen))
    aside = rng.normal(size=(len(seen), 3))
    aside *= (radius * rng.uniform(0, 1, len(seen)) / np.linalg.norm(aside, axis=1))[:, None]
    spheres = Bounds(seen + toward * rng.uniform(0, 100, (len(seen), 1)) + aside, radius)
    prism = SeenPrism.of(view, light_axes(toward), distance)
    assert prism.meets(spheres, 1e-6).all()


@pytest.mark.parametrize("sun", [(0.0, 1.0, 0.0), (0.4, 0.8, -0.3), (-1.0, 0.2, 0.5)])
def test_what_stands_at_the_lowest_point_in_sight_is_not_left_out(sun: tuple[float, float, float]) -> None:
    """Else a stone at the lower edge of the picture lies in the sun without a shadow of its own."""
    view, axes = View(Camera((0, 2, 0), (0, 1, -1), 1.0), SIZE, near=0.1, far=30.0), light_axes(np.array(sun))
    corners = np.array([(x, y, 1.0) for x in (-1, 1) for y in (-1, 1)]) @ view.ray_from_screen.T
    points = view.position + np.concatenate([0.1 * corners, 30 * corners])
    lowest = points[(points @ axes[2]).argmin()]
    centres = lowest - np.array([0.0, 0.5, 0.9, 1.1])[:, None] * axes[2]
    met = SeenPrism.of(view, axes, 50.0).meets(Bounds(centres, np.ones(4)), 0.0)
    assert met.tolist() == [True, True, True, False]


def test_what_shadows_nothing_in_sight_is_left_out() -> None:
    view = View(Camera((0, 2, 0), (0, 2, -1), 1.0), SIZE, near=0.1, far=30.0)
    prism = SeenPrism.of(view, light_axes(np.array([0.0, 1.0, 0.0])), 50.0)  # the sun in the zenith
    centres = np.array([[0, 9, -8], [0, 9, 3], [0, -30, -8], [14, 9, -3]], float)
    assert prism.meets(Bounds(centres, np.ones(4)), 0.0).tolist() == [True, False, False, False]
    assert prism.meets(Bounds(centres, np.ones(4)), 2.5).tolist() == [True, True, False, False]


def colonnade() -> Scene:
    """Pillars all round the viewer, in the sun behind him, from his right."""
    places = [(k % 2, (5 * np.sin(a), 0, 5 * np.cos(a)), a, 1.0) for k, a in enumerate(np.linspace(0, 6.1, 18))]
    places.append((0, (0, 0, 400.0), 0.0, 1.0))  # so that shadows go on beyond all maps
    scene = scene_of(*places, ground={"height": 0.0}, sun={"direction": (-0.5, -1.5, -1.0)})
    scene.render.shadows.enabled = True
    return scene


@pytest.mark.parametrize("ahead", [(0, 1.2, -1), (1, 1.0, 0.2), (-0.3, 0.9, 1)])
def test_pictures_are_the_same_with_fewer_casters(
    gl_device: Device, monkeypatch: pytest.MonkeyPatch, ahead: tuple[float, float, float]
) -> None:
    view = View(Camera((0, 1.5, 0), ahead, 1.0), SIZE)
    library = ShapeLibrary([box(0.5, 3.0, 0.5, (0, 1.5, 0)), sphere(0.6, 32, 16)], resolution=64)
    pictures, casters = [], []
    for culled in (True, False):
        if not culled:
            monkeypatch.setattr(
                SeenPrism, "meets", lambda self, bounds, margin: np.ones(len(bounds.bounding_radius), bool)
            )
        with OnScreen(gl_device, colonnade(), library, SIZE) as stage:
            stage.draw(view)
            pictures.append(read_pixels(stage.screen))
            casters.append(stage.counts["shadow_triangles"])
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert 0 < casters[0] < casters[1]


def test_maps_of_a_video_are_drawn_twice_and_then_kept(gl_device: Device) -> None:
    """First with what casts a shadow into the picture; then, since the map stays where it is, with all casters."""
    library = ShapeLibrary([box(0.5, 3.0, 0.5, (0, 1.5, 0)), sphere(0.6, 32, 16)], resolution=64)
    views = [View(Camera((0, 1.5, 0), (0.1 * k, 1.2, -1), 1.0), SIZE) for k in range(5)]
    with OnScreen(gl_device, colonnade(), library, SIZE) as video:
        drawn, pictures = [], []
        for view in views:
            drawn.append(video.draw(view).get("shadow_triangles", 0))
            pictures.append(read_pixels(video.screen))
    assert 0 < drawn[0] < drawn[1] and not any(drawn[2:])
    with OnScreen(gl_device, colonnade(), library, SIZE) as lone:
        lone.draw(views[-1])
        np.testing.assert_array_equal(read_pixels(lone.screen), pictures[-1])


def test_a_first_picture_that_somebody_waits_for_has_coarser_casters(gl_device: Device) -> None:
    """By and by they become what they should be, and then stay, though he moves on."""
    library = ShapeLibrary([sphere(1.5, 192, 96), sphere(0.6, 192, 96)], resolution=64)
    with OnScreen(gl_device, colonnade(), library, SIZE) as stage:
        stage.renderer.remembers = True
        stage.renderer.warp_limit, stage.renderer.upload_seconds = 1_000_000, 1.0
        view = View(Camera((0, 1.5, 0), (0, 1.2, -1), 1.0), SIZE)
        first = stage.draw(view)
        drawn = first["shadow_triangles"]
        assert first["shadow_maps"] == 3
        finer = [
            stage.draw(View(Camera((0.01 * k, 1.5, 0), (0.01 * k, 1.2, -1), 1.0), SIZE)).get("shadow_triangles", 0)
            for k in range(12)
        ]
        sizes = [triangles for triangles in finer if triangles]
        assert 1 <= len(sizes) <= 3 and sizes == sorted(sizes) and sum(sizes) > 1.5 * drawn
        assert stage.counts["shadow_maps_waiting"] == 0 and not finer[-1]
        assert stage.draw(View(Camera((0, 1.5, 0), (0.2, 1.2, 1), 1.0), SIZE))["shadow_maps"] == 0  # having turned


def test_a_map_that_may_wait_is_drawn_over_several_frames(gl_device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Frames that follow each other take equally long, and show in the end what maps that are drawn at once show."""
    library = ShapeLibrary([sphere(1.5, 192, 96), sphere(0.6, 192, 96)], resolution=64)
    views = [View(Camera((0.6 * k, 1.5, 0), (0.6 * k, 1.2, -1), 1.0), SIZE) for k in range(8)]
    drawn, pictures = [], []
    for most in (10**9, 1):
        monkeypatch.setattr("depthwalk.render.renderer._SHADOW_TRIANGLES", most)
        monkeypatch.setattr("depthwalk.render.passes.shadows.PART_TRIANGLES", 2000)
        monkeypatch.setattr("depthwalk.render.shadow_planner.moved_texels", lambda view, before: None)  # drawn whole
        with OnScreen(gl_device, colonnade(), library, SIZE) as stage:
            stage.renderer.remembers = True
            drawn.append([stage.draw(view) for view in (*views, *[views[-1]] * 40)])
            pictures.append(read_pixels(stage.screen))
    at_once, spread = drawn
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert sum(counts["shadow_maps_waiting"] for counts in spread) > 3 * sum(
        counts["shadow_maps_waiting"] for counts in at_once
    )
    assert spread[-1]["shadow_maps_waiting"] == 0
    assert any(counts.get("shadow_maps") for counts in at_once[1:])
