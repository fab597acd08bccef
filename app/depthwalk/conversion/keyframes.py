"""Express movements of glTF nodes by keyframes of a scene file.

A node of glTF moves by matrices, which its parents' multiply; an object of a scene by a position, three angles and a
size, each interpolated on its own. So movements are sampled as densely as these curves bend, and of the samples those
are kept between which straight lines come close enough.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.gltf_animations import Movement
from depthwalk.ingest.gltf_channels import FARTHEST, TICK
from depthwalk.limits import MAX_COORDINATE, MAX_KEYFRAMES
from depthwalk.scene.fields import MAX_SCALE, MIN_SCALE
from depthwalk.scene.schema import MAX_ANGLE
from depthwalk.scene.similarity import angles

_TURN = math.radians(0.1)  # by which angles may be off
_PART = 1 / 2000  # of its largest size, by which an object's size may be off
_BEND = 0.25  # of these tolerances: what may be between samples; the rest is for what is between keyframes
_SHORTEST = 83  # ticks between samples, 1/120 s: who sees 60 pictures a second sees no more
_FIRST = 8  # samples of each interval between glTF's keyframes, at least, where these are not closer
_MOST_SAMPLES = 400_000  # of an object
_MOST_WORK = 20_000_000  # samples of a file, times the animated nodes that each depends on: a minute
_RESHAPED = 0.01  # relative change of a shape that is worth a note
_SINGULAR = 1e-9  # size, relative to the largest, of what is shrunk to nothing and has no direction

_Numbers = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Track:
    """Hold how an object moves.

    Attributes
    ----------
    times : (k,) float64
        Seconds of its keyframes, the first at 0; a single one if it stands still.
    values : (k, 7) float64
        Position, metres; yaw, pitch and roll, radians; and the logarithm of the scale. As `scene.animation` has them.
    is_step
        Whether it jumps from one to the next.
    is_reshaped
        Whether the movement also stretches or shears it, which the track leaves out.
    """

    times: _Numbers
    values: _Numbers
    is_step: bool
    is_reshaped: bool


class Tracks:
    """Make tracks, as many as a scene file holds.

    Attributes
    ----------
    stopped
        How many objects stand still since there would be too many keyframes.
    reshaped
        How many are stretched or sheared by their movement.
    """

    def __init__(self, tolerance: float) -> None:
        """Prepare to make tracks that are at most `tolerance` metres beside the movements."""
        self._tolerance = tolerance
        self._decimals = max(0, math.ceil(-math.log10(tolerance))) + 1
        self._keyframes, self._work = MAX_KEYFRAMES, _MOST_WORK
        self.stopped = self.reshaped = 0

    def track(self, movement: Movement, base: _Numbers) -> Track:
        """Return the track of what has its origin at `base` (3,) of the frame that moves.

        Raises ValueError if it leaves what a scene file can say.
        """
        found = self._found(movement, base)
        if found is None:
            self.stopped += 1
            found = _still(movement, base)
        elif len(found.times) > 1:
            self._keyframes -= len(found.times)
            self.reshaped += found.is_reshaped
        if (far := float(np.abs(found.values[:, :3]).max())) > MAX_COORDINATE:
            raise ValueError(f"an object moves {far:g} m from the origin, the limit is {MAX_COORDINATE:g} m")
        return found

    def values(self, track: Track) -> dict[str, Any]:
        """Return the keys of an object: its placement at first and, if it moves, its `animation`."""
        columns = {
            "position": np.round(track.values[:, :3], self._decimals) + 0.0,
            **{
                name: np.round(np.degrees(track.values[:, column]), 3) + 0.0
                for column, name in enumerate(("yaw", "pitch", "roll"), 3)
            },
            "scale": np.array([float(f"{scale:.6g}") for scale in np.exp(track.values[:, 6])]),
        }
        defaults = {"yaw": 0.0, "pitch": 0.0, "roll": 0.0, "scale": 1.0}
        values = {
            name: column[0].tolist() for name, column in columns.items() if column[0].tolist() != defaults.get(name)
        }
        changing = {name: column.tolist() for name, column in columns.items() if np.ptp(column, axis=0).any()}
        if changing:
            times = np.round(track.times, 4).tolist()
            keyframes = [
                {"time": time} | {name: column[row] for name, column in changing.items()}
                for row, time in enumerate(times)
            ]
            values["animation"] = {"interpolation": "step" if track.is_step else "linear", "keyframes": keyframes}
        return values

    def _found(self, movement: Movement, base: _Numbers) -> Track | None:
        """Return the track of a movement; None if it takes too many samples or keyframes, or turns too often."""
        if (work := movement.key_count * movement.joint_count) > self._work or self._keyframes < 2:
            return None
        ticks = np.rint(movement.times() / TICK).astype(np.int64)
        if not movement.is_step:
            ticks = _split(ticks)
        self._work -= work + len(ticks) * movement.joint_count
        if len(ticks) > _MOST_SAMPLES or self._work < 0:
            return None
        samples = _Samples.of(movement, base, ticks)
        if movement.is_step:
            values = samples.values()
            kept = np.concatenate([[True], (np.abs(np.diff(values, axis=0)) > 1e-9).any(axis=1)])
            kept[-1] = True
        else:
            samples = _refined(samples, movement, base, self._tolerance)
            self._work -= (len(samples.ticks) - len(ticks)) * movement.joint_count
            values = samples.values()
            kept = _thinned(samples.times, values, (1 - _BEND) * _slack(values, self._tolerance))
        times, values = samples.times[kept], values[kept]
        if len(times) > self._keyframes or np.ptp(values[:, 3:6], axis=0).max() > 2 * math.radians(MAX_ANGLE - 360):
            return None
        middle = (values[:, 3:6].max(axis=0) + values[:, 3:6].min(axis=0)) / 2
        if np.abs(values[:, 3:6]).max() > math.radians(MAX_ANGLE):
            values[:, 3:6] -= 2 * math.pi * np.round(middle / (2 * math.pi))
        return Track(
            times=times,
            values=values,
            is_step=movement.is_step,
            is_reshaped=bool(samples.reshaped.max() > _RESHAPED),
        )


def _still(movement: Movement, base: _Numbers) -> Track:
    values = _Samples.of(movement, base, np.zeros(1, np.int64)).values()
    return Track(times=np.zeros(1), values=values, is_step=False, is_reshaped=False)


@dataclass(frozen=True, kw_only=True)
class _Samples:
    """Hold where an object is at some moments.

    Attributes
    ----------
    ticks : (t,) int64
        The moments, in TICK seconds, ascending.
    position, scale : (t, 3) and (t,) float64
        Where it is, and how large.
    rotation : (t, 3, 3) float64
        How it is turned.
    reshaped : (t,) float64
        How far, relative to its size, its matrix is from these three.
    """

    ticks: NDArray[np.int64]
    position: _Numbers
    scale: _Numbers
    rotation: _Numbers
    reshaped: _Numbers

    @property
    def times(self) -> _Numbers:
        """The moments, seconds."""
        return _seconds(self.ticks)

    @classmethod
    def of(cls, movement: Movement, base: _Numbers, ticks: NDArray[np.int64]) -> "_Samples":
        """Return samples of a movement, of the point `base` (3,)."""
        placed = movement.matrices(_seconds(ticks))
        if not (np.abs(placed) < FARTHEST).all():
            raise ValueError("a node moves out of reach")
        linear = placed[:, :3, :3]
        left, stretch, right = np.linalg.svd(linear)
        mirrored = np.linalg.det(left @ right) < 0
        left[mirrored, :, 2] *= -1  # the nearest that does not mirror
        signed = stretch * np.where(mirrored[:, None], (1, 1, -1), 1)
        rotation, scale = left @ right, np.maximum(signed.mean(axis=1), 0)
        apart = np.abs(linear - scale[:, None, None] * rotation).max(axis=(1, 2))
        return cls(
            ticks=ticks,
            position=placed[:, :3, 3] + scale[:, None] * (rotation @ base),
            scale=scale,
            rotation=rotation,
            reshaped=apart / np.maximum(scale, 1e-3),
        )

    def with_more(self, more: "_Samples") -> "_Samples":
        """Return these samples and others between them."""
        order = np.argsort(np.concatenate([self.ticks, more.ticks]), kind="stable")
        return _Samples(
            ticks=np.concatenate([self.ticks, more.ticks])[order],
            position=np.concatenate([self.position, more.position])[order],
            scale=np.concatenate([self.scale, more.scale])[order],
            rotation=np.concatenate([self.rotation, more.rotation])[order],
            reshaped=np.concatenate([self.reshaped, more.reshaped])[order],
        )

    def values(self) -> _Numbers:
        """Return the samples (t, 7) in the columns of a track; angles go on from one to the next by less than a turn.

        Where the object is shrunk to nothing, it is turned as before.
        """
        turned = np.where(self.scale > _SINGULAR * self.scale.max(), np.arange(len(self.scale)), 0)
        rotation = self.rotation[np.maximum.accumulate(turned)]
        size = np.log(np.clip(self.scale, MIN_SCALE, MAX_SCALE))
        return np.column_stack([self.position, _unwrapped(rotation), size])


def _seconds(ticks: NDArray[np.int64]) -> _Numbers:
    return np.asarray(ticks * TICK, np.float64)


def _unwrapped(rotation: _Numbers) -> _Numbers:
    """Return yaw, pitch and roll (t, 3), radians, of rotations (t, 3, 3), each row as near to the one before as can be.

    Yaw, pitch and roll turn as yaw + π, π − pitch and roll + π do, and as any of them with whole turns. Where the pitch
    is a quarter turn, only the sum or the difference of yaw and roll matters; there, roll stays as before.
    """
    yaw, pitch, roll = angles(rotation)
    locked = np.abs(rotation[:, 1, 2]) >= 1 - 1e-9
    free = np.maximum.accumulate(np.where(locked, 0, np.arange(len(yaw))))
    yaw = np.where(locked, yaw + np.sign(pitch) * roll[free], yaw)
    first = np.column_stack([yaw, pitch, np.where(locked, roll[free], roll)])
    second = np.column_stack([yaw + np.pi, np.pi - pitch, first[:, 2] + np.pi])

    def apart(one: _Numbers, other: _Numbers) -> _Numbers:
        return np.asarray(np.abs(np.remainder(one - other + np.pi, 2 * np.pi) - np.pi).max(axis=1))

    # The distance between two rows is the same if both are replaced by their second forms.
    changes = apart(second[1:], first[:-1]) < apart(first[1:], first[:-1])
    is_second = np.concatenate([[False], np.cumsum(changes) % 2 == 1])
    return np.asarray(np.unwrap(np.where(is_second[:, None], second, first), axis=0))


def _split(ticks: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return moments with further ones evenly between them, so that none is missed where something turns quickly."""
    gaps = np.diff(ticks)
    parts = np.clip(gaps // _SHORTEST, 1, _FIRST)
    first, size, count = (np.repeat(each, parts) for each in (ticks[:-1], gaps, parts))
    within = np.arange(len(first)) - np.repeat(np.cumsum(parts) - parts, parts)
    return np.append(first + within * size // count, ticks[-1])


def _slack(values: _Numbers, tolerance: float) -> _Numbers:
    """Return by how much each of the values (t, 7) may be off."""
    slack = np.tile(np.array([tolerance] * 3 + [_TURN] * 3 + [0.0]), (len(values), 1))
    slack[:, 6] = np.minimum(_PART * np.exp(values[:, 6].max() - values[:, 6]), 1)
    return slack


def _refined(samples: _Samples, movement: Movement, base: _Numbers, tolerance: float) -> _Samples:
    """Return samples with further ones wherever the one in the middle of two is not on the line between them."""
    bends = np.ones(len(samples.ticks) - 1, bool)
    while True:
        after = np.flatnonzero(bends & (np.diff(samples.ticks) >= 2 * _SHORTEST))
        if not len(after) or len(samples.ticks) + len(after) > _MOST_SAMPLES:
            return samples
        middle = (samples.ticks[after] + samples.ticks[after + 1]) // 2
        samples = samples.with_more(_Samples.of(movement, base, middle))
        at = after + 1 + np.arange(len(after))
        values, ticks = samples.values(), samples.ticks
        part = ((ticks[at] - ticks[at - 1]) / (ticks[at + 1] - ticks[at - 1]))[:, None]
        line = values[at - 1] + part * (values[at + 1] - values[at - 1])
        bent = at[(np.abs(values[at] - line) > _BEND * _slack(values, tolerance)[at]).any(axis=1)]
        bends = np.zeros(len(ticks) - 1, bool)
        bends[bent - 1] = bends[bent] = True


def _thinned(times: _Numbers, values: _Numbers, slack: _Numbers) -> NDArray[np.int64]:
    """Return which samples to keep: from each, the farthest to which a line passes all between within their slack."""
    kept = [0]
    while kept[-1] < len(times) - 1:
        kept.append(_farthest(times, values, slack, kept[-1]))
    return np.array(kept)


def _farthest(times: _Numbers, values: _Numbers, slack: _Numbers, start: int) -> int:
    """Return the farthest sample that the line from the sample `start` may end at, see `_thinned`.

    The lines that pass the samples so far have slopes in an interval, for each column, which only shrinks.
    """
    count = 32
    while True:
        rows = slice(start + 1, start + 1 + count)
        after = (times[rows] - times[start])[:, None]
        rise = values[rows] - values[start]
        low = np.maximum.accumulate((rise - slack[rows]) / after)
        high = np.minimum.accumulate((rise + slack[rows]) / after)
        if (low[-1] <= high[-1]).all() and start + 1 + count < len(times):
            count *= 4
            continue
        fits = ((low <= rise / after) & (rise / after <= high)).all(axis=1)
        return start + 1 + int(np.flatnonzero(fits)[-1])
