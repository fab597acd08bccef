"""Measure one row of the table of docs/bench.md: objects drawn in several ways with equally good pictures.

The ways are meshes, simplified meshes, mesh clusters, and the scene as it is: depth images, replaced by meshes nearby
and where these are quicker. Meshes are simplified until their FLIP against a supersampled picture is that of the scene,
and only then are frames timed.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np

from depthwalk.assets.library import SceneLibrary
from depthwalk.bench.equal import SUPERSAMPLING, coarsened, path_flip, supersampled
from depthwalk.bench.measure import Run, measure
from depthwalk.bench.table_walk import SETTLING, Walk, most_seen
from depthwalk.gpu.timers import frame_clock
from depthwalk.provenance import commit
from depthwalk.render import kernels
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.scene import Scene
from depthwalk.types import Picture

MOST_MESHES = 100  # objects; above, the reference uses simplified meshes, since it would take hours otherwise
REFERENCE_ERROR = 0.05  # pixels, of those meshes
_AFTER_JUMP = 2  # frames of the other columns before their timed ones, since the first has no impostors to reuse


@dataclass(frozen=True, kw_only=True)
class Column:
    """Hold the measurements of one way to draw the objects.

    Attributes
    ----------
    frame_ms
        Mean time of a frame, milliseconds: with a software rasteriser, processor time of all threads, which other
        programs do not lengthen; otherwise wall-clock time. It is not a median, since impostors are warped in some
        frames only.
    frames
        Number of timed frames.
    flip
        Mean FLIP over the moments, 0 to 1; None if nothing was compared.
    setting
        The error of simplified meshes that was found, as `error=PIXELS`; "" if none was searched for.
    passes_ms
        Time of each pass by its name, milliseconds: the median over the moments.
    counts
        What was drawn, by name: medians over the moments.
    """

    frame_ms: float
    frames: int
    flip: float | None
    setting: str
    passes_ms: dict[str, float]
    counts: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class Row:
    """Hold the measurements of all ways to draw a given number of objects.

    Attributes
    ----------
    objects
        Number of objects.
    reference
        A text that describes how the reference pictures were drawn.
    commit
        Commit of the checkout that measured; None if the package is installed.
    columns
        The measurements of each way to draw the objects, by the names in `COLUMNS`.
    """

    objects: int
    reference: str
    commit: str | None
    columns: dict[str, Column]


def row_from(document: dict[str, Any]) -> Row:
    """Return the row of an earlier table, so that it need not be measured again.

    Parameters
    ----------
    document
        The result of `dataclasses.asdict` for the row, as read from JSON.

    Returns
    -------
    Row
        The row.

    Raises
    ------
    TypeError, KeyError
        For a document of another shape.
    """
    columns = {name: Column(**column) for name, column in document["columns"].items()}
    return Row(**document | {"columns": columns})


COLUMNS: dict[str, Representation | None] = {
    "mesh": Representation.MESH,
    "mesh-lod": Representation.MESH_LOD,
    "mesh-clusters": Representation.MESH_CLUSTERS,
    "unoccluded": Representation.MESH_LOD,  # everything in the frustum
    "re-warped": None,  # everything in every frame
    "scene": None,
}
"""The ways to draw the objects, in the order of the table; None follows the scene."""

_ERRORS = -4, 7  # of the meshes that are tried, as powers of two: 1/16, about that of the reference, to 128 pixels


def make_row(
    walk: Walk, scene: Scene, library: SceneLibrary, count: int, pool: Executor, report: Callable[[str], None]
) -> Row:
    """Tune and time every way to draw objects, for some of the scene's objects.

    Parameters
    ----------
    walk
        The frames to draw.
    scene
        The scene, whose settings are copied.
    library
        The scene's assets.
    count
        Number of objects to draw; `most_seen` selects them.
    pool
        Processes that compute FLIP.
    report
        Called with a text that describes the current stage.

    Returns
    -------
    Row
        The measurements.

    Raises
    ------
    InputError
        If an asset cannot be used.
    GpuError
        If no OpenGL 3.3 context can be created.
    """
    scene = replace(scene, objects=scene.objects.take(most_seen(scene, walk, count)))
    kernels.load()
    report("reference")
    described, pictures = references(walk, scene, library)
    with ExitStack() as opened:
        drawn = {name: opened.enter_context(_open(scene, library, walk.size, kind)) for name, kind in COLUMNS.items()}
        for name, headless in drawn.items():
            headless.renderer.remembers = name != "re-warped"
        drawn["unoccluded"].renderer.settings.culling.occlusion = False
        report("tuning")
        tuned = _tuned(walk, drawn, pictures, pool)
        report("timing")
        runs = _timed(walk, drawn)
        software = drawn["scene"].device.software
    return Row(
        objects=count,
        reference=described,
        commit=commit(),
        columns={name: _column(runs[name], tuned.get(name), software) for name in drawn},
    )


def _open(
    scene: Scene, library: SceneLibrary, size: tuple[int, int], representation: Representation | None
) -> HeadlessRenderer:
    """Return a renderer with its own copy of the settings."""
    return HeadlessRenderer(replace(scene, render=scene.render.model_copy(deep=True)), library, size, representation)


def references(walk: Walk, scene: Scene, library: SceneLibrary) -> tuple[str, list[Picture]]:
    """Return a description of the reference, and its pictures at the compared moments."""
    size = walk.size[0] * SUPERSAMPLING, walk.size[1] * SUPERSAMPLING
    exact = len(scene.objects) <= MOST_MESHES
    with _open(scene, library, size, Representation.MESH if exact else Representation.MESH_LOD) as headless:
        headless.renderer.settings.mesh.error = REFERENCE_ERROR * SUPERSAMPLING
        pictures = supersampled(headless, walk.compared)
    kind = "mesh" if exact else f"mesh-lod within {REFERENCE_ERROR:g} pixels"
    return f"{kind}, {SUPERSAMPLING**2} samples a pixel", pictures


def _tuned(
    walk: Walk, drawn: dict[str, HeadlessRenderer], references: list[Picture], pool: Executor
) -> dict[str, tuple[str, float]]:
    """Return the setting and the FLIP of each column.

    The target is the FLIP of the scene along the path, with its own settings, or that of the finest mesh if this is
    worse; meshes are made as coarse as the target allows.
    """
    stills = [[camera] for camera in walk.compared]

    @cache  # settings that determine the target are evaluated again
    def flip_at(name: str, power: float) -> float:
        drawn[name].renderer.settings.mesh.error = _error(power)
        return path_flip(drawn[name], stills, references, pool)

    tuned = {"scene": ("", path_flip(drawn["scene"], walk.approaches, references, pool))}
    tuned["re-warped"] = "", path_flip(drawn["re-warped"], stills, references, pool)
    target = max(tuned["scene"][1], flip_at("mesh-lod", _ERRORS[0]))
    for name in ("mesh-lod", "mesh-clusters"):
        power, flip = coarsened(partial(flip_at, name), *_ERRORS, target)
        drawn[name].renderer.settings.mesh.error = _error(power)
        tuned[name] = f"error={_error(power):g}", flip
    drawn["unoccluded"].renderer.settings.mesh.error = drawn["mesh-lod"].renderer.settings.mesh.error
    tuned["unoccluded"] = tuned["mesh-lod"]
    if len(drawn["mesh"].renderer.world.objects()) <= MOST_MESHES:
        tuned["mesh"] = "", path_flip(drawn["mesh"], stills, references, pool)
    return tuned


def _error(power: float) -> float:
    """Return `render.mesh.error`, pixels, of a power of two."""
    return float(round(2.0**power, 3))


def _timed(walk: Walk, drawn: dict[str, HeadlessRenderer]) -> dict[str, list[Run]]:
    """Return the runs of each column, one for each moment, alternating; slow columns stop early."""
    runs: dict[str, list[Run]] = {name: [] for name in drawn}
    left = dict.fromkeys(drawn, 1e3 * walk.seconds)
    for moment in walk.moments:
        for name, headless in drawn.items():
            if runs[name] and left[name] <= 0:
                continue
            frame_ms = 0.0
            for camera in moment[:SETTLING] if name == "scene" else moment[SETTLING - _AFTER_JUMP : SETTLING]:
                frame_ms = _frame_ms(headless, camera)
            affordable = max(1, int(left[name] / frame_ms))
            (run,) = measure({name: headless}, moment[SETTLING:][:affordable], 0, lambda: None)
            runs[name].append(run)
            left[name] -= sum(_times(run, headless.device.software))
    return runs


def _frame_ms(headless: HeadlessRenderer, camera: Camera) -> float:
    """Draw a frame, and return its time, milliseconds, by the clock of `Column.frame_ms`."""
    clock = frame_clock(headless.device)
    start = clock()
    headless.draw(View(camera, headless.size))
    headless.finish()
    return 1e3 * (clock() - start)


def _times(run: Run, software: bool) -> Sequence[float]:
    """Return the milliseconds of each frame: processor time with a software rasteriser, otherwise wall-clock time."""
    if not software:
        return run.frame_times
    assert run.trace is not None  # it was measured, not read from a file
    return run.trace.work["processor_ms"]


def _column(runs: list[Run], tuned: tuple[str, float] | None, software: bool) -> Column:
    times = [time for run in runs for time in _times(run, software)]
    setting, flip = tuned or ("", None)
    return Column(
        frame_ms=round(float(np.mean(times)), 3),
        frames=len(times),
        flip=flip,
        setting=setting,
        passes_ms=_medians([{name: spread.p50 for name, spread in run.passes_ms.items()} for run in runs]),
        counts=_medians([run.counts for run in runs]),
    )


def _medians(rows: list[dict[str, float]]) -> dict[str, float]:
    """Return the median of each name over all rows; a missing name counts as 0."""
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: round(float(np.median([row.get(name, 0.0) for row in rows])), 3) for name in names}
