"""`depthwalk view` and `depthwalk demo`: the window, and what is done where there is no display."""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from depthwalk.assets.library import SceneLibrary
from depthwalk.bench.measure import sample_path
from depthwalk.commands.options import CameraOptions
from depthwalk.commands.render import Output, draw_frames, open_headless, path_cameras
from depthwalk.errors import InputError
from depthwalk.resources import scene_root
from depthwalk.scene.arrays import Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import CameraPath
from depthwalk.scene.scene import Scene

DEMO_FOLDER = Path("depthwalk-demo")
STILLS = 6


@dataclass(frozen=True)
class Walk:
    """What to show. size: (width, height), pixels; representation: None leaves it to the scene; camera: what to change
    about the scene's, or about the one that sees all of it; read: as `walk.run` takes it."""

    scene: Scene
    path: CameraPath | None
    size: tuple[int, int]
    representation: Representation | None
    camera: CameraOptions = field(default_factory=CameraOptions)
    fullscreen: bool = False
    read: Callable[[Path], Scene] = load_scene


def garden() -> Path:
    """The demo's scene. Raises InputError where the installation lacks it."""
    return _shipped(scene_root() / "garden.yaml")


def garden_tour() -> Path:
    """The walk through it. Raises InputError where the installation lacks it."""
    return _shipped(scene_root() / "paths" / "garden.yaml")


def open_walk(walk: Walk) -> str | None:
    """Opens the window and stays until it is closed; returns why there is none where there is no display."""
    from depthwalk.walk import NoDisplay, run  # the window's libraries: half a second

    library = SceneLibrary(walk.scene.assets, processes=None)
    try:
        run(
            walk.scene,
            library,
            path=walk.path,
            fullscreen=walk.fullscreen,
            size=walk.size,
            representation=walk.representation,
            first_camera=walk.camera.apply,
            read=walk.read,
        )
    except NoDisplay as error:
        return str(error)
    return None


def demo(walk: Walk, tour: CameraPath, frames: int | None) -> None:
    """The window, or the tour (its first `frames` frames) as a video and stills in `DEMO_FOLDER`."""
    reason = open_walk(walk)
    if reason is None:
        return
    folder = DEMO_FOLDER
    print(f"{reason}; rendering the tour to {folder.resolve()}", file=sys.stderr)
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from None
    stills, video = Output(str(folder / "garden-{frame:2}.png")), Output(str(folder / "garden.mp4"))
    with open_headless(walk.scene, walk.size, walk.representation) as headless:
        draw_frames(headless, sample_path(tour, STILLS)[: frames or STILLS], stills, tour.fps)
        draw_frames(headless, path_cameras(tour, frames), video, tour.fps)


def _shipped(file: Path) -> Path:
    if not file.is_file():
        raise InputError(f"{file}: no such file; the demo scene is not installed")
    return file
