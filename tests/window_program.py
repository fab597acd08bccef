"""The walk in a process of its own, which tells of every frame what it shows, and a user at its keyboard and mouse."""

import contextlib
import json
import math
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngImageFile

from depthwalk.scene.arrays import Camera
from depthwalk.types import Rows

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
import gc, json, signal, sys
from pathlib import Path
gc.disable()  # while importing, as the program does
import depthwalk.walk as walk
import depthwalk.walk.app as app
import depthwalk.walk.fields as fields
import depthwalk.walk.panel as panel
import glfw
from depthwalk.assets.library import SceneLibrary
from depthwalk.render import kernels
from depthwalk.scene.loader import load_scene
from depthwalk.scene.models import load_files
from depthwalk.walk import file_watch

class WatchedDevice(app.Device):
    def __init__(self, *values):
        super().__init__(*values)
        self.max_samples = min(self.max_samples, int(sys.argv[2]))
        devices.append(self)

class WatchedScreen(app.LoadingScreen):
    def begin(self, title):
        super().begin(title)
        tell(begins=title, over=None if self.backdrop is None else self.backdrop.size)

    def report(self, name, stage):
        tell(loading=name)
        super().report(name, stage)

class WatchedWidgets:  # imgui, of which it is noted where buttons and check boxes are
    def __getattr__(self, name):
        return getattr(native, name)

    def button(self, label, *values):
        return noted(label, native.button(label, *values))

    def checkbox(self, label, on):
        return noted(label, native.checkbox(label, on))

def noted(label, answer):
    low, high = native.get_item_rect_min(), native.get_item_rect_max()
    pixels = native.get_io().display_framebuffer_scale.x  # to a unit of widget coordinates
    places[label] = pixels * (low.x + 9), pixels * (low.y + high.y) / 2
    return answer

def tell(**facts):
    print(json.dumps(facts), flush=True)

def watched_step(walk):
    step(walk)
    state, window = walk.state, walk.window
    frames.append(1)
    is_copied = state._toast.message.startswith("Copied")
    tell(
        frame=len(frames),
        title=window.title,
        size=window.buffer_size,
        hud=state.hud,
        captured=bool(window.mouse_exclusivity),
        fast=state.fast,
        message=state._toast.message,
        toast=state.toast,
        complaint=state.complaint,
        position=state.camera.position,
        look=tuple(state.camera.look),
        recorded=state.recorder.seconds if state.recorder else 0,
        focusing=state.pull.target is not None,
        inspected=state.inspected.number,
        focus=state.renderer.settings.dof.focus_distance,
        changed=state.changed,
        widgets=dict(places),
        copied=(glfw.get_clipboard_string(window._window) or b"").decode() if is_copied else "",
    )
    places.clear()

def drop_by_signal(window, action):
    on_files_dropped(window, action)
    dropped = glfw.set_drop_callback(window._window, None)

    def drop(*_):
        files = Path("dropped").read_bytes().splitlines()
        dropped(None, len(files), files)

    signal.signal(signal.SIGUSR1, drop)
    signal.signal(signal.SIGUSR2, lambda *_: window.close())

gc.freeze()
gc.enable()
if "compiled" not in sys.argv:
    kernels.load_behind = lambda: None

devices, frames, places = [], [], {}
file_watch._SECONDS = 0.1
native = panel.imgui
panel.imgui = fields.imgui = WatchedWidgets()
step, app.Walk.step = app.Walk.step, watched_step
app.Device, app.LoadingScreen = WatchedDevice, WatchedScreen
on_files_dropped, app.on_files_dropped = app.on_files_dropped, drop_by_signal
scene = load_scene(sys.argv[1])
models = lambda files: ["model"] if len(files) == 1 else [file.stem for file in files]
quick = lambda files: {f"assets.{name}.dpci.resolution": "64" for name in models(files)}
read = lambda files: load_files(files, overrides=quick(files) if files[0].suffix in (".ply", ".obj") else {})
watched = lambda scene: [scene.path] if scene.path.name == "watched.yaml" else []
walk.run(scene, SceneLibrary(scene.assets), walk.WalkOptions(read=read, watched=watched), size=(480, 360))
tell(live=[device.live for device in devices])
"""
PATIENCE = 120  # s that anything may take on a busy machine
Report = dict[str, Any]  # what the program tells: JSON, by name


def is_after(frame: int) -> Callable[[Report], bool]:
    """Whether a report is of a later frame than this."""
    return lambda report: report.get("frame", 0) > frame


def names(file: str) -> Callable[[Report], bool]:
    """Whether a report's message names this file."""
    return lambda report: file in report.get("message", "")


class Program:
    """The walk in a process of its own, with up to so many samples per pixel; collects what it tells.

    compiled: whether it loads the compiled loops, as the program does, which takes as long as to start without them.
    """

    def __init__(self, scene_file: Path, folder: Path, samples: int, compiled: bool) -> None:
        self.folder = folder
        self.told: list[Report] = [{}]
        self._news = threading.Condition()
        with (folder / "errors").open("w") as errors:
            self.process = subprocess.Popen(
                [sys.executable, "-c", DRIVER, str(scene_file), str(samples), *["compiled"] * compiled],
                env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
                cwd=folder, text=True, stdout=subprocess.PIPE, stderr=errors, start_new_session=True,
            )  # fmt: skip
        self._listener = threading.Thread(target=self._listen)
        self._listener.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)  # with those that bake for it, which hold its output open
        self._listener.join()
        assert self.process.stdout is not None
        self.process.stdout.close()
        self.process.wait()

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith("{"):
                with self._news:
                    self.told.append(json.loads(line))
                    self._news.notify_all()
        with self._news:
            self.told.append({"ended": True})
            self._news.notify_all()

    @property
    def errors(self) -> str:
        return (self.folder / "errors").read_text()

    def wait(self, wanted: Callable[[Report], object], what: object) -> Report:
        """The first report, from now on, for which `wanted` holds."""
        with self._news:
            seen = len(self.told) - 1
            assert self._news.wait_for(lambda: self._find(wanted, seen) or "ended" in self.told[-1], PATIENCE), what
            found = self._find(wanted, seen)
        assert found, f"{what}: {self.errors}"
        return found

    def _find(self, wanted: Callable[[Report], object], start: int) -> Report | None:
        return next((report for report in self.told[start:] if wanted(report)), None)

    def wait_for(self, **facts: Any) -> Report:
        """The first report, from now on, that says so."""
        return self.wait(lambda report: facts.items() <= report.items(), facts)

    def wait_frames(self, count: int = 2) -> None:
        """Until so many frames were begun and shown from now on."""
        first = self.wait(lambda report: "frame" in report, "a frame")["frame"]
        self.wait(lambda report: report.get("frame", 0) >= first + count, f"{count} frames")

    def wait_still(self) -> Report:
        """The first frame, from now on, in which the camera stands where it stood in the frame before."""
        places: list[NDArray[Any]] = []

        def is_still(report: Report) -> bool:
            if "frame" in report:
                places.append(np.ravel((report["position"], report["look"])))
            return len(places) > 2 and np.allclose(places[-2], places[-1], atol=1e-5, rtol=0)

        while True:  # each report is judged once: `places` remembers
            report = self.wait(lambda report: "frame" in report, "a frame")
            if is_still(report):
                return report
            self.wait(is_after(report["frame"]), "another frame")

    def end(self) -> dict[str, int]:
        """The GL objects that were left, once it ended well."""
        assert self.process.wait(PATIENCE) == 0, self.errors
        self._listener.join()
        live: dict[str, int]
        (live,) = self.told[-2]["live"]
        return live


class User:
    """Works the keyboard and the mouse of a program's display; begins when the program shows its window."""

    def __init__(self, program: Program) -> None:
        self.program = program
        program.wait(lambda report: report, "the first report")  # comes once there is a window
        self.window = self._focus()

    def do(self, *commands: object) -> str:
        command = ["xdotool", *map(str, commands)]
        return subprocess.run(command, check=True, capture_output=True, text=True, timeout=PATIENCE).stdout

    def _focus(self) -> str:
        """The number of the program's window, to which keys go from now on."""
        window = self.do("search", "--sync", "--onlyvisible", "--name", "depthwalk").split()[0]
        self.do("windowfocus", "--sync", window)
        return window

    def click(self, label: str) -> None:
        """Click on a button or check box of the panel, once it is shown."""
        shown = self.program.wait(lambda report: label in report.get("widgets", {}), label)
        x, y = map(round, shown["widgets"][label])
        self.do("mousemove", "--window", self.window, x, y)
        self.program.wait_frames()  # imgui takes a click only where it has seen the mouse
        self.do("mousedown", 1)
        self.program.wait_frames()
        self.do("mouseup", 1)

    def drop(self, *files: Path) -> None:
        (self.program.folder / "dropped").write_text("\n".join(map(str, files)))
        self.program.process.send_signal(signal.SIGUSR1)

    def key(self, name: str, **facts: Any) -> Report:
        """Press a key; wait until the program tells what it did."""
        self.do("key", name)
        return self.program.wait_for(**facts)

    def screenshot(self) -> tuple[Rows, Camera]:
        """What the window shows: (H, W, 3) int, and its Camera."""
        self.program.wait_frames()
        before = set(self.program.folder.glob("*.png"))
        self.do("key", "F12")

        def saved(report: Report) -> Path | None:
            found = re.fullmatch(r"Saved (.*\.png)", report.get("message", ""))
            return None if found is None or Path(found[1]) in before else Path(found[1])

        file = saved(self.program.wait(saved, "a screenshot"))
        assert file is not None
        with Image.open(file) as image:
            assert isinstance(image, PngImageFile)
            return np.asarray(image, int), camera_of(image.text["Camera"])


def camera_of(text: str) -> Camera:
    read = json.loads(text)
    return Camera(tuple(read["position"]), tuple(read["target"]), math.radians(read["fov"]))


class Start(Protocol):
    """Starts the walk, with so many samples per pixel at most and with or without compiled loops, and its user."""

    def __call__(self, samples: int = 4, compiled: bool = False) -> User: ...
