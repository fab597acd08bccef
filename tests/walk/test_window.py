"""A real window, driven by real key and mouse events, in a virtual X server.

The program tells of every frame what it shows, so that a test waits for what it needs to see, however long that takes
on a busy machine, and never for a number of seconds.
"""

import contextlib
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest

from depthwalk.assets.library import SceneLibrary
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.types import Rows
from window_program import PATIENCE, SCENE, Start, User, linux, names

pytestmark = [pytest.mark.gl, pytest.mark.window]


def headless_picture(scene_file: Path, camera: Camera, size: tuple[int, int]) -> Rows:
    scene = load_scene(scene_file)
    with HeadlessRenderer(scene, SceneLibrary(scene.assets), size) as headless:
        headless.draw(View(camera, size))
        return headless.pixels()[..., :3].astype(int)


@linux
def test_a_walk_with_keys_and_mouse(start: Start, scene_file: Path) -> None:
    user = start(compiled=True)
    program = user.program
    with_hud, first = user.screenshot()
    assert first.position == (0.0, 1.2, 6.0) and with_hud.shape == (360, 480, 3)
    assert np.abs(with_hud - headless_picture(scene_file, first, (480, 360))).mean() > 5  # the HUD is there

    for x, number in ((188, 0), (292, 1), (292, None)):  # the ball, the crate, and again
        user.do("mousemove", x, 180, "key", "i")
        program.wait_for(inspected=number)
    user.do("mousemove", 240, 200, "click", 4, "keydown", "w")
    program.wait(lambda report: "position" in report and report["position"][2] < 5, "a step ahead")
    user.do("keyup", "w")
    program.wait_still()
    user.do("mousedown", 3, "mousemove_relative", "--", 50, 10, "mousemove_relative", 50, 10, "mouseup", 3)
    program.wait(lambda report: "look" in report and report["look"][0] > 0.15, "a turn to the right")
    program.wait_still()
    user.key("z", hud=False)
    user.do("windowsize", user.window, 400, 300)
    program.wait_for(size=[400, 300])
    picture, last = user.screenshot()
    assert picture.shape == (300, 400, 3)
    assert 0.5 < first.position[2] - last.position[2] < 5.5  # a metre at 3.6 m/s, more on a busy machine
    assert last.target[0] - last.position[0] > 0.1  # the mouse went to the right
    expected = headless_picture(scene_file, last, (400, 300))
    assert expected.std() > 20  # something is seen
    assert np.abs(picture - expected).mean() < 1.0

    user.do("key", "v")
    program.wait(names("Copied camera: {position: ["), "the camera in the clipboard")
    user.do("key", "6")
    program.wait(lambda report: "look" in report and report["look"][1] < -0.99, "a look from above")
    user.key("c", captured=True)
    user.key("Escape", captured=False)
    user.do("key", "Escape")
    live = program.end()
    assert live["texture"] == 0 and not any(live.values())


def write_many(scene_file: Path) -> None:
    """A scene that takes a while to load."""
    many = [f"ball{k}: {{mesh: ball.ply, height: {1 + k}, dpci: {{resolution: 128}}}}" for k in range(100)]
    seen = [f"{{asset: ball{k}}}" for k in range(100)]
    scene_file.write_text(f"version: 1\nassets: {{{', '.join(many)}}}\nobjects: [{', '.join(seen)}]\n")


@linux
def test_escape_ends_the_loading(start: Start, scene_file: Path, empty_cache: Path) -> None:
    write_many(scene_file)
    user = start()
    for _ in range(PATIENCE):  # a key pressed as the window appears may be lost
        user.do("key", "Escape")
        with contextlib.suppress(subprocess.TimeoutExpired):
            user.program.process.wait(1)
            break
    assert not any(user.program.end().values())
    assert len(list(empty_cache.rglob("*.exr"))) < 90  # of 100 bakes


@linux
def test_what_is_recorded_is_saved_where_the_window_closes_while_another_scene_loads(
    start: Start, tmp_path: Path, empty_cache: Path
) -> None:
    write_many(many := tmp_path / "many.yaml")
    user = start()
    program = user.program
    program.wait_frames()
    user.do("key", "k")
    program.wait(lambda report: report.get("recorded", 0) > 0.5, "half a second of recording")
    user.drop(many)
    program.wait(lambda report: "loading" in report, "the other scene")
    program.process.send_signal(signal.SIGUSR2)
    assert not any(program.end().values())
    (recorded,) = tmp_path.glob("depthwalk-*.yaml")
    assert len(load_path(recorded).times) > 1
    assert len(list(empty_cache.rglob("*.exr"))) < 90  # it was loading


@linux
def test_a_key_focuses_on_what_is_in_the_middle(start: Start, scene_file: Path) -> None:
    lens = "render: {dof: {mode: gather, focal_length: 150, f_number: 1, focus_distance: 1}}\n"
    scene_file.write_text(SCENE.replace("target: [0, 0.8, 0]", "target: [0.8, 0.8, 0]") + lens)
    user = start()
    user.program.wait_frames()
    user.key("z", hud=False)
    user.do("key", "l")
    user.program.wait(lambda report: report.get("focus", 1) != 1 and not report["focusing"], "focus")
    focused, camera = user.screenshot()
    pictures = {}
    for mode in ("gather", "none"):
        scene = load_scene(scene_file, overrides={"render.dof.mode": mode})
        with HeadlessRenderer(scene, SceneLibrary(scene.assets), (480, 360)) as headless:
            headless.draw(View(camera, (480, 360)))
            pictures[mode] = headless.pixels()[..., :3].astype(int)
            distance = headless.distances()
    crate = np.abs(distance - distance[180, 240]) < 0.1
    assert crate.sum() > 1000
    off = [np.abs(picture - pictures["none"])[crate].mean() for picture in (pictures["gather"], focused)]
    assert off[1] < 1 < 0.5 * off[0]


@linux
def test_files_are_dropped_and_read_again(start: Start, scene_file: Path, tmp_path: Path) -> None:
    (tmp_path / "bad.yaml").write_text("version: 1\nobjects: [{asset: ball}]\n")
    (tmp_path / "broken.ply").write_text("no mesh")
    user = start()
    program = user.program
    _, first = user.screenshot()
    user.key("z", hud=False)
    for bad in ("bad.yaml", "broken.ply", "gone.yaml"):
        user.drop(tmp_path / bad)
        program.wait(names(bad), f"a complaint about {bad}")
    picture, camera = user.screenshot()
    assert camera == first
    assert np.abs(picture - headless_picture(scene_file, first, (480, 360))).mean() < 1

    user.drop(tmp_path / "ball.ply")
    program.wait(lambda report: report.get("title", "").startswith("ball.ply"), "the ball")
    user.do("mousemove", 240, 180, "mousedown", 1, "mousemove_relative", 180, 0)
    program.wait(lambda report: "position" in report and report["position"][0] < -0.2, "a turn about the ball")
    user.do("mouseup", 1)
    _, turned = user.screenshot()
    assert turned.target == pytest.approx((0, 0.8, 0), abs=0.02)  # the ball's middle
    assert turned.position[0] < -0.2

    user.drop(scene_file)
    program.wait(lambda report: report.get("title", "").startswith("scene.yaml"), "the scene")
    user.do("keydown", "d")
    program.wait(lambda report: "position" in report and report["position"][0] > 0.3, "a step to the right")
    user.do("keyup", "d")
    program.wait_still()
    scene_file.write_text(SCENE.replace("position: [0.8, 0, 0]", "position: [0.8, 0, 2]"))
    user.do("key", "r")
    program.wait(lambda report: report.get("message", "").startswith("Reloaded scene.yaml"), "the scene again")
    begun = [report for report in program.told if report.get("begins") == "scene.yaml"]
    assert begun[0]["over"] is None and begun[-1]["over"] == [480, 360]  # the picture before
    picture, moved = user.screenshot()
    assert moved.position[0] > 0.2
    assert np.abs(picture - headless_picture(scene_file, moved, (480, 360))).mean() < 1

    path = tmp_path / "path.yaml"
    path.write_text("version: 1\nkeyframes: [{time: 0, position: [0, 9, 9], target: [0, 0, 0]}]\n")
    user.drop(path)
    program.wait(lambda report: "path.yaml" in report.get("message", ""), "the path")
    user.key("p", position=[0, 9, 9])
    assert user.screenshot()[1].position == (0, 9, 9)
    user.do("key", "Escape")
    assert not any(program.end().values())


@linux
def test_meshes_that_are_dropped_together_are_shown_together(start: Start, tmp_path: Path) -> None:
    """They are read again together, and turned upright together."""
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
    for name, left in ("left", -3), ("right", 3):
        (tmp_path / f"{name}.obj").write_text("".join(f"v {x + left} {y} {z}\n" for x, y, z in corners) + faces)
    user = start()
    program = user.program
    user.drop(tmp_path / "left.obj", tmp_path / "right.obj")
    program.wait(lambda report: report.get("title", "").startswith("left.obj and 1 more"), "two boxes")
    user.key("z", hud=False)
    picture, _ = user.screenshot()
    shown = np.abs(picture.astype(int) - picture[0, 0]).max(-1).max(0) > 20  # columns in which a box is
    assert shown[:200].any() and not shown[220:260].any() and shown[280:].any()
    user.do("key", "r")
    program.wait(lambda report: report.get("message", "").startswith("Reloaded left.obj and 1 more"), "both again")
    user.do("key", "u")
    program.wait(names("z points upward"), "a turn")
    user.drop(tmp_path / "left.obj", tmp_path / "ball.ply", tmp_path / "scene.yaml")
    program.wait(names("Not opened: scene.yaml. "), "what is not opened")
    program.wait(lambda report: report.get("title", "").startswith("left.obj and 1 more \u2013"), "a box and a ball")
    user.do("key", "Escape")
    assert not any(program.end().values())


def watched_scene(user: User, folder: Path) -> Path:
    """The file of a scene that is watched, once the window shows it."""
    watched = folder / "watched.yaml"
    watched.write_text(SCENE)
    user.drop(watched)
    user.program.wait(lambda report: report.get("title", "").startswith("watched.yaml"), "the scene")
    return watched


@linux
def test_a_watched_scene_is_read_again_when_it_is_saved(start: Start, tmp_path: Path) -> None:
    program = (user := start()).program
    watched = watched_scene(user, tmp_path)
    watched.write_text(SCENE.replace("yaw: 30", "yaww: 30"))
    program.wait(lambda report: "yaww" in report.get("complaint", ""), "a complaint about a mistake")
    user.do("key", "z")
    program.wait_for(hud=False, toast="")
    assert "watched.yaml:8:43" in program.told[-1]["complaint"]  # still
    watched.write_text(SCENE.replace("yaw: 30", "yaw: 60"))
    program.wait(lambda report: report.get("message", "").startswith("Reloaded watched.yaml"), "the scene again")
    program.wait_for(complaint="")
    user.do("key", "Escape")
    assert not any(program.end().values())


@linux
def test_what_the_panel_changes_is_kept(start: Start, scene_file: Path) -> None:
    scene_file.write_text(text := SCENE + "# the end\n")
    user = start()
    program = user.program
    program.wait_frames()
    user.do("key", "Tab")
    user.click("collide")
    program.wait_for(changed={"walk": {"collide": False}})
    user.do("key", "ctrl+s")
    program.wait(names("Saved 1 value in scene.yaml"), "what was saved")
    saved = text.replace("walk: {speed: 3}", "walk: {speed: 3, collide: false}")
    assert scene_file.read_text() == saved
    program.wait_for(changed={})

    user.click("collide")
    program.wait_for(changed={"walk": {"collide": True}})
    user.click("Copy")
    assert program.wait(names("Copied 1 value"), "a copy")["copied"] == "walk: {collide: true}"
    user.click("Undo")
    program.wait_for(changed={})
    assert scene_file.read_text() == saved

    user.click("collide")
    program.wait_for(changed={"walk": {"collide": True}})
    scene_file.write_text(broken := saved + "rendr: {}\n")
    user.click("Save")
    program.wait(names("rendr"), "a complaint about what has become of the file")
    assert scene_file.read_text() == broken
    scene_file.write_text(saved.replace("yaw: 30", "yaw: 31"))
    user.click("Save")
    program.wait(names("Saved 1 value"), "what was saved")
    assert scene_file.read_text() == saved.replace("yaw: 30", "yaw: 31").replace("collide: false", "collide: true")

    user.click("collide")
    program.wait_for(changed={"walk": {"collide": False}})
    user.do("key", "Escape", "key", "Escape")  # the panel is closed, but not the window
    program.wait(names("Not in scene.yaml: 1 value"), "a warning")
    user.do("key", "Escape")
    assert not any(program.end().values())


@linux
def test_a_watched_scene_is_not_read_again_when_the_window_saves_it(start: Start, tmp_path: Path) -> None:
    program = (user := start()).program
    watched = watched_scene(user, tmp_path)
    user.do("key", "Tab")
    for value in (False, True):
        user.click("collide")
        program.wait_for(changed={"walk": {"collide": value}})
        user.do("key", "ctrl+s")
        program.wait_for(changed={})
        assert load_scene(watched).walk.collide == value
    program.wait_for(toast="")  # ten looks at the file later
    assert not any(report.get("message", "").startswith("Reloaded") for report in program.told)
    watched.write_text(watched.read_text().replace("yaw: 30", "yaw: 60"))
    program.wait(lambda report: report.get("message", "").startswith("Reloaded watched.yaml"), "the scene again")
    user.do("key", "Tab", "key", "Escape")
    assert not any(program.end().values())


@linux
@pytest.mark.parametrize(("samples", "shown"), [(4, "msaa"), (2, "none")])
def test_multisampling_and_none_where_the_driver_has_too_few(
    start: Start, scene_file: Path, samples: int, shown: str
) -> None:
    scene_file.write_text(SCENE + "render: {aa: msaa}\n")
    user = start(samples)
    user.program.wait_frames()
    user.key("z", hud=False)
    picture, camera = user.screenshot()
    user.do("key", "Escape")
    assert not any(user.program.end().values())
    expected = {}
    for aa in ("msaa", "none"):
        scene = load_scene(scene_file, overrides={"render.aa": aa})
        with HeadlessRenderer(scene, SceneLibrary(scene.assets), (480, 360)) as headless:
            headless.draw(View(camera, (480, 360)))
            expected[aa] = headless.pixels()[..., :3].astype(int)
    off = {aa: np.abs(picture - each).mean() for aa, each in expected.items()}
    assert off[shown] < 0.5 * min(off[aa] for aa in off if aa != shown)
