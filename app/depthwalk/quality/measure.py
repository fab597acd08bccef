"""Take the six measures of a pair of pictures, for every view of an object."""

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
from depthwalk.quality.pair_renderer import Pair, PairRenderer
from depthwalk.quality.views import SPHERE, Viewpoint
from depthwalk.scene.render_settings import RenderSettings

MOST_WAITING = 8  # views whose FLIP is not computed yet: limits the memory of their pictures
MOST_WORKERS = 4
FLATTEST = 0.01  # height over extent; flatter objects are measured by their extent


@dataclass(frozen=True, kw_only=True)
class ViewQuality:
    """Hold the measures of one view, by which depth images are compared with their mesh; see `quality.metrics`.

    Attributes
    ----------
    viewpoint
        The viewpoint.
    pixels
        Number of pixels that the mesh covers.
    psnr
        Peak signal-to-noise ratio, dB, +inf for equal pictures.
    iou, flip
        Overlap of the silhouettes and mean FLIP error, each 0 to 1.
    holes
        Pixels of holes, per cent of the mesh's pixels.
    depth_median, depth_p99
        Median and 99th percentile of the depth error, in parts of the object's height; NaN if no pixel shows the object
        in both pictures.
    """

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
    """Hold the measures of all views, and the memory of the depth images.

    Attributes
    ----------
    views
        The views that show anything, in the order asked for.
    gpu_bytes
        Most GPU memory that the depth images took in any of the pictures, bytes.
    """

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
    """Compare pictures of depth images with pictures of their mesh.

    Parameters
    ----------
    mesh
        The mesh, asset frame, metres.
    baked
        Depth images of `mesh`.
    settings
        How mesh and depth images are rendered.
    size
        Width and height of the pictures, pixels.
    viewpoints
        The views to measure.
    pool
        Other processes that compute FLIP, which takes longer than everything else; None computes it in this process.

    Returns
    -------
    Quality
        The measures of each view.

    Raises
    ------
    GpuError
        If no OpenGL 3.3 context can be created.
    """
    with PairRenderer(mesh, baked, settings, size) as renderer:
        return Quality(measure_views(renderer, object_height(mesh), viewpoints, pool), renderer.gpu_bytes)


def measure_views(
    renderer: PairRenderer,
    height: float,
    viewpoints: Sequence[Viewpoint],
    pool: Executor | None = None,
    advance: Callable[[], None] = lambda: None,
) -> tuple[ViewQuality, ...]:
    """Measure the views in which either picture shows anything.

    Parameters
    ----------
    renderer
        Draws the mesh and its depth images.
    height
        Length by which depth errors are divided, metres, see `object_height`.
    viewpoints
        The views to measure.
    pool
        Other processes that compute FLIP; None computes it in this process.
    advance
        Called after each view.

    Returns
    -------
    tuple[ViewQuality, ...]
        The measures of each view that shows anything, in the order of `viewpoints`.
    """
    started: list[tuple[ViewQuality, Future[float]]] = []
    for viewpoint in viewpoints:
        if len(started) >= MOST_WAITING:
            started[-MOST_WAITING][1].result()
        view = _start(renderer.pair(viewpoint), viewpoint, height, pool)
        started += [] if view is None else [view]
        advance()
    return tuple(replace(view, flip=flip.result()) for view, flip in started)


def object_height(mesh: Mesh) -> float:
    """Return the length by which the depth errors of `mesh` are divided, metres.

    It is the height of the object. If that is less than `FLATTEST` of the largest extent, it is the largest extent.
    """
    low, high = mesh.bounds
    extent = (high - low).astype(np.float64)
    return float(extent[1] if extent[1] >= FLATTEST * extent.max() else extent.max())


@contextmanager
def flip_workers() -> Iterator[Executor]:
    """Start processes that compute FLIP, and end them with the `with` block.

    In a thread, FLIP would stop the drawing, since it holds Python's lock while it computes. The processes are spawned,
    since no GL context survives a fork.

    Yields
    ------
    Executor
        The processes, to be passed to `measure` or `measure_views`.
    """
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
    """Measure a pair, and start FLIP, which follows later; None if neither picture shows anything."""
    reference, test = pair.mesh.covered, pair.dpci.covered
    union = reference | test
    if not union.any():
        return None
    window = metrics.bounding_window(union, metrics.FLIP_REACH)
    cropped = pair.mesh.pixels[window], pair.dpci.pixels[window], union[window]
    flip = _submit(pool, metrics.mean_flip, *cropped)
    median, high = metrics.depth_errors(pair.mesh.distance[window], pair.dpci.distance[window], height)
    view = ViewQuality(
        viewpoint=viewpoint,
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
    """Run `work` in the pool, or immediately without one."""
    if pool is not None:
        return pool.submit(work, *arguments)
    done: Future[float] = Future()
    done.set_result(work(*arguments))
    return done
