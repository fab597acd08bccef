"""Sort translucent surfaces from back to front, for all objects of a frame at once.

Translucent triangles are blended over what is behind them, so they are drawn from back to front (Porter and Duff 1984,
"Compositing Digital Images"). The triangles of the nearest objects are sorted one by one, and again when the viewer has
moved noticeably. Other objects are sorted as wholes among those of the same asset, so that each asset is one draw call.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.limits import MAX_TRANSLUCENT_TRIANGLES
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.resources.placed_records import PLACED_RECORD, placed_records
from depthwalk.render.resources.translucent_mesh import TranslucentMesh
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.render.world.render_world import RenderWorld
from depthwalk.render.world.spatial_cells import in_sight
from depthwalk.scene.arrays import Objects
from depthwalk.types import Array, Rows

_SORTED_OBJECTS = 16  # nearest translucent objects of a frame whose triangles are sorted
_MOVED = (
    0.02  # part of the distance, or of the object's radius, that the viewer moves before triangles are sorted again
)


@dataclass(frozen=True, kw_only=True)
class SortedRun:
    """Describe sorted triangles of one object that share textures.

    Attributes
    ----------
    run : their number in `TranslucentMesh.runs`.
    first : the first of them in `TranslucentDraws.faces`.
    count : how many there are.
    """

    run: int
    first: int
    count: int


@dataclass(frozen=True, kw_only=True)
class TranslucentBatch:
    """Describe objects of one asset that are drawn together.

    Attributes
    ----------
    asset : the number of the asset.
    first : the first record.
    count : how many records there are, the farthest first.
    sorted : the triangles of a single object from back to front; None: in the asset's order.
    """

    asset: int
    first: int
    count: int
    sorted: tuple[SortedRun, ...] | None = None


@dataclass(frozen=True, kw_only=True)
class TranslucentDraws:
    """Hold what the pass `translucency` draws in one frame.

    Attributes
    ----------
    records : (n,) PLACED_RECORD of the objects in sight.
    batches : the draws, from back to front.
    faces : (k, 3) uint32 sorted triangles of the nearest objects, rows of their assets' vertices.
    """

    records: NDArray[np.void]
    batches: tuple[TranslucentBatch, ...]
    faces: NDArray[np.uint32]

    def records_of(self, batch: TranslucentBatch) -> NDArray[np.void]:
        """Return the records of one of the batches."""
        return self.records[batch.first : batch.first + batch.count]


NO_TRANSLUCENT_DRAWS = TranslucentDraws(
    records=np.zeros(0, PLACED_RECORD), batches=(), faces=np.zeros((0, 3), np.uint32)
)
"""Nothing lets light through or glows, as in most frames."""


@dataclass(frozen=True, kw_only=True)
class _Order:
    """Hold triangles of a mesh as they were sorted for a viewer (3,), metres, asset frame: (run, faces), rear first."""

    mesh: TranslucentMesh
    viewer: Array
    runs: list[tuple[int, NDArray[np.uint32]]]


class TranslucencyPlanner:
    """Plan what the pass `translucency` draws of a world.

    Parameters
    ----------
    world : the world whose objects are drawn.
    assets : the store that keeps their translucent triangles.
    """

    def __init__(self, world: RenderWorld, assets: AssetStore) -> None:
        self._world, self._assets = world, assets
        self._orders: dict[int, _Order] = {}  # by the row of the object

    def plan(self, view: View, min_pixels: float, *, wait: bool) -> TranslucentDraws:
        """Return the translucent and glowing surfaces to draw of the objects in a view.

        Parameters
        ----------
        view : the view of the picture.
        min_pixels : diameter, pixels, below which objects, and the translucent part of objects, are left out.
        wait : whether to wait until their assets are read; otherwise a thread reads them in the background.

        Returns
        -------
        The draws, from back to front.

        Raises
        ------
        InputError
            For files that cannot be used, if `wait`.
        """
        store = self._assets.translucent
        if store.is_unknown.any():
            store.ask(self._world.assets_in_sight(view, min_pixels, store.is_unknown), wait)
        if not store.objects:
            self._orders.clear()
            return NO_TRANSLUCENT_DRAWS
        objects = self._world.scene_objects
        rows = np.flatnonzero(np.isin(objects.asset, list(store.objects)))
        bounds = self._bounds(objects.take(rows))
        seen, _ = in_sight(view, bounds, min_pixels, np.arange(len(rows)))
        distance = np.linalg.norm(bounds.centre[seen] - view.position, axis=1)
        order = np.argsort(-distance, kind="stable")
        return self._draws(view, objects, rows[seen[order]])

    def _bounds(self, objects: Objects) -> Bounds:
        """Return spheres about the translucent and glowing triangles of n objects, world."""
        store = self._assets.translucent.objects
        centre, radius = np.zeros((max(store) + 1, 3), np.float32), np.zeros(max(store) + 1, np.float32)
        for number, translucent in store.items():
            centre[number], radius[number] = translucent.mesh.centre, translucent.mesh.radius
        offset = rotate(objects.rotation, centre[objects.asset] * objects.scale[:, None])
        return Bounds(objects.position + offset, radius[objects.asset] * objects.scale)

    def _draws(self, view: View, objects: Objects, rows: Rows) -> TranslucentDraws:
        """Return the draws of the objects `rows` (n,), the farthest first."""
        near, far = self._near_and_far(objects, rows)
        # Assets in the order of their farthest objects.
        _, first, of_asset = np.unique(objects.asset[far], return_index=True, return_inverse=True)
        far = far[np.argsort(first[of_asset], kind="stable")]
        drawn = objects.take(np.concatenate([far, near]))
        records = placed_records(view.position, drawn)
        batches, faces, count = list(_batches(drawn.asset[: len(far)])), [np.zeros((0, 3), np.uint32)], 0
        orders: dict[int, _Order] = {}
        for record, row in enumerate(near.tolist(), len(far)):
            asset = int(objects.asset[row])
            mesh = self._assets.translucent.objects[asset].mesh
            order = orders[row] = self._order(row, mesh, records[record])
            runs = []
            for run, sorted_faces in order.runs:
                runs.append(SortedRun(run=run, first=count, count=len(sorted_faces)))
                faces.append(sorted_faces)
                count += len(sorted_faces)
            batches.append(TranslucentBatch(asset=asset, first=record, count=1, sorted=tuple(runs)))
        self._orders = orders
        return TranslucentDraws(records=records, batches=tuple(batches), faces=np.concatenate(faces))

    def _near_and_far(self, objects: Objects, rows: Rows) -> tuple[Rows, Rows]:
        """Split the objects `rows`, the farthest first, into those whose triangles are sorted, and the others.

        Sorted are the nearest translucent ones, within a limit on their triangles. What only glows needs no order.
        """
        store = self._assets.translucent.objects
        triangles = np.zeros(max(store) + 1, np.int64)
        triangles[list(store)] = [len(translucent.mesh.centroids) for translucent in store.values()]
        count = triangles[objects.asset[rows]]
        through = np.flatnonzero(count)[-_SORTED_OBJECTS:]
        near = through[np.cumsum(count[through][::-1])[::-1] <= MAX_TRANSLUCENT_TRIANGLES]
        return rows[near], np.delete(rows, near)

    def _order(self, row: int, mesh: TranslucentMesh, placed: np.void) -> _Order:
        """Return the triangles of an object from back to front, sorted again only if the viewer has moved enough."""
        rotation = placed["rotation"].astype(np.float64)
        viewer = -rotate(conjugate(rotation), placed["origin"].astype(np.float64)) / float(placed["scale"])
        known = self._orders.get(row)
        away = max(float(np.linalg.norm(viewer - mesh.centre)), mesh.radius)
        if known is not None and known.mesh is mesh and float(np.linalg.norm(viewer - known.viewer)) < _MOVED * away:
            return known
        return _Order(mesh=mesh, viewer=viewer, runs=back_to_front(mesh, viewer))


def back_to_front(mesh: TranslucentMesh, viewer: Array) -> list[tuple[int, NDArray[np.uint32]]]:
    """Sort the translucent triangles of a mesh by the distances of their centroids.

    Parameters
    ----------
    mesh : the triangles.
    viewer : (3,) metres, asset frame.

    Returns
    -------
    The number of each run of equal textures with its triangles (t, 3), rows of `mesh.vertices`, the farthest first.
    Runs are sorted likewise, by the mean distance of their triangles.
    """
    distance = np.linalg.norm(mesh.centroids - viewer, axis=1)
    found = []
    for number, run in enumerate(mesh.runs):
        own = slice(run.first, run.first + run.count)
        order = np.argsort(-distance[own], kind="stable")
        found.append((float(distance[own].mean()), number, mesh.faces[own][order]))
    return [(number, faces) for _, number, faces in sorted(found, key=lambda entry: -entry[0])]


def _batches(asset: NDArray[np.integer]) -> Iterator[TranslucentBatch]:
    """Yield a batch for each run of equal numbers of assets (n,)."""
    starts = np.flatnonzero(np.diff(asset, prepend=-1))
    for first, end in zip(starts.tolist(), [*starts[1:].tolist(), len(asset)], strict=False):
        yield TranslucentBatch(asset=int(asset[first]), first=first, count=end - first)
