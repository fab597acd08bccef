"""Move nodes of a scene over time: sample their keyframes, and place the objects below them.

All animated nodes are sampled at once. Positions are interpolated by coordinates, rotations by yaw, pitch and roll, so
that a file can ask for several turns, and scales by their logarithms, so that they stay positive.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.hermite import hermite
from depthwalk.scene.arrays import Nodes, place_nodes
from depthwalk.scene.schema import AnimationParams
from depthwalk.scene.similarity import from_angles

_POSITION, _ANGLES, _SCALE = slice(0, 3), slice(3, 6), 6  # columns of values
INTERPOLATIONS = "step", "linear", "smooth"
REPEATS = "once", "loop", "ping-pong"


@dataclass(frozen=True, kw_only=True)
class Animations:
    """Hold the keyframes of m animated nodes, k in all.

    Attributes
    ----------
    node : (m,) int64
        Rows of the nodes in `Scene.nodes`, ascending.
    first : (m + 1,) int64
        Where the keyframes of each node begin.
    times : (k,) float64
        Seconds since a node's animation began, ascending for each node.
    values : (k, 7) float64
        Position x, y, z in the parent, metres; yaw, pitch, roll, radians; logarithm of the scale.
    tangents : (k, 7) float64
        How fast these change there, per second, where motion is smooth.
    interpolation, repeat : (m,) int64
        Indices into `INTERPOLATIONS` and `REPEATS`.
    start : (m,) float64
        The moments at which the animations begin, seconds.
    moved_nodes, moved_objects : (…,) int64
        What moves, ascending: rows of `Scene.nodes`, which are these nodes and all below them, and of `Scene.objects`.
    """

    node: NDArray[np.int64]
    first: NDArray[np.int64]
    times: NDArray[np.float64]
    values: NDArray[np.float64]
    tangents: NDArray[np.float64]
    interpolation: NDArray[np.int64]
    repeat: NDArray[np.int64]
    start: NDArray[np.float64]
    moved_nodes: NDArray[np.int64]
    moved_objects: NDArray[np.int64]

    def sample(self, seconds: float) -> NDArray[np.float64]:
        """Return the placements (m, 7) of the nodes at a moment of the scene, in the columns of `values`."""
        time = self._time_of(seconds)
        last = self.first[1:] - 1
        key = np.clip(np.searchsorted(self._order, self._ordered(time), side="right") - 1, self.first[:-1], last - 1)
        length = self.times[key + 1] - self.times[key]
        part = np.clip((time - self.times[key]) / length, 0, 1)[:, None]
        before, after = self.values[key], self.values[key + 1]
        sampled = before + (after - before) * part
        smooth = np.flatnonzero(self.interpolation == INTERPOLATIONS.index("smooth"))
        sampled[smooth] = hermite(
            before[smooth],
            after[smooth],
            self.tangents[key[smooth]] * length[smooth, None],
            self.tangents[key[smooth] + 1] * length[smooth, None],
            part[smooth],
        )
        step = np.flatnonzero(self.interpolation == INTERPOLATIONS.index("step"))
        sampled[step] = np.where(part[step] < 1, before[step], after[step])
        return sampled

    def _time_of(self, seconds: float) -> NDArray[np.float64]:
        """Return where in its keyframes each node is, (m,) seconds, at a moment of the scene."""
        since, period = np.maximum(seconds - self.start, 0), self.times[self.first[1:] - 1]
        once, loop, both_ways = np.minimum(since, period), since % period, since % (2 * period)
        return np.asarray(np.choose(self.repeat, (once, loop, np.minimum(both_ways, 2 * period - both_ways))))

    @cached_property
    def _order(self) -> NDArray[np.float64]:
        """The keyframes of all nodes as one ascending sequence (k,): the number of the node, plus a part below 1."""
        counts = np.diff(self.first)
        period = np.repeat(self.times[self.first[1:] - 1], counts)
        return np.repeat(np.arange(len(self.node)), counts) + self.times / (2 * period)

    def _ordered(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.arange(len(self.node)) + time / (2 * self.times[self.first[1:] - 1])

    def place(self, nodes: Nodes, seconds: float) -> None:
        """Place the animated nodes, and all below them, as they are at a moment of the scene, in place.

        nodes: all nodes of the scene, whose placements change.
        """
        sampled = self.sample(seconds)
        nodes.local.position[self.node] = sampled[:, _POSITION]
        nodes.angles[self.node] = sampled[:, _ANGLES]
        nodes.local.rotation[self.node] = from_angles(*sampled[:, _ANGLES].T)
        nodes.local.scale[self.node] = np.exp(sampled[:, _SCALE])
        place_nodes(nodes, self.moved_nodes)

    def extents(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return bounds of what the curves reach: distances from the parents' origins, least and largest scales, (m,).

        A cubic segment leaves the range of its ends by at most 4/27 of each tangent times the segment's length.
        Straight ones and steps do not.
        """
        length = np.diff(self.times, append=np.inf)
        length[self.first[1:] - 1] = 0
        slack = np.zeros_like(self.values)
        straight = self.interpolation != INTERPOLATIONS.index("smooth")
        length[np.repeat(straight, np.diff(self.first))] = 0
        slack[:-1] = (np.abs(self.tangents[:-1]) + np.abs(self.tangents[1:])) * length[:-1, None] * (4 / 27)
        slack[1:] = np.maximum(slack[1:], slack[:-1])  # on both sides of a keyframe
        low = np.minimum.reduceat(self.values - slack, self.first[:-1])
        high = np.maximum.reduceat(self.values + slack, self.first[:-1])
        reach = np.linalg.norm(np.maximum(np.abs(low[:, _POSITION]), np.abs(high[:, _POSITION])), axis=1)
        return reach, np.exp(low[:, _SCALE]), np.exp(high[:, _SCALE])


def animations(specs: Sequence[tuple[int, AnimationParams]], nodes: Nodes) -> Animations:
    """Return the animations of a scene.

    Parameters
    ----------
    specs
        Row in `nodes`, ascending, and what the file says, for each animated node; at least one. Their keyframes must be
        in order, the last later than 0.
    nodes
        The nodes as the file places them: what a keyframe leaves out is theirs.

    Returns
    -------
    Animations
        The keyframes as arrays.
    """
    times, values, tangents = [], [], []
    for row, spec in specs:
        times.append(np.array([key.time for key in spec.keyframes]))
        values.append(_values(row, spec, nodes))
        tangents.append(_tangents(times[-1], values[-1], closes=spec.repeat == "loop"))
    counts, node = [len(of_node) for of_node in times], np.array([row for row, _ in specs])
    moved_nodes, moved_objects = _below(node, nodes)
    return Animations(
        node=node,
        first=np.concatenate([[0], np.cumsum(counts)]),
        times=np.concatenate(times),
        values=np.concatenate(values),
        tangents=np.concatenate(tangents),
        interpolation=np.array([INTERPOLATIONS.index(spec.interpolation) for _, spec in specs]),
        repeat=np.array([REPEATS.index(spec.repeat) for _, spec in specs]),
        start=np.array([spec.start for _, spec in specs]),
        moved_nodes=moved_nodes,
        moved_objects=moved_objects,
    )


def _values(row: int, spec: AnimationParams, nodes: Nodes) -> NDArray[np.float64]:
    """Return the keyframes (k, 7) of the node in a row, in the columns of `Animations.values`."""
    own = [*nodes.local.position[row].tolist(), *nodes.angles[row].tolist(), math.log(nodes.local.scale[row])]
    values = np.tile(own, (len(spec.keyframes), 1))
    for value, key in zip(values, spec.keyframes, strict=True):
        if key.position is not None:
            value[_POSITION] = key.position
        for column, angle in enumerate((key.yaw, key.pitch, key.roll), 3):
            if angle is not None:
                value[column] = math.radians(angle)
        if key.scale is not None:
            value[_SCALE] = math.log(key.scale)
    return values


def _tangents(times: NDArray[np.float64], values: NDArray[np.float64], closes: bool) -> NDArray[np.float64]:
    """Return the tangents (k, 7) of a Catmull–Rom spline through keyframes.

    closes: whether the first keyframe follows the last; then the curve goes on there at the same speed, also where the
    last one is whole turns ahead of the first.
    """
    if not closes or times[0] > 0:
        return np.asarray(np.gradient(values, times, axis=0))
    period, turn = times[-1], values[-1] - values[0]
    around = np.concatenate([times[-2:-1] - period, times, times[1:2] + period])
    continued = np.concatenate([values[-2:-1] - turn, values, values[1:2] + turn])
    return np.asarray(np.gradient(continued, around, axis=0)[1:-1])


def _below(at: NDArray[np.int64], nodes: Nodes) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the nodes `at`, ascending, with all nodes below them, and the objects of these; both ascending."""

    def rows(first: NDArray[np.integer], end: NDArray[np.integer], count: int) -> NDArray[np.int64]:
        steps = np.zeros(count + 1, np.int64)
        np.add.at(steps, first, 1)
        np.add.at(steps, end, -1)
        return np.asarray(np.flatnonzero(np.cumsum(steps[:-1]) > 0))

    first, objects = nodes.first_object[at], int(nodes.object_count[nodes.depth == 0].sum())
    return rows(at, nodes.end[at], len(nodes)), rows(first, first + nodes.object_count[at], objects)
