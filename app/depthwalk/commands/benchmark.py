"""Draw and time the frames of `depthwalk bench`, all representations in turn, by `bench.measure`."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import depthwalk
from depthwalk.bench.measure import Report, measure, sample_path
from depthwalk.commands.options import (
    CameraOptions,
    RepresentationName,
    representation,
)
from depthwalk.commands.output import open_headless
from depthwalk.commands.progress import frame_progress
from depthwalk.errors import InputError
from depthwalk.provenance import commit, machine
from depthwalk.render import kernels
from depthwalk.scene.path import CameraPath
from depthwalk.scene.scene import Scene

DEFAULT_FRAMES = 60  # of a camera that stands still


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Say what to measure.

    Attributes
    ----------
    scene
        The scene to draw.
    path_file, path
        The camera path's file and the path; None for a camera that stands still.
    camera
        Changes to the camera that stands still.
    frames
        Number of measured frames; None is every frame of the path, or `DEFAULT_FRAMES` of a camera that stands still.
    warmup
        Number of frames that are drawn before the first is measured.
    size
        (width, height) of the pictures, pixels.
    representations
        The ways to draw every object, which take turns.
    pictured
        Returns the numbers of the frames whose pictures are kept, given how many there are; None keeps none.
    """

    scene: Scene
    path_file: Path | None
    path: CameraPath | None
    camera: CameraOptions
    frames: int | None
    warmup: int
    size: tuple[int, int]
    representations: Sequence[RepresentationName]
    pictured: Callable[[int], Sequence[int]] | None = None

    @property
    def frame_count(self) -> int:
        """Return how many frames are measured of each representation."""
        if self.frames is not None:
            return self.frames
        return DEFAULT_FRAMES if self.path is None else len(self.path.frames())


def parse_representations(texts: Sequence[str] | None) -> list[RepresentationName]:
    """Return the representations that the options --representation name, each once.

    Parameters
    ----------
    texts
        The text of each option, names with commas between; None, where there is none, means `scene` alone.

    Returns
    -------
    list[RepresentationName]
        The names, in the order of the texts.

    Raises
    ------
    InputError
        For a name that does not exist.
    """
    names = [name.strip() for text in texts or ["scene"] for name in text.split(",")]
    unknown = [name for name in names if name not in set(RepresentationName)]
    if unknown:
        raise InputError(f"--representation {unknown[0]}: must be one of {', '.join(RepresentationName)}")
    return [RepresentationName(name) for name in dict.fromkeys(names)]


def run_bench(plan: Plan) -> Report:
    """Draw and time the frames of a plan in each of its representations.

    Parameters
    ----------
    plan
        The scene, its cameras, and the representations.

    Returns
    -------
    Report
        The times, with a run for each representation.

    Raises
    ------
    InputError
        Where an asset cannot be used.
    GpuError
        Where no OpenGL 3.3 context can be created.
    """
    kernels.load()
    with ExitStack() as opened:
        drawn = {
            str(name): opened.enter_context(open_headless(plan.scene, plan.size, representation(name)))
            for name in plan.representations
        }
        first = next(iter(drawn.values()))
        for headless in drawn.values():
            headless.renderer.remembers = True
        if plan.path is not None:
            cameras = sample_path(plan.path, plan.frames)
        else:
            still = plan.camera.apply(plan.scene.camera or first.frame_all())
            cameras = [still] * plan.frame_count
        pictured = plan.pictured(len(cameras)) if plan.pictured else ()
        with frame_progress(", ".join(drawn), len(cameras) * len(drawn)) as advance:
            runs = measure(drawn, cameras, plan.warmup, advance, pictured)
        renderer, timer = first.device.renderer, first.renderer.timers.kind
        driver = first.device.driver
    return Report(
        version=depthwalk.__version__,
        commit=commit(),
        date=datetime.now().astimezone().isoformat(timespec="seconds"),
        machine=machine(),
        renderer=renderer,
        driver=driver,
        timer=timer,
        planning="compiled" if kernels.loaded() else "numpy",
        resolution=plan.size,
        scene=str(plan.scene.path),
        path=None if plan.path_file is None else str(plan.path_file),
        stride=None if plan.path is None else (len(plan.path.frames()) - 1) / max(len(cameras) - 1, 1),
        runs=tuple(runs),
    )
