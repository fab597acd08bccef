"""Compute with arrays of similarity transforms: a rotation about +Y, a uniform scale and a translation.

These are the transforms that nodes of a scene can have. Two of them compose to a third of the same kind, without
matrices.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Similarity:
    """Hold n transforms: point in the parent = position + scale · rotate(yaw, point).

    Attributes
    ----------
    position : (n, 3) float
        Metres, in the parent's frame.
    yaw : (n,) float
        Radians about +Y, counter-clockwise seen from above (+X turns to −Z).
    scale : (n,) float
        Factors, above 0.
    """

    position: NDArray[np.floating]
    yaw: NDArray[np.floating]
    scale: NDArray[np.floating]

    def __len__(self) -> int:
        """Return the number of transforms."""
        return len(self.yaw)

    def __getitem__(self, index: slice | NDArray[np.integer]) -> "Similarity":
        """Return the transforms in the rows `index`, numbers or a slice."""
        return Similarity(self.position[index], self.yaw[index], self.scale[index])

    def __setitem__(self, index: slice | NDArray[np.integer], value: "Similarity") -> None:
        """Overwrite the transforms in the rows `index`, numbers or a slice, with those of `value`."""
        self.position[index], self.yaw[index], self.scale[index] = value.position, value.yaw, value.scale


def identities(count: int, dtype: type[np.floating] = np.float64) -> Similarity:
    """Return `count` transforms that change nothing, metres and radians, as arrays of `dtype`."""
    return Similarity(np.zeros((count, 3), dtype), np.zeros(count, dtype), np.ones(count, dtype))


def compose(outer: Similarity, inner: Similarity) -> Similarity:
    """Return the n transforms that apply first `inner` and then `outer`, n transforms each, pair by pair."""
    cos, sin = np.cos(outer.yaw), np.sin(outer.yaw)
    x, y, z = inner.position.T
    turned = np.stack([cos * x + sin * z, y, cos * z - sin * x], axis=1)
    return Similarity(
        outer.position + outer.scale[:, None] * turned,
        outer.yaw + inner.yaw,
        outer.scale * inner.scale,
    )


def quaternions(yaw: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return unit quaternions (n, 4) float32, x y z w, of rotations about +Y by `yaw` (n,), radians."""
    rotation = np.zeros((len(yaw), 4), np.float32)
    rotation[:, 1], rotation[:, 3] = np.sin(yaw / 2), np.cos(yaw / 2)
    return rotation
