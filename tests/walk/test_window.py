"""A real window, driven by real key and mouse events, in a virtual X server."""

import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import trimesh
from PIL import Image

from depthwalk.assets.library import SceneLibrary
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.walk import NoDisplay
from depthwalk.walk.window import open_window

missing = [tool for tool in ("Xvfb", "xdotool") if shutil.which(tool) is None]
linux = pytest.mark.skipif(sys.platform != "linux", reason="X11")

SCENE = """
version: 1
assets:
  ball: {mesh: ball.ply, dpci: {resolution: 64, layers: 1}}
  crate: {mesh: crate.ply}
objects:
  - {asset: ball, position: [-0.8, 0, 0]}
  - {asset: crate, position: [0.8, 0, 0], yaw: 30}
environment: {sky: {}, ground: {}}
camera: {position: [0, 1.2, 6], target: [0, 0.8, 0], fov: 50}
walk: {speed: 3}
"""
DRIVER = """
import json, signal, sys
from pathlib import Path
import depthwalk.walk.app as app
import glfw
from depthwalk.library import SceneLibrary
from depthwalk.scene.loader import load_scene

class Watched(app.Device):
    def __init__(self, context):
        super().__init__(context)
        self.max_samples = min(self.max_samples, int(sys.argv[2]))
        devices.append(self)

def drop_by_signal(window, action):
    on_files_dropped(window, action)
    dropped = glfw.set_drop_callback(window._window, None)
    signal.signal(signal.SIGUSR1, lambda *_: dropped(None, 1, [Path("dropped").read_bytes()]))
    signal.signal(signal.SIGUSR2, lambda *_: window.close())

devices = []
app.Device = Watched
on_files_dropped, app.on_files_dropped = app.on_files_dropped, drop_by_signal
scene = load_scene(sys.argv[1])
quick = {"assets.model.dpci.resolution": "64"}
read = lambda file: load_scene(file, overrides=quick if file.suffix == ".ply" else {})
app.run(scene, SceneLibrary(scene.assets), size=(480, 360), read=read)
print(json.dumps([device.live for device in devices]))
"""


@pytest.fixture
def display():
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)}")
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "800x600x24"], pass_fds=[write], stderr=subprocess.DEVNULL
    )
    os.close(write)
    with os.fdopen(read) as pipe:
        number = pipe.readline().strip()
    yield f":{number}"
    server.terminate()
    server.wait(10)


@pytest.fixture
def scene_file(tmp_path):
    ball, crate = trimesh.creation.icosphere(4, 0.8), trimesh.creation.box((1.0, 1.2, 1.0))
    for name, mesh, colour in (("ball", ball, (210, 80, 50, 255)), ("crate", crate, (60, 110, 190, 255))):
        mesh.visual.vertex_colors = np.tile(np.uint8(colour), (len(mesh.vertices), 1))
        mesh.export(tmp_path / f"{name}.ply")
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    return path


class Program:
    """The walk in a process of its own, with up to so many samples per pixel."""

    def __init__(self, scene_file, folder, environment, samples=4):
        self.process = subprocess.Popen(
            [sys.executable, "-c", DRIVER, str(scene_file), str(samples)],
            env=environment, cwd=folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.process.kill()
        self.process.communicate()

    def check_running(self):
        if self.process.poll() is not None:
            raise AssertionError(self.process.communicate()[1])

    def end(self):
        """What it printed last, once it ended well."""
        output, errors = self.process.communicate(timeout=10)
        assert self.process.returncode == 0, errors
        return json.loads(output.splitlines()[-1])


class User:
    """Works the keyboard and the mouse of a display."""

    def __init__(self, environment, folder, program):
        self.environment, self.folder, self.program = environment, folder, program

    def do(self, *commands):
        command = ["xdotool", *map(str, commands)]
        return subprocess.run(command, env=self.environment, check=True, capture_output=True, timeout=20).stdout

    def find_window(self):
        """The number of the program's window, focused."""
        end = time.monotonic() + 20
        while time.monotonic() < end:
            self.program.check_running()
            # It exists before it is shown, and takes the focus only then.
            search = ["xdotool", "search", "--onlyvisible", "--name", "depthwalk"]
            found = subprocess.run(search, env=self.environment, capture_output=True, text=True, timeout=20).stdout
            if found:
                focus = ["xdotool", "windowfocus", "--sync", found.split()[0]]
                if subprocess.run(focus, env=self.environment, capture_output=True, timeout=20).returncode == 0:
                    return found.split()[0]
            time.sleep(0.1)
        raise AssertionError("no window")

    def drop(self, file):
        (self.folder / "dropped").write_text(str(file))
        self.program.process.send_signal(signal.SIGUSR1)

    def wait_for_title(self, text):
        end = time.monotonic() + 60
        search = ["xdotool", "search", "--onlyvisible", "--name", f"^{text}"]
        while subprocess.run(search, env=self.environment, capture_output=True, timeout=20).returncode:
            self.program.check_running()
            assert time.monotonic() < end, text
            time.sleep(0.1)

    def screenshot(self, size=None):
        """The next screenshot, taken again until it is of `size`: (H, W, 3) int, and its Camera."""
        end = time.monotonic() + 20
        before = set(self.folder.glob("*.png"))
        while time.monotonic() < end:
            self.program.check_running()
            self.do("key", "F12")
            time.sleep(0.4)
            for file in sorted(set(self.folder.glob("*.png")) - before):
                before.add(file)
                with Image.open(file) as image:
                    if size is None or image.size == size:
                        return np.asarray(image, int), camera_of(image.text["Camera"])
        raise AssertionError("no screenshot")


def camera_of(text):
    read = json.loads(text)
    return Camera(tuple(read["position"]), tuple(read["target"]), math.radians(read["fov"]))


def headless_picture(scene_file, camera, size):
    scene = load_scene(scene_file)
    with HeadlessRenderer(scene, SceneLibrary(scene.assets), size) as headless:
        headless.draw(View(camera, size))
        return headless.pixels()[..., :3].astype(int)


@linux
def test_a_walk_with_keys_and_mouse(display, scene_file, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    folder = tmp_path / "pictures"
    folder.mkdir()
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with Program(scene_file, folder, environment) as program:
        user = User(environment, folder, program)
        window = user.find_window()
        user.screenshot()  # perhaps the first frame, in which the HUD measures itself and does not show
        with_hud, start = user.screenshot()
        assert start.position == (0.0, 1.2, 6.0) and with_hud.shape == (360, 480, 3)
        assert np.abs(with_hud - headless_picture(scene_file, start, (480, 360))).mean() > 5  # the HUD is there

        user.do("mousemove", 240, 200, "click", 4, "keydown", "w", "sleep", 0.5, "keyup", "w")
        user.do("mousedown", 3, "mousemove_relative", "--", 50, 10, "mousemove_relative", 50, 10, "mouseup", 3)
        user.do("key", "z", "windowsize", window, 400, 300, "sleep", 0.6)
        picture, end = user.screenshot((400, 300))
        assert 0.5 < start.position[2] - end.position[2] < 5.5  # half a second at 3.6 m/s, more on a busy machine
        assert end.target[0] - end.position[0] > 0.1  # the mouse went to the right
        expected = headless_picture(scene_file, end, (400, 300))
        assert expected.std() > 20  # something is seen
        assert np.abs(picture - expected).mean() < 1.0

        user.do("key", "c", "sleep", 0.5, "key", "Escape", "sleep", 0.5)
        program.check_running()  # Esc let the mouse go
        user.do("key", "Escape")
        (live,) = program.end()
    assert live["texture"] == 0 and not any(live.values())


def write_many(scene_file):
    """A scene that takes a while to load."""
    many = [f"ball{k}: {{mesh: ball.ply, height: {1 + k}, dpci: {{resolution: 128}}}}" for k in range(100)]
    seen = [f"{{asset: ball{k}}}" for k in range(100)]
    scene_file.write_text(f"version: 1\nassets: {{{', '.join(many)}}}\nobjects: [{', '.join(seen)}]\n")


@linux
def test_escape_ends_the_loading(display, scene_file, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    write_many(scene_file)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with Program(scene_file, tmp_path, environment) as program:
        user = User(environment, tmp_path, program)
        user.find_window()
        user.do("key", "Escape")
        (live,) = program.end()
    assert not any(live.values())
    assert len(list((tmp_path / "cache").rglob("*.exr"))) < 90  # of 100 bakes


@linux
def test_what_is_recorded_is_saved_where_the_window_closes_while_another_scene_loads(
    display, scene_file, tmp_path, monkeypatch
):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    write_many(many := tmp_path / "many.yaml")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with Program(scene_file, tmp_path, environment) as program:
        user = User(environment, tmp_path, program)
        user.find_window()
        user.screenshot()  # it shows the scene
        user.do("key", "k", "sleep", 1)
        user.drop(many)
        time.sleep(2)
        program.process.send_signal(signal.SIGUSR2)
        (live,) = program.end()
    assert not any(live.values())
    (recorded,) = tmp_path.glob("depthwalk-*.yaml")
    assert len(load_path(recorded).times) > 1
    assert len(list((tmp_path / "cache").rglob("*.exr"))) < 90  # it was loading


@linux
def test_a_key_focuses_on_what_is_in_the_middle(display, scene_file, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    lens = "render: {dof: {mode: gather, focal_length: 150, f_number: 1, focus_distance: 1}}\n"
    scene_file.write_text(SCENE.replace("target: [0, 0.8, 0]", "target: [0.8, 0.8, 0]") + lens)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with Program(scene_file, tmp_path, environment) as program:
        user = User(environment, tmp_path, program)
        user.find_window()
        user.screenshot()  # it shows the scene
        user.do("key", "z", "key", "l", "sleep", 4)
        focused, camera = user.screenshot()
    pictures = {}
    for mode in ("gather", "none"):
        scene = load_scene(scene_file, overrides={"render.dof.mode": mode})
        with HeadlessRenderer(scene, SceneLibrary(scene.assets), (480, 360)) as headless:
            headless.draw(View(camera, (480, 360)))
            pictures[mode] = headless.pixels()[..., :3].astype(int)
            distance = headless.linear_image().distance
    crate = np.abs(distance - distance[180, 240]) < 0.1
    assert crate.sum() > 1000
    off = [np.abs(picture - pictures["none"])[crate].mean() for picture in (pictures["gather"], focused)]
    assert off[1] < 1 < 0.5 * off[0]


@linux
def test_files_are_dropped_and_read_again(display, scene_file, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    (tmp_path / "bad.yaml").write_text("version: 1\nobjects: [{asset: ball}]\n")
    (tmp_path / "broken.ply").write_text("no mesh")
    with Program(scene_file, tmp_path, environment) as program:
        user = User(environment, tmp_path, program)
        user.find_window()
        _, start = user.screenshot()
        user.do("key", "z")
        for bad in ("bad.yaml", "broken.ply", "gone.yaml"):
            user.drop(tmp_path / bad)
            time.sleep(1)
        picture, camera = user.screenshot()
        assert camera == start
        assert np.abs(picture - headless_picture(scene_file, start, (480, 360))).mean() < 1

        user.drop(tmp_path / "ball.ply")
        user.wait_for_title("ball.ply")
        user.do("mousemove", 240, 180, "mousedown", 1, "mousemove_relative", 90, 0, "sleep", 0.3, "mouseup", 1)
        _, turned = user.screenshot()
        assert turned.target == pytest.approx((0, 0.8, 0), abs=0.02)  # the ball's middle
        assert turned.position[0] < -0.2

        user.drop(scene_file)
        user.wait_for_title("scene.yaml")
        user.do("keydown", "d", "sleep", 0.3, "keyup", "d", "sleep", 0.3)
        scene_file.write_text(SCENE.replace("position: [0.8, 0, 0]", "position: [0.8, 0, 2]"))
        user.do("key", "r", "sleep", 4)
        picture, moved = user.screenshot()
        assert moved.position[0] > 0.2
        assert np.abs(picture - headless_picture(scene_file, moved, (480, 360))).mean() < 1

        path = tmp_path / "path.yaml"
        path.write_text("version: 1\nkeyframes: [{time: 0, position: [0, 9, 9], target: [0, 0, 0]}]\n")
        user.drop(path)
        user.do("sleep", 1, "key", "p", "sleep", 0.5)
        assert user.screenshot()[1].position == (0, 9, 9)
        user.do("key", "Escape")
        (live,) = program.end()
    assert not any(live.values())


@linux
@pytest.mark.parametrize(("samples", "shown"), [(4, "msaa"), (2, "none")])
def test_multisampling_and_none_where_the_driver_has_too_few(
    display, scene_file, tmp_path, monkeypatch, samples, shown
):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    scene_file.write_text(SCENE + "render: {aa: msaa}\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with Program(scene_file, tmp_path, environment, samples) as program:
        user = User(environment, tmp_path, program)
        user.find_window()
        user.screenshot()  # it shows the scene
        user.do("key", "z", "sleep", 0.5)
        picture, camera = user.screenshot()
        user.do("key", "Escape")
        (live,) = program.end()
    assert not any(live.values())
    expected = {}
    for aa in ("msaa", "none"):
        scene = load_scene(scene_file, overrides={"render.aa": aa})
        with HeadlessRenderer(scene, SceneLibrary(scene.assets), (480, 360)) as headless:
            headless.draw(View(camera, (480, 360)))
            expected[aa] = headless.pixels()[..., :3].astype(int)
    off = {aa: np.abs(picture - each).mean() for aa, each in expected.items()}
    assert off[shown] < 0.5 * min(off[aa] for aa in off if aa != shown)


@linux
def test_without_a_display_the_reason_is_told(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(NoDisplay, match=r"cannot open a window: .*DISPLAY"):
        open_window("none", (64, 64))
