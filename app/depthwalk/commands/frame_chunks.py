"""Draw the frames of a camera path on a cluster, one chunk of them at a time."""

import hashlib
import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from depthwalk.assets.demand import cook_options
from depthwalk.assets.library import SceneLibrary
from depthwalk.cluster import worker, zygote
from depthwalk.cluster.connection import Cluster
from depthwalk.cluster.tasks import Progress, Task, TaskError, run_tasks
from depthwalk.commands.frame_drawing import draw_frame, smooth
from depthwalk.commands.frame_keys import FrameKeys, frame_keys
from depthwalk.commands.option_values import open_scene, representation
from depthwalk.commands.options import RepresentationName
from depthwalk.commands.output import Output, has_frame, write_still
from depthwalk.commands.program import without_garbage_collection
from depthwalk.cook.cook import MOST_PREFETCHED
from depthwalk.errors import InputError
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.up_axis import stand_upright
from depthwalk.render.view.view import View
from depthwalk.scene.path import CameraPath, load_path
from depthwalk.scene.scene import Scene

log = logging.getLogger("depthwalk")

_CHUNK = 16  # frames: the cluster's overhead of milliseconds per task is then a hundredth of the time for 20 ms frames


@dataclass(frozen=True, kw_only=True)
class RenderJob:
    """Describe what to draw, by names that mean the same on every worker.

    Attributes
    ----------
    scene, path
        The scene file and the camera path's file, absolute.
    asset_roots
        Folders, besides the scene's own, in which to look for its files, absolute.
    settings
        The --set options.
    sky
        The picture of the option --sky, absolute; None if it is not given.
    size
        (width, height) of the pictures, pixels.
    representation
        How to draw every object.
    output
        Where the frames are written, a series of files.
    key
        The result that `RenderJob.keys` must give: a worker that sees other files draws nothing.
    """

    scene: Path
    path: Path
    asset_roots: tuple[Path, ...]
    settings: tuple[str, ...]
    sky: Path | None
    size: tuple[int, int]
    representation: RepresentationName
    output: Output
    key: str = ""

    def load(self) -> tuple[Scene, CameraPath, FrameKeys]:
        """Read scene and path; return them with the keys of the frames. Raises InputError for invalid files."""
        scene = open_scene(self.scene, self.asset_roots, self.settings, self.sky)
        if self.output.suffix != ".exr":  # its distances belong to the centres of pixels
            smooth(scene, self.size)
        return scene, load_path(self.path), self.keys(scene)

    def keys(self, scene: Scene) -> FrameKeys:
        """Return the keys of the frames of this job, whose scene is `scene`."""
        return frame_keys(
            scene,
            self.settings,
            size=self.size,
            representation=self.representation,
            output=self.output,
            sky=self.sky,
        )


def draw_on(
    cluster: Cluster, job: RenderJob, frames: Sequence[int], progress: Progress, check_interrupt: Callable[[], None]
) -> Iterator[tuple[Sequence[int], TaskError | None]]:
    """Draw frames on a cluster, and yield the frame numbers of each chunk as it ends.

    Every frame is drawn from scratch, so that it does not depend on the worker or on the chunk. Existing frames with
    the right key are skipped.

    Parameters
    ----------
    cluster
        The cluster that draws the frames; its workers see the same files under the same names.
    job
        What to draw.
    frames
        The numbers of the frames.
    progress, check_interrupt
        As in `run_tasks`.

    Yields
    ------
    tuple
        The frames of a chunk; and the reason if not all could be drawn, else None.

    Raises
    ------
    InputError
        If a worker cannot use the scene: then none can.
    ClusterError
        If the cluster is lost for good.
    """
    size = max(1, min(_CHUNK, len(frames) // (4 * max(cluster.workers(), 1))))
    chunks = [frames[first : first + size] for first in range(0, len(frames), size)]
    tasks = [Task(key=f"render-{_name(job, chunk)}", function=draw_chunk, arguments=(job, chunk)) for chunk in chunks]
    for number, outcome in run_tasks(cluster, tasks, progress, check_interrupt):
        if isinstance(outcome, InputError):
            raise outcome
        yield chunks[number], outcome if isinstance(outcome, TaskError) else None


def _name(job: RenderJob, chunk: Sequence[int]) -> str:
    return hashlib.sha256(repr((job, chunk)).encode()).hexdigest()


@dataclass(frozen=True, kw_only=True)
class _Drawer:
    """Hold what a worker keeps from chunk to chunk."""

    headless: HeadlessRenderer
    path: CameraPath
    keys: FrameKeys


def draw_chunk(job: RenderJob, frames: Sequence[int]) -> int:
    """Draw frames in a worker, which keeps the renderer and its single GL context for the next chunk of the same job.

    Parameters
    ----------
    job
        What to draw.
    frames
        The numbers of the frames; existing ones are skipped.

    Returns
    -------
    int
        Number of frames drawn.

    Raises
    ------
    InputError
        If the scene cannot be used, or is not the one that the caller read.
    GpuError
        If no OpenGL 3.3 context can be created, or the GPU fails repeatedly.
    """
    drawer: _Drawer = worker.keep(job, lambda stack: _open(job, stack))
    drawn = 0
    for frame in frames:
        camera = drawer.path.sample(frame / drawer.path.fps)
        key = drawer.keys.key(camera)
        if not has_frame(job.output, frame, key):
            picture = draw_frame(drawer.headless, View(camera, job.size), job.output, frame)
            write_still(picture, job.output, frame, key)
            drawn += 1
    return drawn


@dataclass(frozen=True, kw_only=True)
class _Inputs:
    """Hold what is read for a job before anything is drawn."""

    scene: Scene
    path: CameraPath
    keys: FrameKeys
    library: SceneLibrary


def _open(job: RenderJob, stack: ExitStack) -> _Drawer:
    inputs: _Inputs | None = zygote.inherited(job)
    if inputs is None:
        inputs = _read(job)
        zygote.ask(job, read_ahead)
    scene = inputs.scene
    headless = HeadlessRenderer(scene, inputs.library, job.size, representation(job.representation))
    stack.enter_context(headless)
    stand_upright(scene, headless.renderer)
    return _Drawer(headless=headless, path=inputs.path, keys=inputs.keys)


def _read(job: RenderJob) -> _Inputs:
    """Read scene and path. Raises InputError if they are not those that the caller of `draw_on` has read."""
    scene, path, keys = job.load()
    if keys.scene != job.key:
        raise InputError(
            f"{job.scene}: a worker has another version of the scene, of a file that it names, or of depthwalk"
        )
    return _Inputs(scene=scene, path=path, keys=keys, library=SceneLibrary(scene.assets))


def read_ahead(job: RenderJob) -> object:
    """Return what a worker that replaces one of the same job needs, in the form for `zygote.ask`; bake nothing.

    Raises InputError if the worker would.
    """
    with without_garbage_collection():
        inputs = _read(job)
        used = np.unique(inputs.scene.objects.asset).tolist()
        inputs.library.read_ahead(used, cook_options(inputs.scene.render), MOST_PREFETCHED)
    return inputs
