"""Find the objects near a viewer in the arrays of the renderer."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import matrices
from depthwalk.geometry.spatial_order import cell_members
from depthwalk.render.renderer import Renderer
from depthwalk.types import Array
from depthwalk.walk.collision.collider_store import ColliderStore, Surface
from depthwalk.walk.collision.placed_collider import PlacedCollider

_AHEAD = 4.0  # metres: objects within this distance of a box are prepared


class NearObjects:
    """Find objects near a viewer: two comparisons for each 256 objects of the scene, then for those of near cells.

    Parameters
    ----------
    renderer
        Knows where the objects are.
    store
        Makes the colliders of their assets.
    """

    def __init__(self, renderer: Renderer, store: ColliderStore) -> None:
        self._renderer, self._store = renderer, store

    @property
    def version(self) -> tuple[int, ...]:
        """Return numbers that change when objects or colliders do."""
        self._store.poll()
        return self._renderer.world.changes, self._store.arrived

    @property
    def is_waiting(self) -> bool:
        """Return whether surfaces near the viewer may still be unknown."""
        return self._store.is_busy or not self._renderer.world.is_computed

    def near(self, low: Array, high: Array) -> list[PlacedCollider] | None:
        """Return the objects that may touch a box, as far as their surfaces are known; None before the first frame.

        Colliders of these and of objects somewhat farther away begin to be made, the nearest first.

        Parameters
        ----------
        low, high
            (3,) least and greatest corner of the box, metres, world.
        """
        world = self._renderer.world
        if not world.is_computed:
            return None
        cells, bounds, objects = world.cells(), world.bounds(), world.objects()
        near = np.flatnonzero(((cells.low <= high + _AHEAD) & (cells.high >= low - _AHEAD)).all(1))
        rows = cells.order[cell_members(cells.first, near)]
        centre, radius = bounds.centre[rows], bounds.bounding_radius[rows]
        gap = np.linalg.norm(np.maximum(np.maximum(low - centre, centre - high), 0), axis=1) - radius
        within = np.flatnonzero(gap <= _AHEAD)
        within = within[np.argsort(gap[within], kind="stable")]
        found = []
        turns = matrices(objects.rotation[rows[within]].astype(np.float64))
        for row, apart, turn in zip(rows[within].tolist(), gap[within].tolist(), turns, strict=True):
            placed = self._placed(row, turn)
            if placed is not None and apart <= 0:
                found.append(placed)
        return found

    def _placed(self, row: int, rotation: NDArray[np.float64]) -> PlacedCollider | None:
        """Return the object of a row with its collider, if that is known."""
        objects, parts = self._renderer.world.objects(), self._renderer.assets.parts
        number, scale = int(objects.asset[row]), float(objects.scale[row])
        collider = self._store.collider(self._surface(number), parts.options, scale)
        if collider is None:
            return None
        position = objects.position[row].astype(np.float64)
        return PlacedCollider(row=row, collider=collider, position=position, rotation=rotation, scale=scale)

    def _surface(self, number: int) -> Surface:
        """Return what the collider of a number of `CookedParts` is made of."""
        parts = self._renderer.assets.parts
        if number < parts.first:
            return number, None
        asset = parts.asset_of(number)
        return asset, number - parts.numbers(asset).start
