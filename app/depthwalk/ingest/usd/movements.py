"""Write how nodes move over time: samples of their places, as an animation of glTF.

USD interpolates each operation of each prim by itself, angles too. So a place is sampled between the times that a file
has, more densely if these are few; what is read from it leaves out what a straight line says as well.
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from depthwalk.ingest.usd.glb import GlbBuilder
from depthwalk.ingest.usd.nodes import Nodes, factors
from depthwalk.ingest.usd.problems import Unread

_WANTED, _MOST_BETWEEN = 1440, 360  # samples of a movement, and samples between two times of the file
_MOST_SAMPLES = 1_000_000  # of all movements, some 10 µs each


class Movements:
    """Write the movements of nodes into a file."""

    def __init__(self, stage: Any, builder: GlbBuilder, nodes: Nodes, unread: Unread) -> None:
        """Prepare to write into a file what moves in a stage."""
        self._stage, self._builder, self._nodes, self._unread = stage, builder, nodes, unread
        self._rate = stage.GetTimeCodesPerSecond() or 24.0
        self._caches: dict[float, Any] = {}
        self._left = _MOST_SAMPLES
        self._found: list[tuple[int, NDArray[np.float64], NDArray[np.float64]]] = []

    def add(self, prim: Any) -> int:
        """Add a node that moves as a prim does, and return its number."""
        times = self._times(prim)
        if len(times) > self._left:
            self._unread.count("movement beyond a million samples", "movements beyond a million samples")
            times = times[:1]
        self._left -= len(times)
        places = np.array([self._place(prim, float(time)) for time in times])
        shift, turn, stretch, _ = factors(places[:1])
        number = self._nodes.add(
            {
                "name": prim.GetName(),
                "translation": shift[0].tolist(),
                "rotation": turn[0].tolist(),
                "scale": stretch[0].tolist(),
                "children": [],
            }
        )
        if len(times) > 1:
            self._found.append((number, times, places))
        return number

    def finish(self) -> None:
        """Write the animation of all nodes that were added."""
        if not self._found:
            return
        start = min(float(times[0]) for _, times, _ in self._found)
        stepped = self._stage.GetInterpolationType() == Usd.InterpolationTypeHeld
        samplers: list[dict[str, Any]] = []
        channels: list[dict[str, Any]] = []
        for number, times, places in self._found:
            at = self._builder.accessor(((times - start) / self._rate).astype(np.float32))
            shift, turn, stretch, _ = factors(places)
            for path, values in (("translation", shift), ("rotation", _continuous(turn)), ("scale", stretch)):
                channels.append({"sampler": len(samplers), "target": {"node": number, "path": path}})
                sampler = {"input": at, "output": self._builder.accessor(values)}
                samplers.append(sampler | {"interpolation": "STEP" if stepped else "LINEAR"})
        self._builder.add("animations", {"samplers": samplers, "channels": channels})

    def _times(self, prim: Any) -> NDArray[np.float64]:
        """Return the times (n,), in the stage's unit, at which the place of a prim is sampled."""
        given = sorted({time for each in _chain(prim) for time in UsdGeom.Xformable(each).GetTimeSamples()})
        given = [time for time in given if math.isfinite(time)]
        if len(given) < 2:
            return np.array(given or [0.0])
        if self._stage.GetInterpolationType() == Usd.InterpolationTypeHeld:
            return np.array(given)
        between = min(max(_WANTED // (len(given) - 1), 1), _MOST_BETWEEN)
        steps = np.arange(between) / between
        known = np.array(given)
        return np.append((known[:-1, None] + np.diff(known)[:, None] * steps).ravel(), known[-1])

    def _place(self, prim: Any, time: float) -> NDArray[np.float64]:
        """Return the matrix (4, 4) of a prim in the stage at a time."""
        if time not in self._caches:
            self._caches[time] = UsdGeom.XformCache(Usd.TimeCode(time))
        return np.array(self._caches[time].GetLocalToWorldTransform(prim)).T


def _chain(prim: Any) -> Iterator[Any]:
    """Yield a prim and those above it that have places."""
    while prim and not prim.IsPseudoRoot():
        if prim.IsA(UsdGeom.Xformable):
            yield prim
        prim = prim.GetParent()


def _continuous(turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return quaternions (n, 4), of which each has the sign by which it is nearer to the one before."""
    flips = np.sign((turn[1:] * turn[:-1]).sum(axis=1))
    signs = np.cumprod(np.append(1.0, np.where(flips < 0, -1.0, 1.0)))
    return turn * signs[:, None]
