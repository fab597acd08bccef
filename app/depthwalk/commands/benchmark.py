"""Draw and time the frames of `depthwalk bench`, one representation after the other, by `bench.measure`."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import depthwalk
from depthwalk.bench.measure import Report, Run, measure, sample_path
from depthwalk.commands.options import (
    CameraOptions,
    RepresentationName,
    representation,
)
from depthwalk.commands.output import open_headless
from depthwalk.commands.progress import frame_progress
from depthwalk.errors import InputError
from depthwalk.provenance import commit
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
        The ways to draw every object, which are measured one after the other.
    """

    scene: Scene
    path_file: Path | None
    path: CameraPath | None
    camera: CameraOptions
    frames: int | None
    warmup: int
    size: tuple[int, int]
    representations: Sequence[RepresentationName]


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
    runs: list[Run] = []
    kernels.load()
    for name in plan.representations:
        with open_headless(plan.scene, plan.size, representation(name)) as headless:
            headless.renderer.remembers = True
            if plan.path is not None:
                cameras = sample_path(plan.path, plan.frames)
            else:
                still = plan.camera.apply(plan.scene.camera or headless.frame_all())
                cameras = [still] * (plan.frames or DEFAULT_FRAMES)
            with frame_progress(name, len(cameras)) as advance:
                runs.append(measure(headless, name, cameras, plan.warmup, advance))
            renderer, timer = headless.device.renderer, headless.renderer.timers.kind
    return Report(
        version=depthwalk.__version__,
        commit=commit(),
        renderer=renderer,
        timer=timer,
        planning="compiled" if kernels.loaded() else "numpy",
        resolution=plan.size,
        scene=str(plan.scene.path),
        path=None if plan.path_file is None else str(plan.path_file),
        runs=tuple(runs),
    )
