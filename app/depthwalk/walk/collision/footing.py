"""Find the surface on which a viewer stands."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.types import Array
from depthwalk.walk.collision.body import FOOT

_STEEPEST = 0.2  # cosine of the slope up to which a surface can be stood on
_EDGE = 1e-6  # part of a triangle by which points may lie outside, so that none falls between two triangles
_SPOTS = FOOT * np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)])  # where the feet are, about the centre


@dataclass(frozen=True, kw_only=True)
class Footing:
    """Hold k triangles that can be stood on.

    Attributes
    ----------
    box : (4, k) float64
        Least x, greatest x, least z and greatest z of each, metres, world.
    origin : (k, 3) float64
        First corner of each, metres, world.
    weights : (k, 2, 2) float64
        What a vector from there, seen from above, is multiplied by for the weights of the second and third corner.
    rise : (k, 2) float64
        Height of the second and third corner above the first, metres.
    """

    box: NDArray[np.float64]
    origin: NDArray[np.float64]
    weights: NDArray[np.float64]
    rise: NDArray[np.float64]

    def heights(self, position: complex) -> Array:
        """Return the heights (h,), metres, world y, of the surfaces above and below the feet of a viewer.

        Parameters
        ----------
        position
            Where the viewer stands, metres, world x + i z.
        """
        west, east, north, south = self.box
        x, z = position.real, position.imag
        rows = np.flatnonzero((west <= x + FOOT) & (east >= x - FOOT) & (north <= z + FOOT) & (south >= z - FOOT))
        if not len(rows):
            return np.zeros(0)
        away = (np.array([x, z]) + _SPOTS)[:, None] - self.origin[rows][:, [0, 2]]
        weight = np.einsum("kij,skj->ski", self.weights[rows], away)
        inside = (weight >= -_EDGE).all(-1) & (weight.sum(-1) <= 1 + _EDGE)
        height = self.origin[rows, 1] + (weight * self.rise[rows]).sum(-1)
        return np.asarray(height[inside])


def footing(corners: NDArray[np.float64]) -> Footing:
    """Return the footing that triangles offer.

    Parameters
    ----------
    corners
        (t, 3, 3) triangles, metres, world.

    Returns
    -------
    Footing
        Those that are not too steep.
    """
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    level = u[:, 2] * v[:, 0] - u[:, 0] * v[:, 2]
    across = (u[:, 1] * v[:, 2] - u[:, 2] * v[:, 1]) ** 2 + (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) ** 2
    flat = level**2 > _STEEPEST**2 * (across + level**2)
    a, u, v, level, plan = a[flat], u[flat], v[flat], level[flat], corners[flat][..., [0, 2]]
    weights = np.stack([-v[:, 2], v[:, 0], u[:, 2], -u[:, 0]], -1).reshape(-1, 2, 2) / level[:, None, None]
    return Footing(
        box=np.stack([plan[..., 0].min(1), plan[..., 0].max(1), plan[..., 1].min(1), plan[..., 1].max(1)]),
        origin=a,
        weights=weights,
        rise=np.stack([u[:, 1], v[:, 1]], -1),
    )


def stand(heights: Array, feet: float, step: float, top: float) -> float | None:
    """Return the height on which a viewer comes to stand: the highest surface no higher than a step.

    Parameters
    ----------
    heights
        (h,) heights of the surfaces above and below the viewer, metres, world y.
    feet
        Present height of the feet, metres, world y.
    step
        Greatest height to step up, metres.
    top
        Height of the body, metres; it is not lifted into a ceiling.

    Returns
    -------
    float | None
        The height, metres, world y; None where nothing is underneath.
    """
    ceiling = heights[heights > feet + step].min(initial=np.inf)
    below = heights[heights <= feet + step]
    free = below[(below <= feet) | (below + top < ceiling)]
    return float(free.max()) if len(free) else None
