"""The six measures of every view, and what they come to over the views."""

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from depthwalk.bake.model import BakedModel
from depthwalk.ingest.mesh import Mesh
from depthwalk.quality import metrics
from depthwalk.quality.twin import Pair, TwinRenderer
from depthwalk.quality.views import SPHERE, Viewpoint
from depthwalk.scene.render_settings import RenderSettings

MOST_WAITING = 8  # views whose FLIP is not done: bounds the memory of their pictures
MOST_WORKERS = 4
FLATTEST = 0.01  # height over extent; what lies flatter is measured by its extent


@dataclass(frozen=True)
class ViewQuality:
    """One view. psnr: dB, +inf for equal pictures; iou, flip: 0–1; holes: % of the mesh's pixels; depth_median,
    depth_p99: parts of the object's height, NaN without common pixels. pixels: of the mesh. See `metrics`."""

    viewpoint: Viewpoint
    pixels: int
    psnr: float
    iou: float
    flip: float
    holes: float
    depth_median: float
    depth_p99: float


@dataclass(frozen=True)
class Quality:
    """The views that show anything, in the order they were asked for. gpu_bytes: of the depth images."""

    views: tuple[ViewQuality, ...]
    gpu_bytes: int


def measure(
    mesh: Mesh,
    baked: BakedModel,
    settings: RenderSettings,
    size: tuple[int, int] = (1024, 768),
    viewpoints: Sequence[Viewpoint] = SPHERE,
    pool: Executor | None = None,
) -> Quality:
    """Image quality of `baked` against `mesh`, of which it was made. size: (width, height), pixels.

    pool: other processes for FLIP, which takes longer than all else. Raises GpuError without OpenGL.
    """
    with TwinRenderer(mesh, baked, settings, size) as twin:
        return Quality(measure_views(twin, object_height(mesh), viewpoints, pool), twin.gpu_bytes)


def measure_views(
    twin: TwinRenderer,
    height: float,
    viewpoints: Sequence[Viewpoint],
    pool: Executor | None = None,
    advance: Callable[[], None] = lambda: None,
) -> tuple[ViewQuality, ...]:
    """The views of `viewpoints` in which either picture shows anything. height: `object_height`, metres; `advance` is
    called after each view."""
    started: list[tuple[ViewQuality, Future[float]]] = []
    for viewpoint in viewpoints:
        if len(started) >= MOST_WAITING:
            started[-MOST_WAITING][1].result()
        view = _start(twin.pair(viewpoint), viewpoint, height, pool)
        started += [] if view is None else [view]
        advance()
    return tuple(replace(view, flip=flip.result()) for view, flip in started)


def view_quality(pair: Pair, viewpoint: Viewpoint, height: float) -> ViewQuality | None:
    """The measures of one pair of pictures; None where neither shows anything."""
    started = _start(pair, viewpoint, height, None)
    return None if started is None else replace(started[0], flip=started[1].result())


def object_height(mesh: Mesh) -> float:
    """What depth errors are divided by, metres: the height; of what is flatter than `FLATTEST`, the largest extent."""
    low, high = mesh.bounds
    extent = (high - low).astype(np.float64)
    return float(extent[1] if extent[1] >= FLATTEST * extent.max() else extent.max())


@contextmanager
def flip_workers() -> Iterator[Executor]:
    """Processes for FLIP, which holds Python's lock while it computes. Spawned: no GL context survives a fork."""
    workers = min(os.cpu_count() or 1, MOST_WORKERS)
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _start(
    pair: Pair, viewpoint: Viewpoint, height: float, pool: Executor | None
) -> tuple[ViewQuality, Future[float]] | None:
    """The measures of a pair but for FLIP, which is in the making; None where neither picture shows anything."""
    reference, test = pair.mesh.covered, pair.dpci.covered
    union = reference | test
    if not union.any():
        return None
    window = metrics.bounding_window(union, metrics.FLIP_REACH)
    cropped = pair.mesh.pixels[window], pair.dpci.pixels[window], union[window]
    flip = _submit(pool, metrics.mean_flip, *cropped)
    median, high = metrics.depth_errors(pair.mesh.distance[window], pair.dpci.distance[window], height)
    view = ViewQuality(
        viewpoint,
        pixels=int(reference.sum()),
        psnr=metrics.psnr(*cropped),
        iou=metrics.silhouette_iou(reference[window], test[window]),
        flip=float("nan"),
        holes=metrics.hole_percent(reference, test),
        depth_median=median,
        depth_p99=high,
    )
    return view, flip


def _submit(pool: Executor | None, work: Callable[..., float], *arguments: Any) -> Future[float]:
    """`work` in the pool, or done here and now."""
    if pool is not None:
        return pool.submit(work, *arguments)
    done: Future[float] = Future()
    done.set_result(work(*arguments))
    return done
