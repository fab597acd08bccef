"""Read how the nodes of a glTF scene move in the first animation of its file.

glTF 2.0, section 3.11 and appendix C. What is malformed raises ValueError, TypeError or LookupError.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import matrices
from depthwalk.ingest.gltf import objects_under
from depthwalk.ingest.gltf_accessors import Accessors
from depthwalk.ingest.gltf_pose import local_matrix
from depthwalk.limits import MAX_KEYFRAMES

TICK = 1e-4
"""Seconds: moments are whole numbers of these, so that a scene file can say them with few digits."""

_REST = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}
_INTERPOLATIONS = "LINEAR", "STEP", "CUBICSPLINE"
_MOST_KEYS = 10_000_000  # of all channels together: they take 300 MB
_FEWEST_SECONDS = 0.01  # what takes less is no movement
_MOST_SECONDS = 1e6  # as long as the keyframes of a scene file may take
_FARTHEST = 1e12  # in values: products of a few such numbers are finite
_DEEPEST = 64  # animated nodes that hang from each other: skeletons have half as many
_TRIED = 33  # moments of a movement at which its size is looked for
_STILL = 1e-6  # relative difference of values that do not change

Header = dict[str, Any]
_Numbers = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Channel:
    """Hold how one property of a node changes.

    Attributes
    ----------
    times : (k,) float64
        Seconds, ascending, of the keyframes.
    values : (k, w) float64
        What the property is at each.
    tangents : (2, k, w) float64 or None
        How fast it changes before and after each, per second, if it follows a spline.
    is_step
        Whether it stays as it is until the next keyframe; otherwise, without tangents, it changes evenly.
    is_rotation, is_size
        Whether values are quaternions (x, y, z, w), or factors.
    """

    times: _Numbers
    values: _Numbers
    tangents: _Numbers | None
    is_step: bool
    is_rotation: bool
    is_size: bool

    def sample(self, times: _Numbers) -> _Numbers:
        """Return the values (t, w) at `times` (t,) seconds; rotations as unit quaternions."""
        if len(self.times) == 1:
            return self._unit(np.tile(self.values, (len(times), 1)))
        key = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.times) - 2)
        length = self.times[key + 1] - self.times[key]
        part = np.clip((times - self.times[key]) / np.maximum(length, 1e-9), 0, 1)[:, None]
        before, after = self.values[key], self.values[key + 1]
        if self.is_step:
            return self._unit(np.where(part < 1, before, after))
        if self.tangents is not None:
            leaving, arriving = self.tangents[1, key] * length[:, None], self.tangents[0, key + 1] * length[:, None]
            rest = 1 - part
            return self._unit(
                rest * rest * ((1 + 2 * part) * before + part * leaving)
                + part * part * ((1 + 2 * rest) * after - rest * arriving)
            )
        return _slerp(before, after, part) if self.is_rotation else before + (after - before) * part

    def _unit(self, values: _Numbers) -> _Numbers:
        return _normalised(values) if self.is_rotation else values

    @property
    def is_still(self) -> bool:
        """Whether the value never changes."""
        small = _STILL * max(1.0, float(np.abs(self.values).max()))
        bent = self.tangents is not None and float(np.abs(self.tangents).max()) > small
        return len(self.times) == 1 or not bent and bool(np.ptp(self.values, axis=0).max() <= small)


def _normalised(turn: _Numbers) -> _Numbers:
    return np.asarray(turn / np.maximum(np.linalg.norm(turn, axis=1, keepdims=True), 1e-12))


def _slerp(before: _Numbers, after: _Numbers, part: _Numbers) -> _Numbers:
    """Return the unit quaternions (n, 4) at `part` (n, 1) of the shorter ways between others (n, 4)."""
    before, after = _normalised(before), _normalised(after)
    cosine = (before * after).sum(axis=1, keepdims=True)
    after, cosine = np.where(cosine < 0, -after, after), np.minimum(np.abs(cosine), 1)
    angle = np.arccos(cosine)
    near = angle < 1e-4  # where the sine would be divided by itself, a straight line is as good
    sine = np.where(near, 1, np.sin(angle))
    first = np.where(near, 1 - part, np.sin((1 - part) * angle) / sine)
    second = np.where(near, part, np.sin(part * angle) / sine)
    return _normalised(first * before + second * after)


@dataclass(frozen=True, kw_only=True)
class _Joint:
    """Hold a node that moves: its channels by property, and what the properties without a channel are."""

    rest: Mapping[str, tuple[float, ...]]
    channels: Mapping[str, Channel]

    def local(self, times: _Numbers) -> _Numbers:
        """Return the node's matrices (t, 4, 4) relative to its parent."""
        shift, turn, size = (
            self.channels[name].sample(times)
            if name in self.channels
            else np.tile(np.array(self.rest[name], np.float64), (len(times), 1))
            for name in _REST
        )
        placed = np.tile(np.eye(4), (len(times), 1, 1))
        placed[:, :3, :3] = matrices(_normalised(turn)) * size[:, None, :]
        placed[:, :3, 3] = shift
        return placed


@dataclass(frozen=True, kw_only=True)
class Movement:
    """Hold how a node, or what hangs from it, moves in the scene.

    Attributes
    ----------
    chain
        What is multiplied, from the root on: matrices (4, 4) of nodes that stand still, and those that move.
    end
        Seconds that the animation takes.
    """

    chain: tuple["_Numbers | _Joint", ...]
    end: float

    def matrices(self, times: _Numbers) -> _Numbers:
        """Return where it is at `times` (t,) seconds: (t, 4, 4), scene from node, for column vectors."""
        placed = np.tile(np.eye(4), (len(times), 1, 1))
        with np.errstate(all="ignore"):
            for link in self.chain:
                placed = placed @ (link.local(times) if isinstance(link, _Joint) else link)
        return placed

    def of(self, inside: _Numbers) -> "Movement":
        """Return the movement of what stands by the matrix `inside` (4, 4) in the node."""
        return replace(self, chain=_appended(self.chain, inside))

    @property
    def is_step(self) -> bool:
        """Whether it only jumps."""
        return all(channel.is_step for channel in self._channels())

    @property
    def key_count(self) -> int:
        """How many keyframes it depends on."""
        return sum(len(channel.times) for channel in self._channels())

    def sizes(self) -> _Numbers:
        """Return matrices (t, 4, 4) at some moments, at which, if at any, it is about as large as ever."""
        scaled = [channel.times[:_TRIED] for channel in self._channels() if channel.is_size]
        moments = np.concatenate([np.linspace(0, self.end, _TRIED), *scaled])
        return self.matrices(moments[: 4 * _TRIED])

    def times(self) -> _Numbers:
        """Return the moments (t,) of all keyframes, with the beginning and the end, and shortly before each jump.

        They are seconds, whole numbers of TICK, and ascend by more than 10 of them, for which some are left out.
        """
        listed = [np.array([0.0, self.end])]
        for channel in self._channels():
            listed.append(channel.times)
            if channel.is_step and not self.is_step:
                listed.append(channel.times - 20 * TICK)
        end = round(self.end / TICK)
        ticks = np.unique(np.clip(np.rint(np.concatenate(listed) / TICK), 0, end)).astype(np.int64)
        ticks = ticks[np.unique(ticks // 20, return_index=True)[1]]  # one of 20, then no two neighbours are close
        ticks = ticks[(np.diff(ticks, prepend=-20) > 10) & (end - ticks > 10)]
        return np.append(ticks, end) * TICK

    @property
    def joint_count(self) -> int:
        """How many nodes that move by themselves it hangs from, or is."""
        return sum(isinstance(link, _Joint) for link in self.chain)

    def _channels(self) -> list[Channel]:
        return [channel for link in self.chain if isinstance(link, _Joint) for channel in link.channels.values()]


def _appended(chain: tuple["_Numbers | _Joint", ...], link: "_Numbers | _Joint") -> tuple["_Numbers | _Joint", ...]:
    """Return a chain with a further link; matrices that follow each other become one."""
    if chain and not isinstance(link, _Joint) and not isinstance(chain[-1], _Joint):
        return *chain[:-1], chain[-1] @ link
    return *chain, link


@dataclass(frozen=True, kw_only=True)
class Animation:
    """Hold the first animation of a file.

    Attributes
    ----------
    end
        Seconds that it takes; 0 if nothing moves.
    joints
        What moves by itself, by the numbers of nodes.
    notes
        What of the file's animations is not here, a text each.
    """

    end: float
    joints: Mapping[int, _Joint]
    notes: tuple[str, ...]

    def movements(self, nodes: list[Header], world: Mapping[int, _Numbers]) -> dict[int, Movement]:
        """Return the movements of all nodes that move by themselves or hang from one that does, by their numbers.

        Parameters
        ----------
        nodes
            All nodes.
        world
            The matrices of those that are shown, parents first.
        """
        if not self.joints:
            return {}
        parent = {child: number for number in world for child in nodes[number].get("children", [])}
        found: dict[int, Movement] = {}
        for number in world:
            above = parent.get(number)
            link = self.joints.get(number)
            if above in found:
                chain = _appended(found[above].chain, link or local_matrix(nodes[number]))
            elif link is not None:
                chain = (link,) if above is None else (world[above], link)
            else:
                continue
            found[number] = Movement(chain=chain, end=self.end)
            if found[number].joint_count > _DEEPEST:
                raise ValueError(f"more than {_DEEPEST} animated nodes hang from each other")
        return found


def read_animation(header: Header, accessors: Accessors) -> Animation:
    """Read the first animation of a file.

    Parameters
    ----------
    header
        The JSON header. Nodes that the animation holds at one place are put there, in place.
    accessors
        Reads keyframes.

    Returns
    -------
    Animation
        What moves.

    Raises
    ------
    ValueError, TypeError, LookupError
        For damaged data: keyframes that do not ascend, that are not finite or too many.
    """
    animations = objects_under(header, "animations")
    if not animations:
        return Animation(end=0.0, joints={}, notes=())
    channels, others, end = _channels(header, animations[0], accessors)
    notes = list(_notes(animations, others))
    nodes, joints = header["nodes"], {}
    for number, of_node in channels.items():
        node = nodes[number]
        if "matrix" in node:
            raise ValueError(f"node {number} has a matrix and is animated")
        for name in [name for name, channel in of_node.items() if channel.is_still]:
            node[name] = of_node.pop(name).values[0].tolist()
        if of_node:
            rest = {name: tuple(map(float, node.get(name, value))) for name, value in _REST.items()}
            joints[number] = _Joint(rest=rest, channels=of_node)
    if joints and end < _FEWEST_SECONDS:
        return Animation(end=0.0, joints={}, notes=(*notes, f"nothing moves: the animation takes only {end:g} s"))
    return Animation(end=round(end / TICK) * TICK, joints=joints, notes=tuple(notes))


def _channels(
    header: Header, animation: Header, accessors: Accessors
) -> tuple[dict[int, dict[str, Channel]], Counter[str], float]:
    """Return the channels of an animation by nodes and properties, how many others it has, and its seconds."""
    found: dict[int, dict[str, Channel]] = {}
    others: Counter[str] = Counter()
    end, keys = 0.0, 0
    samplers = animation["samplers"]
    for each in animation["channels"]:
        target = each["target"]
        if (number := target.get("node")) is None or target["path"] not in _REST:
            others[target["path"]] += 1
            continue
        if not isinstance(number, int) or not 0 <= number < len(header["nodes"]):
            raise ValueError(f"there is no node {str(number)[:40]}")
        sampler = samplers[each["sampler"]]
        keys += int(header["accessors"][sampler["input"]]["count"])
        if keys > _MOST_KEYS:
            raise ValueError(f"an animation with more than {_MOST_KEYS} keyframes")
        channel = _channel(header, sampler, target["path"], accessors)
        end = max(end, float(channel.times[-1]))
        found.setdefault(number, {})[target["path"]] = channel
    return found, others, end


def _channel(header: Header, sampler: Header, path: str, accessors: Accessors) -> Channel:
    """Return the channel that a sampler makes for a property."""
    kind = sampler.get("interpolation", "LINEAR")
    if kind not in _INTERPOLATIONS:
        raise ValueError(f"unknown interpolation {str(kind)[:40]}")
    count = int(header["accessors"][sampler["input"]]["count"])
    if count > MAX_KEYFRAMES:
        raise ValueError(f"{count} keyframes, the limit is {MAX_KEYFRAMES}")
    times = accessors.read(sampler["input"], count).astype(np.float64)
    with np.errstate(invalid="ignore"):  # NaN is not within the limits either
        if times.shape[1] != 1 or not ((times >= 0) & (times <= _MOST_SECONDS)).all():
            raise ValueError(f"keyframes are not at 0 to {_MOST_SECONDS:g} s")
    if (np.diff(times[:, 0]) < 0).any():
        raise ValueError("keyframes do not ascend")
    splined, width = kind == "CUBICSPLINE", len(_REST[path])
    values = accessors.read(sampler["output"], 3 * count if splined else count).astype(np.float64)
    if values.shape[1] != width or not (np.abs(values) < _FARTHEST).all():
        raise ValueError(f"the keyframes of a {path} are not {width} numbers within reach")
    by_key = values.reshape(count, -1, width)
    return Channel(
        # Moments of jumps are rounded as those of a scene file are, which shall not show what was before.
        times=np.rint(times[:, 0] / TICK) * TICK if kind == "STEP" else times[:, 0],
        values=by_key[:, 1] if splined else by_key[:, 0],
        tangents=by_key[:, [0, 2]].swapaxes(0, 1) if splined else None,
        is_step=kind == "STEP",
        is_rotation=path == "rotation",
        is_size=path == "scale",
    )


def _notes(animations: list[Header], others: Counter[str]) -> list[str]:
    """Return what is not read of a file's animations."""
    notes = []
    if more := len(animations) - 1:
        notes.append(f"{more} {'animation is' if more == 1 else 'animations are'} left out, the first one stays")
    if others["weights"]:
        notes.append("shape keys do not move")
    if sum(others.values()) > others["weights"]:
        notes.append("of the animation, only positions, rotations and scales of nodes are kept")
    return notes
