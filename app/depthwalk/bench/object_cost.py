"""Measure what drawing one object costs, and how good it looks, by representation and distance.

Much of a frame's time is not caused by any object, and a single object keeps a whole pass busy. So as many copies of an
object are drawn as fit side by side into the picture, on a walk past. The cost of a frame without objects is
subtracted, and the rest is divided by the number of copies.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.bench.equal import SUPERSAMPLING
from depthwalk.bench.tables.walks import FOV, past, quality, truth
from depthwalk.gpu.timers import frame_clock
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.resources.library import Library
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Objects, Representation
from depthwalk.scene.scene import Scene
from depthwalk.types import Array

COMPARED = (Representation.DPCI, Representation.MESH, Representation.MESH_LOD, Representation.MESH_CLUSTERS)
"""The compared representations of objects that have a mesh and depth images, in the order of tables."""

MOST_COPIES = 16
_WARMUP = 2


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Hold the cost of one object in one representation, and its quality.

    Attributes
    ----------
    milliseconds
        Time that each copy adds to a frame, mean over the frames, milliseconds as in `frame_costs`; at least 0. It is
        not a median, since impostors are warped in some frames only.
    flip
        Mean FLIP against the mesh drawn with 16 samples per pixel, where either shows anything, 0 to 1; None if not
        measured.
    """

    milliseconds: float
    flip: float | None


@dataclass(frozen=True, kw_only=True)
class Costs:
    """Hold the costs of one object at one distance.

    Attributes
    ----------
    copies
        Number of copies drawn.
    covered
        Pixels that a copy covers in the mesh's picture; None if no picture was compared.
    by
        The cost in each representation.
    """

    copies: int
    covered: float | None
    by: dict[Representation, Cost]


class ObjectCosts:
    """Draw copies of one asset in several representations; see the module.

    Use it in a `with` block, which frees all GL contexts.

    Parameters
    ----------
    scene
        Source of the asset, lights and render settings. Ground and sky are left out.
    asset
        The number of the asset in `scene`. It needs a mesh.
    library
        The library of `scene`.
    size
        Width and height of the pictures, pixels.
    representations
        The representations to compare.
    judged
        Whether to measure FLIP.
    """

    def __init__(
        self,
        scene: Scene,
        asset: int,
        library: Library,
        size: tuple[int, int],
        representations: Sequence[Representation] = COMPARED,
        judged: bool = True,
    ) -> None:
        mesh = library.mesh(asset)
        assert mesh is not None  # checked by the caller
        low, high = mesh.bounds
        self.height = float(high[1] - low[1])
        self.width = float(np.hypot(high[0] - low[0], high[2] - low[2]))
        self._size, self._scene, self._asset, self._library = size, scene, asset, library
        self._representations, self._judged = representations, judged

    def distance_of(self, pixels: float) -> float:
        """Return the distance, metres, at which the object is `pixels` high."""
        return max(self.height, self.width) * self._size[1] / pixels / 2 / math.tan(FOV / 2) + self.width / 2

    def copies_at(self, pixels: float) -> int:
        """Return the number of copies that fit side by side when the object is `pixels` high."""
        return int(np.clip(self._size[0] // (1.3 * pixels), 1, MOST_COPIES))

    def measured(self, pixels: float, frames: int) -> Costs:
        """Measure all representations at one distance.

        Parameters
        ----------
        pixels
            Height or width of the object, whichever is larger, pixels.
        frames
            Number of frames for each representation.

        Returns
        -------
        Costs
            The cost in each representation.

        Raises
        ------
        GpuError
            If no OpenGL 3.3 context can be created.
        """
        copies = self.copies_at(pixels)
        scene = row_of(self._scene, self._asset, copies, 1.3 * max(self.width, self.height))
        centre, distance = (0.0, self.height / 2, 0.0), self.distance_of(pixels)
        cameras = past(centre, distance)
        middle = len(cameras) // 2
        cameras = cameras[max(middle - frames // 2, 0) :][:frames]
        with ExitStack() as opened:

            def open_as(kind: Representation, of: Scene, size: tuple[int, int] = self._size) -> HeadlessRenderer:
                return opened.enter_context(HeadlessRenderer(of, self._library, size, kind))

            drawn = {kind.label: open_as(kind, scene) for kind in self._representations}
            for headless in drawn.values():
                headless.renderer.remembers = True
            empty = replace(scene, objects=scene.objects.take(slice(0)))
            times = frame_costs({"": open_as(Representation.MESH, empty), **drawn}, cameras)
            flips: dict[str, float] = {}
            covered = None
            if self._judged:
                width, height = self._size
                with HeadlessRenderer(
                    scene, self._library, (width * SUPERSAMPLING, height * SUPERSAMPLING), Representation.MESH
                ) as true:
                    reference = truth(true, centre, distance)
                covered = float((reference != reference[0, 0]).any(-1).sum()) / copies
                flips = {name: quality(headless, reference, centre, distance).flip for name, headless in drawn.items()}
        by = {
            kind: Cost(
                milliseconds=max(float(np.mean(times[kind.label] - times[""])) / copies, 0.0),
                flip=flips.get(kind.label),
            )
            for kind in self._representations
        }
        return Costs(copies=copies, covered=covered, by=by)


def row_of(scene: Scene, asset: int, copies: int, spacing: float) -> Scene:
    """Return a scene with copies of an asset in a row along x, centred on the origin, and nothing else.

    Parameters
    ----------
    scene
        Source of assets, lights and settings.
    asset
        The number of the asset.
    copies
        Number of copies.
    spacing
        Distance between copies, metres.

    Returns
    -------
    Scene
        The scene, without ground, sky and fog, so that every pixel that differs from the background shows an object.
    """
    position = np.zeros((copies, 3), np.float32)
    position[:, 0] = (np.arange(copies) - (copies - 1) / 2) * spacing
    objects = Objects(
        asset=np.full(copies, asset, np.int32),
        position=position,
        rotation=np.tile(np.array([0, 0, 0, 1], np.float32), (copies, 1)),
        scale=np.ones(copies, np.float32),
        representation=np.full(copies, Representation.MESH, np.uint8),
    )
    bare = scene.environment.model_copy(update={"ground": None, "sky": None, "fog": None})
    return replace(scene, objects=objects, environment=bare)


def frame_costs(drawn: Mapping[str, HeadlessRenderer], cameras: Sequence[Camera]) -> dict[str, NDArray[np.float64]]:
    """Time frames, alternating between all renderers.

    Parameters
    ----------
    drawn
        The renderers by name.
    cameras
        The camera of each of n frames.

    Returns
    -------
    dict[str, NDArray[np.float64]]
        (n,) milliseconds of each frame by name. With a software rasteriser this is processor time of all threads, which
        other programs do not lengthen; otherwise wall-clock time.
    """
    times = {name: np.zeros(len(cameras)) for name in drawn}
    for headless in drawn.values():
        for _ in range(_WARMUP):
            headless.draw(View(cameras[0], headless.size))
        headless.finish()  # else the first frame that is timed would wait for these of all renderers
    for number, camera in enumerate(cameras):
        for name, headless in drawn.items():
            with _clock(headless) as elapsed:
                headless.draw(View(camera, headless.size))
                headless.finish()
            times[name][number] = elapsed[0]
    return times


@contextmanager
def _clock(headless: HeadlessRenderer) -> Iterator[list[float]]:
    """Yield a list that holds the duration of the `with` block, milliseconds, after it ends."""
    clock = frame_clock(headless.device)
    elapsed, start = [0.0], clock()
    yield elapsed
    elapsed[0] = (clock() - start) * 1e3


def crossings(x: Sequence[float], one: Array, other: Array) -> list[float]:
    """Return where two curves cross, interpolating between the logarithms of all values.

    Parameters
    ----------
    x
        (n,) positions at which both are known, ascending, above 0.
    one, other
        (n,) the curves; NaN where one is unknown. Costs of 0 and less are noise, at which nothing crosses.

    Returns
    -------
    list[float]
        The crossings, ascending.
    """
    one, other = (np.where(curve > 0, curve, np.nan) for curve in (one, other))
    along, gap = np.log(np.asarray(x, np.float64)), np.log(one) - np.log(other)
    turns = np.flatnonzero(gap[:-1] * gap[1:] < 0)
    part = gap[turns] / (gap[turns] - gap[turns + 1])
    return [float(value) for value in np.exp(along[turns] + part * (along[turns + 1] - along[turns]))]
