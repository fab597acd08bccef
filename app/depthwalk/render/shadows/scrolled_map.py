"""Keep what a map of the sun still shows after it has moved with the viewer, and draw only what enters it.

As in a clipmap (Losasso and Hoppe 2004, "Geometry Clipmaps") a map moves by whole texels, so that texels can be copied.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from depthwalk.render.shadows.cascades import Cascade
from depthwalk.render.view.bounds import Bounds
from depthwalk.types import Array, Mask, Rows

_SAME = 1e-3  # texels: places are computed in double precision
_MARGIN = 2.0  # texels that the triangles of an object may reach beyond its sphere

Answers = Sequence[tuple[Rows, Mask]]
"""Queries whether meshes are on the GPU, by their numbers, each with its answer."""


@dataclass(frozen=True, kw_only=True)
class MapOrigin:
    """Hold what a map was planned from, by which its texels are known to be those of a later map.

    Attributes
    ----------
    changes
        The state of the world.
    detail
        How finely casters are drawn.
    rows
        (m,) rows of its casters.
    asked
        The queries whether meshes may cast in place of depth images.
    """

    changes: object
    detail: object
    rows: Rows
    asked: Answers

    def casts_same(self, later: "MapOrigin", rows: Rows) -> bool:
        """Return whether the objects `rows` cast the same shadows in the map and in a `later` one, which has all."""
        if (self.changes, self.detail) != (later.changes, later.detail) or not np.isin(rows, self.rows).all():
            return False
        before, now = _by_number(self.asked), _by_number(later.asked)
        return all(before[number] == now[number] for number in before.keys() & now.keys())


def moved_texels(view: Cascade, before: Cascade) -> tuple[int, int] | None:
    """Return by how many texels a map has moved to the right and up.

    None if it has not moved, or otherwise than by whole texels across the light, or so far that both share none.
    """
    if (view.half, view.resolution) != (before.half, before.resolution) or not np.array_equal(view.axes, before.axes):
        return None
    moved: Array = np.subtract(view.centre, before.centre) @ view.axes.T / view.texel
    whole = np.round(moved)
    if np.abs(moved - whole).max() > _SAME or whole[2] or not 0 < np.abs(whole).max() < view.resolution:
        return None
    right, up, _ = whole.astype(int).tolist()
    return right, up


def reach_beyond(view: Cascade, before: Cascade, bounds: Bounds) -> Mask:
    """Return which of n spheres (n,) a map may show where an earlier one, from which it has moved, showed nothing."""
    across = (bounds.centre - np.array(before.centre, np.float32)) @ before.axes[:2].T.astype(np.float32)
    radius = bounds.bounding_radius[:, None] + np.float32(_MARGIN * before.texel)
    moved = np.subtract(view.centre, before.centre) @ before.axes[:2].T
    low, high = np.maximum(across - radius, moved - view.half), np.minimum(across + radius, moved + view.half)
    edge = before.half + _SAME * before.texel
    return np.asarray((low < -edge).any(1) | (high > edge).any(1))


def _by_number(asked: Answers) -> dict[int, bool]:
    return {number: answer for rows, mask in asked for number, answer in zip(rows.tolist(), mask.tolist(), strict=True)}
