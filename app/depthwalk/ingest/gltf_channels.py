"""Read how single properties of glTF nodes change: the channels of animations, and their samplers.

glTF 2.0, section 3.11 and appendix C. What is malformed raises ValueError, TypeError or LookupError.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.hermite import hermite
from depthwalk.ingest.gltf_accessors import Accessors
from depthwalk.limits import MAX_KEYFRAMES

TICK = 1e-4
"""Seconds: moments are whole numbers of these, so that a scene file can say them with few digits."""

REST = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}
"""The properties of nodes that change their matrices, and what they are unless a node says otherwise."""

FARTHEST = 1e12
"""In values and matrices: products of a few such numbers are finite."""

_INTERPOLATIONS = "LINEAR", "STEP", "CUBICSPLINE"
_MOST_SECONDS = 1e6  # as long as the keyframes of a scene file may take
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
            return self._unit(hermite(before, after, leaving, arriving, part))
        return _slerp(before, after, part) if self.is_rotation else before + (after - before) * part

    def _unit(self, values: _Numbers) -> _Numbers:
        return normalised(values) if self.is_rotation else values

    @property
    def is_still(self) -> bool:
        """Whether the value never changes."""
        small = _STILL * max(1.0, float(np.abs(self.values).max()))
        bent = self.tangents is not None and float(np.abs(self.tangents).max()) > small
        return len(self.times) == 1 or (not bent and bool(np.ptp(self.values, axis=0).max() <= small))


def normalised(turn: _Numbers) -> _Numbers:
    """Return quaternions (n, 4) as unit ones."""
    return np.asarray(turn / np.maximum(np.linalg.norm(turn, axis=1, keepdims=True), 1e-12))


def _slerp(before: _Numbers, after: _Numbers, part: _Numbers) -> _Numbers:
    """Return the unit quaternions (n, 4) at `part` (n, 1) of the shorter ways between others (n, 4)."""
    before, after = normalised(before), normalised(after)
    cosine = (before * after).sum(axis=1, keepdims=True)
    after, cosine = np.where(cosine < 0, -after, after), np.minimum(np.abs(cosine), 1)
    angle = np.arccos(cosine)
    near = angle < 1e-4  # where the sine would be divided by itself, a straight line is as good
    sine = np.where(near, 1, np.sin(angle))
    first = np.where(near, 1 - part, np.sin((1 - part) * angle) / sine)
    second = np.where(near, part, np.sin(part * angle) / sine)
    return normalised(first * before + second * after)


def read_channel(header: Header, sampler: Header, path: str, accessors: Accessors) -> Channel:
    """Return the channel that a sampler makes for a property.

    Parameters
    ----------
    header
        The JSON header.
    sampler
        An item of an animation's `samplers`.
    path
        The property, a key of REST.
    accessors
        Reads keyframes.

    Returns
    -------
    Channel
        The channel.

    Raises
    ------
    ValueError, TypeError, LookupError
        For damaged data: keyframes that do not ascend, that are not finite or more than MAX_KEYFRAMES.
    """
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
    splined, width = kind == "CUBICSPLINE", len(REST[path])
    values = accessors.read(sampler["output"], 3 * count if splined else count).astype(np.float64)
    if values.shape[1] != width or not (np.abs(values) < FARTHEST).all():
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
