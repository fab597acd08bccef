"""Compute with arrays of similarity transforms: a rotation, a uniform scale and a translation.

These are the transforms that nodes of a scene can have. Two of them compose to a third of the same kind, without
matrices.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Similarity:
    """Hold n transforms: point in the parent = position + scale · rotate(rotation, point).

    Attributes
    ----------
    position : (n, 3) float
        Metres, in the parent's frame.
    rotation : (n, 4) float
        Unit quaternions (x, y, z, w), parent from node.
    scale : (n,) float
        Factors, above 0.
    """

    position: NDArray[np.floating]
    rotation: NDArray[np.floating]
    scale: NDArray[np.floating]

    def __len__(self) -> int:
        """Return the number of transforms."""
        return len(self.scale)

    def __getitem__(self, index: slice | NDArray[np.integer]) -> "Similarity":
        """Return the transforms in the rows `index`, numbers or a slice."""
        return Similarity(self.position[index], self.rotation[index], self.scale[index])

    def __setitem__(self, index: slice | NDArray[np.integer], value: "Similarity") -> None:
        """Overwrite the transforms in the rows `index`, numbers or a slice, with those of `value`."""
        self.position[index], self.rotation[index], self.scale[index] = value.position, value.rotation, value.scale


def identities(count: int, dtype: type[np.floating] = np.float64) -> Similarity:
    """Return `count` transforms that change nothing, metres, as arrays of `dtype`."""
    rotation = np.zeros((count, 4), dtype)
    rotation[:, 3] = 1
    return Similarity(np.zeros((count, 3), dtype), rotation, np.ones(count, dtype))


def compose(outer: Similarity, inner: Similarity) -> Similarity:
    """Return the n transforms that apply first `inner` and then `outer`, n transforms each, pair by pair.

    The result is as precise as `outer`. It is written out by coordinates: for a million objects, the functions of
    `geometry.quaternions` would take twice as long.
    """
    (x, y, z, w), (px, py, pz), factor = outer.rotation.T, inner.position.T, outer.scale
    bx, by, bz, bw = inner.rotation.T
    across_x, across_y, across_z = y * pz - z * py + w * px, z * px - x * pz + w * py, x * py - y * px + w * pz
    twice = 2 * factor
    position, rotation = np.empty_like(outer.position), np.empty_like(outer.rotation)
    position[:, 0] = outer.position[:, 0] + factor * px + twice * (y * across_z - z * across_y)
    position[:, 1] = outer.position[:, 1] + factor * py + twice * (z * across_x - x * across_z)
    position[:, 2] = outer.position[:, 2] + factor * pz + twice * (x * across_y - y * across_x)
    rotation[:, 0] = w * bx + x * bw + y * bz - z * by
    rotation[:, 1] = w * by - x * bz + y * bw + z * bx
    rotation[:, 2] = w * bz + x * by - y * bx + z * bw
    rotation[:, 3] = w * bw - x * bx - y * by - z * bz
    return Similarity(position, rotation, factor * inner.scale)


def from_yaw(yaw: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the rotations (n, 4), x y z w, by `yaw` (n,), radians, about +Y, as precise as `yaw`."""
    rotation = np.zeros((len(yaw), 4), yaw.dtype)
    rotation[:, 1], rotation[:, 3] = np.sin(yaw / 2), np.cos(yaw / 2)
    return rotation


def from_angles(
    yaw: NDArray[np.floating], pitch: NDArray[np.floating], roll: NDArray[np.floating]
) -> NDArray[np.floating]:
    """Return the rotations that turn first by `roll` about +Z, then by `pitch` about +X, then by `yaw` about +Y.

    Parameters
    ----------
    yaw, pitch, roll : (n,) radians, counter-clockwise seen from the tip of the axis.

    Returns
    -------
    (n, 4) unit quaternions (x, y, z, w), as precise as `yaw`.
    """
    (sy, cy), (sx, cx), (sz, cz) = ((np.sin(angle / 2), np.cos(angle / 2)) for angle in (yaw, pitch, roll))
    rotation = np.empty((len(yaw), 4), yaw.dtype)
    rotation[:, 0] = cy * sx * cz + sy * cx * sz
    rotation[:, 1] = sy * cx * cz - cy * sx * sz
    rotation[:, 2] = cy * cx * sz - sy * sx * cz
    rotation[:, 3] = cy * cx * cz + sy * sx * sz
    return rotation


def angles(
    rotation: NDArray[np.floating],
) -> tuple[NDArray[np.floating], NDArray[np.floating], NDArray[np.floating]]:
    """Return the angles from which `from_angles` makes rotations.

    Parameters
    ----------
    rotation : (n, 3, 3) rotation matrices, for column vectors.

    Returns
    -------
    yaw, pitch and roll (n,), radians; where the pitch is a quarter turn, roll is 0.
    """
    pitch = np.arcsin(np.clip(-rotation[:, 1, 2], -1, 1))
    upright = np.abs(rotation[:, 1, 2]) < 1 - 1e-9
    yaw = np.where(
        upright,
        np.arctan2(rotation[:, 0, 2], rotation[:, 2, 2]),
        np.arctan2(-rotation[:, 2, 0], rotation[:, 0, 0]),
    )
    roll = np.where(upright, np.arctan2(rotation[:, 1, 0], rotation[:, 1, 1]), 0.0)
    return yaw, pitch, roll
