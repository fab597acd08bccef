"""`depthwalk view` and `depthwalk demo`: the window, and what is done where there is no display."""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

from depthwalk.bench.measure import sample_path
from depthwalk.commands.options import CameraOptions
from depthwalk.commands.render import Output, path_cameras, render_frames
from depthwalk.errors import InputError
from depthwalk.library import SceneLibrary
from depthwalk.resources import scene_root
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.path import CameraPath
from depthwalk.scene.scene import Scene

DEMO_FOLDER = Path("depthwalk-demo")
STILLS = 6


@dataclass(frozen=True)
class Walk:
    """What to show. size: (width, height), pixels; representation: None leaves it to the scene."""

    scene: Scene
    path: CameraPath | None
    size: tuple[int, int]
    representation: Representation | None
    camera: Camera | None = None
    fullscreen: bool = False


def garden() -> Path:
    """The demo's scene. Raises InputError where the installation lacks it."""
    return _shipped(scene_root() / "garden.yaml")


def garden_tour() -> Path:
    """The walk through it. Raises InputError where the installation lacks it."""
    return _shipped(scene_root() / "paths" / "garden.yaml")


def start_camera(scene: Scene, options: CameraOptions) -> Camera | None:
    """Where the walk begins; None leaves it to the window, which knows what the scene's objects span.

    Raises InputError for options that say too little where the scene has no camera.
    """
    if scene.camera is not None or not options.given:
        return scene.camera and options.apply(scene.camera)
    if options.position is None or options.target is None:
        raise InputError(f"{scene.path}: has no camera: give --camera-position and --camera-target together")
    return options.apply(Camera(options.position, options.target, math.pi / 3))


def open_walk(walk: Walk) -> str | None:
    """Opens the window and stays until it is closed; returns why there is none where there is no display."""
    from depthwalk.walk import NoDisplay, run  # the window's libraries: half a second

    library = SceneLibrary(walk.scene.assets)
    try:
        run(
            walk.scene,
            library,
            path=walk.path,
            fullscreen=walk.fullscreen,
            size=walk.size,
            representation=walk.representation,
            camera=walk.camera,
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
    look = walk.size, walk.representation, tour.fps
    stills = sample_path(tour, STILLS)[: frames or STILLS]
    render_frames(walk.scene, stills, Output(str(folder / "garden-{frame:2}.png")), *look)
    render_frames(walk.scene, path_cameras(tour, frames), Output(str(folder / "garden.mp4")), *look)


def _shipped(file: Path) -> Path:
    if not file.is_file():
        raise InputError(f"{file}: no such file; the demo scene is not installed")
    return file
