"""The scene's objects as they are drawn, in arrays that stay until objects move or are to be drawn otherwise."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cook import CookOptions
from depthwalk.render.resources.asset_store import AssetStore, Library
from depthwalk.render.view.bounds import Bounds, object_bounds
from depthwalk.render.world.asset_table import AssetTable, asset_table, place_objects, placed_rows
from depthwalk.render.world.far_clusters import FarClusters, make_far_clusters
from depthwalk.render.world.spatial_cells import Cells, sort_into_cells
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.scene.scene import Scene
from depthwalk.types import Rows


@dataclass(frozen=True, kw_only=True)
class SceneArrays:
    """All objects of a scene, in sight or not: where they are, their assets, and in what clusters."""

    objects: Objects
    bounds: Bounds
    table: AssetTable
    clusters: FarClusters


class RenderWorld:
    """What is made of a scene for drawing it: each array when it is first asked for."""

    def __init__(self, scene: Scene, library: Library, assets: AssetStore) -> None:
        self._scene, self._library, self._assets = scene, library, assets
        self._representation: Representation | None = None
        self._table: AssetTable | None = None
        self._objects: Objects | None = None
        self._bounds: Bounds | None = None
        self._cells: Cells | None = None
        self._clusters: FarClusters | None = None

    def objects(self) -> Objects:
        """By the representation asked for: a row for each part of their depth images, in its frame. `asset` holds
        numbers of `AssetStore`."""
        if self._objects is None:
            self._objects = place_objects(self._scene, self._library, self._assets, self._representation)
        return self._objects

    def table(self) -> AssetTable:
        """Bounds, cylinders and index ranges of the assets, which are loaded for it."""
        lod, warp = self._scene.render.lod, self._scene.render.warp
        form = CookOptions("paper" in (lod.mode, lod.cases) or warp.order == "epipole", lod.cases == "paper")
        if self._assets.form != form:
            self._assets.release()
            self._assets.form, self._table = form, None
        if self._table is None:
            self._table = asset_table(self.objects(), self._library, self._assets)
        return self._table

    def bounds(self) -> Bounds:
        """Where the objects are."""
        if self._bounds is None:
            table = self.table()
            self._bounds = object_bounds(self.objects(), table.centre, table.bounding_radius)
        return self._bounds

    def cells(self) -> Cells:
        """The objects in cells of neighbours."""
        if self._cells is None:
            self._cells = sort_into_cells(self.bounds())
        return self._cells

    def clusters(self) -> FarClusters:
        """The objects of each cell in clusters that may share an intermediate image."""
        if self._clusters is None:
            objects, round_about = self.objects(), self.table().volumes.has_side
            shareable = (objects.representation == Representation.DPCI) & round_about[objects.asset]
            self._clusters = make_far_clusters(self.cells(), self.bounds(), shareable)
        return self._clusters

    def arrays(self) -> SceneArrays:
        """All of these at once."""
        return SceneArrays(objects=self.objects(), bounds=self.bounds(), table=self.table(), clusters=self.clusters())

    def moved(self, changed: slice | None = None) -> None:
        """To be called after `set_node_transform`, with the slice of the scene's objects that it returned; None: any
        may have moved."""
        if changed is None or self._cells is None or self._bounds is None:
            self._objects = self._bounds = self._cells = self._clusters = None
            return
        if changed.start == changed.stop:
            return
        context = self._scene, self._library, self._assets, self._representation
        table, objects, rows = self.table(), self.objects(), placed_rows(*context, changed)
        objects.put(rows, place_objects(*context, changed))
        self._bounds.put(rows, object_bounds(objects.take(rows), table.centre, table.bounding_radius))
        cells = self._cells.refit(self._bounds, rows)
        if self._clusters is not None:
            self._clusters.refit(self._bounds, cells)

    @property
    def representation(self) -> Representation | None:
        """How all objects are drawn whose asset allows it; None: as the scene says."""
        return self._representation

    @representation.setter
    def representation(self, wanted: Representation | None) -> None:
        if wanted is not self._representation:
            self._representation = wanted
            self._objects = self._table = self._bounds = self._cells = self._clusters = None


class FrameResidency:
    """What the objects of one frame need on the GPU, in the order in which they are asked for.

    seconds: after which no further upload begins, see `AssetStore.stream`; None: a frame waits for all.
    """

    def __init__(self, placed: RenderWorld, assets: AssetStore, seconds: float | None) -> None:
        self._asset, self._meshes = placed.objects().asset, placed.table().meshes
        self._assets, self._seconds = assets, seconds
        self._needed: list[int] = []
        self._absent: set[int] = set()
        assets.meshes.begin_frame()

    def there(self, rows: Rows) -> NDArray[np.bool_]:
        """Whether (m,) the assets of the objects `rows` (m,), nearest first, are on the GPU, once what fits the time
        and the budget has been brought there."""
        asset = self._asset[rows]
        new = np.bincount(asset, minlength=len(self._assets)) > 0
        new[: self._assets.first_depth] = new[self._needed] = False
        if new.any():
            numbers, first = np.unique(asset, return_index=True)
            nearest = numbers[np.argsort(first)]
            self._needed += nearest[new[nearest]].tolist()
        return self._assets.stream(self._needed, self._seconds)[asset]

    def fallback_mesh(self, meshes: Rows) -> NDArray[np.bool_]:
        """Whether (n,) the `meshes` (n,), nearest first, may stand in for depth images: the others are being read. One
        that has not come when it is first asked for has not for this frame, so that all views of a frame agree."""
        numbers, first = np.unique(meshes, return_index=True)
        asked = [number for number in numbers[np.argsort(first)].tolist() if number not in self._absent]
        there = self._assets.meshes.mesh_fallbacks(asked, wait=self._seconds is None)
        self._absent.update(number for number in asked if number not in there)
        for number, levels in there.items():
            self._meshes.add(number, levels)
        return np.isin(meshes, list(there))
