"""A camera that keys, mouse, a path and an orbit move."""

import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from barriers import among, box
from depthwalk.render.renderer import Renderer
from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import GroundParams, WalkParams
from depthwalk.scene.scene import Scene
from depthwalk.walk.collision.body import RADIUS
from depthwalk.walk.controls import EYE_HEIGHT, Move
from depthwalk.walk.orbit import Side
from depthwalk.walk.state import State
from depthwalk.walk.viewer import Mode
from walks import HOME, look, mode_of, state


def is_playing(walk: State) -> bool:
    """Whether the path plays that `walk` has."""
    assert walk.playback is not None
    return walk.playback.playing


def test_a_path_leads_the_camera_until_a_key_takes_over() -> None:
    walk = state()
    walk.toggle_path()
    walk.advance(1.0)
    assert walk.camera.position == (0, 0, 0) and walk.camera.fov == 0.5
    walk.advance(5.0)
    assert walk.camera.position == (10, 0, 0) and walk.camera.fov == 0.8 and not is_playing(walk)
    walk.toggle_path()
    walk.advance(0.5)
    walk.held.press(Move.BACK)
    walk.advance(0.5)
    assert not is_playing(walk) and walk.camera.position[2] > 0.1


def test_the_mouse_takes_over_too_and_home_is_home() -> None:
    walk = state()
    walk.toggle_path()
    walk.advance(0.1)
    walk.look(10, 0)
    assert not is_playing(walk)
    walk.go_home()
    assert walk.camera.position == HOME.position and walk.camera.target == pytest.approx((0, 1, 4))


def test_seeking_looks_from_there() -> None:
    walk = state()
    walk.seek(2.0)
    assert walk.camera.position == (10, 0, 0)


def test_the_camera_jumps_to_the_path_and_home_and_moves_along() -> None:
    walk = state()
    jumps: list[Callable[[], None]] = [
        lambda: walk.seek(0.5),
        walk.toggle_path,
        walk.go_home,
        lambda: walk.frame_all(1.5),
    ]
    for jump in jumps:
        before = walk.jumps
        jump()
        assert walk.jumps == before + 1
    walk.toggle_path()
    assert walk.playback is not None
    walk.playback.time, walk.playback.loop, before = 0.5, True, walk.jumps
    walk.advance(1.0)
    assert walk.jumps == before
    walk.advance(1.0)  # past the end of the path, which starts again
    assert walk.jumps == before + 1 and is_playing(walk)


def test_without_a_path_it_says_so() -> None:
    walk = state(path=False)
    walk.toggle_path()
    assert "--path" in walk.toast


def test_animations_run_until_they_are_stopped() -> None:
    walk = state()
    walk.advance(1.0)
    walk.toggle_animation()
    assert walk.camera.time == 0 and walk.toast == "Nothing in this scene is animated"
    walk.scene = cast(Scene, SimpleNamespace(**vars(walk.scene) | {"animations": object()}))
    walk.advance(1.0)
    walk.advance(0.5)
    walk.toggle_animation()
    walk.advance(4.0)
    assert walk.camera.time == 1.5 and walk.toast == "Animations stopped at 1.50 s"
    walk.toggle_animation()
    walk.advance(0.25)
    assert walk.camera.time == 1.75 and walk.toast == "Animations go on"


def test_walking_stands_on_the_scenes_ground() -> None:
    walk = state(path=False, ground=GroundParams(height=3.0))
    walk.toggle_walking()
    walk.advance(1.0)
    walk.advance(1.0)
    assert walk.camera.position[1] == pytest.approx(3.0 + EYE_HEIGHT)


def test_all_is_seen_from_a_side_and_then_from_the_other() -> None:
    walk = state(path=False)
    for side, towards in ((Side.RIGHT, (-1, 0, 0)), (Side.ABOVE, (0, -1, 0)), (Side.FRONT, (0, 0, -1))):
        walk.frame_all(1.5, side)
        assert look(walk.camera) == pytest.approx(towards, abs=0.02) and side.name.lower() in walk.toast
        walk.frame_all(1.5, side)
        assert look(walk.camera) == pytest.approx(np.negative(towards), abs=0.02)
        assert side.opposite.name.lower() in walk.toast
        walk.frame_all(1.5, side)
        assert look(walk.camera) == pytest.approx(towards, abs=0.02)
    assert mode_of(walk) is Mode.FLY


def test_why_objects_are_missing_is_told_below_the_message() -> None:
    walk = state(path=False)
    reader = SimpleNamespace(is_busy=True)
    assets = SimpleNamespace(meshes=SimpleNamespace(reader=reader))
    walk.renderer = cast(Renderer, SimpleNamespace(world=SimpleNamespace(), assets=assets))
    for objects, whole, busy, told in (
        ((), True, False, "The scene has no objects"),
        ((1, 2), True, True, ""),
        ((1, 2), False, True, "Reading models \u2026"),
        ((1, 2), False, False, ""),  # a mesh that could not be read stays away, as was told
    ):
        walk.scene = cast(Scene, SimpleNamespace(objects=objects, animations=None))
        walk.renderer.world.is_whole, reader.is_busy = whole, busy  # type: ignore[misc]
        assert walk.notice == told
        walk.tell("Saved")
        assert walk.notice == f"Saved\n{told}".strip()
        walk.tell("")


@pytest.mark.parametrize("orbit", [False, True])
def test_the_field_of_view_changes_where_one_stands_and_home_restores_it(orbit: bool) -> None:
    walk = state(path=False)
    if orbit:
        walk.toggle_orbit()
    before = walk.camera
    for wanted, given in ((30.0, 30.0), (0.0, 1.0), (400.0, 170.0)):
        walk.set_fov(math.radians(wanted))
        assert math.degrees(walk.camera.fov) == pytest.approx(given)
        assert walk.camera.position == before.position and look(walk.camera) == pytest.approx(look(before))
    walk.look(10, 0)
    assert math.degrees(walk.camera.fov) == pytest.approx(170)
    walk.go_home()
    assert walk.camera.fov == HOME.fov


@pytest.mark.parametrize("orbit", [False, True])
def test_framing_all_keeps_the_direction(orbit: bool) -> None:
    walk = state()
    walk.toggle_path()
    walk.advance(0.1)
    if orbit:
        walk.toggle_orbit()
    walk.look(50, 20)
    before = look(walk.camera)
    walk.frame_all(1.5)
    assert look(walk.camera) == pytest.approx(before) and not is_playing(walk)
    assert np.add(walk.camera.position, 9 * before) == pytest.approx([0, 1, 0])


def test_a_mesh_alone_is_turned_about_and_a_scene_walked_through() -> None:
    walk = state()
    walk.arrive()
    assert mode_of(walk) is Mode.WALK and walk.walker.speed == pytest.approx(4 / 5)  # 4 m across, in 5 s
    scene = cast(SimpleNamespace, walk.scene)
    scene.path, scene.walk = Path("bust.OBJ"), WalkParams(speed=7.0)
    walk.arrive()
    assert mode_of(walk) is Mode.ORBIT and walk.camera == HOME and walk.walker.speed == 7


@pytest.mark.parametrize(("height", "mode"), [(0.4, Mode.FLY), (1.2, Mode.WALK), (2.4, Mode.WALK), (20.0, Mode.FLY)])
def test_who_begins_at_eye_height_walks_at_that_height(height: float, mode: Mode) -> None:
    walk = state(path=False, ground=GroundParams(height=3.0))
    walk.home = Camera((0.0, 3.0 + height, 5.0), (0.0, 0.0, 0.0), 0.8)
    walk.arrive()
    walk.advance(0.5)
    assert walk.mode is mode and walk.camera.position == walk.home.position
    walk.held.press(Move.FORWARD)  # the look is downward
    walk.advance(1.0)
    assert (walk.camera.position[1] == pytest.approx(3.0 + height, abs=1e-4)) is (mode is Mode.WALK)


def test_up_lifts_off_and_from_the_air_one_lands_at_eye_height() -> None:
    walk = state(path=False)
    walk.arrive()
    assert mode_of(walk) is Mode.WALK
    walk.held.press(Move.UP)
    walk.advance(0.5)
    assert mode_of(walk) is Mode.FLY and walk.camera.position[1] > HOME.position[1] and "Flying" in walk.toast
    walk.held.release(Move.UP)
    walk.advance(0.1)
    walk.toggle_walking()
    for _ in range(4):
        walk.advance(1.0)
    assert walk.camera.position[1] == pytest.approx(EYE_HEIGHT)


def test_who_is_placed_in_the_air_flies() -> None:
    walk = state()  # its path is on the ground, no place for eyes
    walk.arrive()
    walk.seek(2.0)
    assert mode_of(walk) is Mode.FLY and walk.camera.position == (10, 0, 0)


@pytest.mark.parametrize(
    ("walks", "collide", "stops"), [(True, True, True), (True, False, False), (False, True, False)]
)
def test_surfaces_stop_who_walks_where_the_scene_says_so(walks: bool, collide: bool, stops: bool) -> None:
    walk = state()
    walk.scene = cast(Scene, SimpleNamespace(**vars(walk.scene) | {"walk": WalkParams(collide=collide)}))
    walk.obstacles = among(box([-5, 0, -0.2], [5, 3, 0]))
    walk.walker.walking = walks
    walk.held.press(Move.FORWARD)
    for _ in range(180):
        walk.advance(1 / 60)
    assert (walk.camera.position[2] > RADIUS - 1e-3) == stops


def test_a_path_leads_through_walls() -> None:
    walk = state()
    walk.obstacles = among(box([5, 0, -5], [5.2, 3, 5]))
    walk.walker.walking = True
    walk.toggle_path()
    walk.advance(2.5)
    assert walk.camera.position == (10, 0, 0)
