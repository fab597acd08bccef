"""Keep the scene's objects in arrays as they are drawn, until they move or their representation changes."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from depthwalk.assets.demand import cook_options
from depthwalk.errors import InputError
from depthwalk.geometry.extreme_points import extreme_points
from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.render import kernels
from depthwalk.render.lod.mesh_choice import MeshChoice, advised_table
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.resources.library import Library
from depthwalk.render.view.bounds import Bounds, Cylinders, cylinders, object_bounds
from depthwalk.render.view.view import View
from depthwalk.render.world.asset_table import AssetTable, asset_table
from depthwalk.render.world.object_rows import ObjectRows, rows_of
from depthwalk.render.world.placeholders import Placeholders, find_placeholders
from depthwalk.render.world.spatial_cells import SpatialCells, in_sight, sort_into_cells
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.scene.scene import Scene, show_moment
from depthwalk.types import Array, Ints, Mask, Rows

if TYPE_CHECKING:
    from depthwalk.render.world.moving_objects import MovingObjects


@dataclass(frozen=True, kw_only=True)
class SceneArrays:
    """Hold all objects of a scene, in sight or not, and their assets.

    Attributes
    ----------
    objects : the objects, or parts of objects, as they are drawn.
    bounds : their bounding spheres, world.
    table : bounds, levels and index ranges of the assets.
    generation : how often all of this was computed from scratch; impostor tiles of an earlier generation are dropped.
    choice : which objects are drawn by `auto`, whichever way is quicker; None where none is.
    """

    objects: Objects
    bounds: Bounds
    table: AssetTable
    generation: int = 0
    choice: MeshChoice | None = None


class RenderWorld:
    """Turn a scene into the arrays that drawing needs, each computed when it is first asked for.

    Parameters
    ----------
    scene : the scene whose objects are drawn.
    library : reads meshes and depth images of the scene's assets.
    assets : numbers meshes and parts of depth images, and uploads them to the GPU.
    """

    def __init__(self, scene: Scene, library: Library, assets: AssetStore) -> None:
        self._scene, self._library, self._assets = scene, library, assets
        self._representation: Representation | None = None
        self._table: AssetTable | None = None
        self._objects: Objects | None = None
        self._owners: Ints | None = None
        self._bounds: Bounds | None = None
        self._choice: MeshChoice | None = None
        self._arrays: SceneArrays | None = None
        self._cells: SpatialCells | None = None
        self._extremes: dict[int, Array] = {}
        self._generation = self._changes = 0
        self._moment: float | None = None
        self._moving_rows: tuple[Ints, Rows] | None = None
        self._moments = 0  # how often `show_moment` moved something
        self._placeholders = Placeholders.none(len(library), len(scene.objects))
        self._viewer: Array | None = None

    def objects(self) -> Objects:
        """Return the objects as they are drawn: a row for a mesh, or one for each part of the depth images.

        Returns
        -------
        The rows, those of parts in the frames of these parts. `asset` holds the numbers of `CookedParts`, and
        `representation` is how each object is drawn.
        """
        if self._objects is None:
            shown_by = self._library, self._assets, self._representation
            self._placeholders = find_placeholders(self._scene.objects, *shown_by, self._viewer)
            self._objects = self._rows.place()
        return self._objects

    def owners(self) -> Ints:
        """Return which of `scene_objects` each of the rows (n,) of `objects` shows, or a part of it."""
        self.objects()  # finds the placeholders
        if self._owners is None:
            self._owners = self._rows.owners()
        return self._owners

    @property
    def scene_objects(self) -> Objects:
        """Return the objects as the scene places them: a row for each, in the frame of its asset."""
        return self._scene.objects

    def assets_in_sight(self, view: View, min_pixels: float, which: Mask) -> list[int]:
        """Return which of the scene's assets a view may see.

        Parameters
        ----------
        view : the view of the picture.
        min_pixels : diameter of objects, pixels, below which they are left out.
        which : (a,) the assets to test.

        Returns
        -------
        Their numbers, rising.
        """
        asset = self._assets.parts.assets()[self.objects().asset]
        rows, _ = in_sight(view, self.bounds(), min_pixels, np.flatnonzero(which[asset]))
        return [int(number) for number in np.unique(asset[rows])]

    @property
    def _rows(self) -> ObjectRows:
        """Return the rows in which the objects are drawn, with the current placeholders."""
        return ObjectRows(
            scene=self._scene,
            library=self._library,
            store=self._assets,
            forced=self._representation,
            placeholders=self._placeholders,
        )

    def take_arrivals(self, viewer: Array) -> None:
        """Take over assets that came in the background, and settings that assets are cooked by; recompute all arrays.

        Where there are none, everything stays as it is. Frames begin with this: within one, nothing changes.

        Parameters
        ----------
        viewer : (3,) where the viewer stands, metres, world; the nearest assets are loaded first.
        """
        self._viewer = viewer
        self._cook_as_set()
        if self._assets.poll():
            self._forget()

    @property
    def generation(self) -> int:
        """Return a number that changes whenever objects were added, replaced or moved."""
        return self._generation

    @property
    def changes(self) -> int:
        """Return a number that changes whenever anything that `arrays` returns does, down to single objects."""
        return self._changes

    @property
    def edits(self) -> int:
        """Return a number that changes as `changes` does, but not when only time has moved what is animated."""
        return self._changes - self._moments

    @property
    def is_whole(self) -> bool:
        """Return whether every object of the scene is shown in some way.

        False while objects are left out because their assets are still being read in the background.
        """
        return len(self.objects()) >= len(self._scene.objects)

    @property
    def is_computed(self) -> bool:
        """Return whether objects, bounds and cells are known, so that asking for them reads nothing."""
        return self._objects is not None and self._bounds is not None and self._cells is not None

    def _forget(self) -> None:
        self._objects = self._owners = self._table = self._bounds = self._cells = self._choice = self._moment = None
        self._arrays = None
        self._extremes.clear()
        self._generation += 1
        self._changes += 1

    def _cook_as_set(self) -> None:
        """Drop all assets if they were cooked by other options than the settings ask for."""
        options = cook_options(self._scene.render)
        if self._assets.parts.options != options:
            self._assets.release()
            self._assets.parts.options = options
            self._forget()

    def table(self) -> AssetTable:
        """Return bounds, cylinders and index ranges of the assets, loading them first if necessary."""
        if self._table is None:
            self._cook_as_set()
            as_in_scene = self._representation in (None, Representation.AUTO)  # other names allow no fallback
            self._table = asset_table(self.objects(), self._library, self._assets.parts, as_in_scene)
        return self._table

    def bounds(self) -> Bounds:
        """Return the bounding spheres of the objects, world."""
        if self._bounds is None:
            table = self.table()
            self._bounds = object_bounds(self.objects(), table.centre, table.bounding_radius)
        return self._bounds

    def cylinders(self, rows: Rows) -> Cylinders:
        """Return the cylinders, world, that enclose the objects `rows` (m,)."""
        table, centre, loops = self.table(), self.bounds().centre, kernels.loaded()
        if loops is not None:
            objects = self.objects()
            enclosing = loops.upright_cylinders(
                rows=rows.astype(np.int64, copy=False),
                centre=centre,
                rotation=objects.rotation,
                asset=objects.asset,
                scale=objects.scale,
                half_height=table.half_height,
                radius=table.cylinder_radius,
            )
            return Cylinders(*enclosing)
        return cylinders(self.objects().take(rows), centre[rows], table.half_height, table.cylinder_radius)

    def points(self, number: int) -> Array:
        """Return all points of the surface of an asset, reading it if necessary.

        Parameters
        ----------
        number : the number in `CookedParts` of a mesh or a part of depth images, which `objects` use.

        Returns
        -------
        (n, 3) metres, in the frame of the objects that show it; the origin alone where the asset has no points.
        """
        if number < len(self._library):
            mesh = self._library.drawn_mesh(number)
            points = np.zeros((1, 3)) if mesh is None else mesh.positions
        else:
            points = np.concatenate([self._assets.parts.load(number)[0].positions, self._translucent_points(number)])
        return points if len(points) else np.zeros((1, 3))

    def _translucent_points(self, number: int) -> Array:
        """Return the corners (n, 3) of translucent triangles, which depth images lack, in the part's frame."""
        try:
            mesh = self._library.translucent_mesh(self._assets.parts.asset_of(number))
        except InputError:  # reported when it is drawn
            mesh = None
        if mesh is None:
            return np.zeros((0, 3))
        part, corners = self._assets.parts.cooked(number).outline, np.unique(mesh.translucent_faces)
        return rotate(conjugate(np.array(part.rotation)), mesh.positions[corners] - part.position)

    def extremes(self, number: int) -> Array:
        """Return those of `points` that reach farthest, (k, 3), see `geometry.extreme_points`.

        They are kept, since each key that shows all objects asks for them again, and reading all points takes a while.
        """
        if number not in self._extremes:
            self._extremes[number] = extreme_points(self.points(number))
        return self._extremes[number]

    @property
    def ground_height(self) -> float | None:
        """Return the y of the ground, metres, world; None where the scene has none."""
        ground = self._scene.environment.ground
        return None if ground is None else ground.height

    def cells(self) -> SpatialCells:
        """Return the objects sorted into cells of neighbours."""
        if self._cells is None:
            self._cells = sort_into_cells(self.bounds())
        return self._cells

    def arrays(self) -> SceneArrays:
        """Return objects, bounds and table together; where single objects move, they change in place."""
        if self._arrays is None:
            self._arrays = SceneArrays(
                objects=self.objects(),
                bounds=self.bounds(),
                table=self.table(),
                generation=self._generation,
                choice=self._mesh_choice(),
            )
        return self._arrays

    def _mesh_choice(self) -> MeshChoice | None:
        """Return which objects are drawn by `auto`, and the advice measured for them; None where none is."""
        objects, table = self.objects(), self.table()
        if self._choice is None and self._has_auto():
            parts = self._assets.parts
            names = {
                number: self._scene.assets[parts.asset_of(number)].name for number in range(parts.first, len(parts))
            }
            self._choice = MeshChoice(
                chooses=self._rows.chooses() & (objects.asset >= parts.first),
                advised=advised_table(len(table.levels), names, self._scene.advice),
            )
        return self._choice

    def _has_auto(self) -> bool:
        """Return whether any object may be drawn by `auto`."""
        forced = self._representation
        if forced is None:
            return bool((self._scene.objects.representation == Representation.AUTO).any())
        return forced is Representation.AUTO

    def show_moment(self, seconds: float) -> None:
        """Move what is animated to where it is at a moment, seconds since the scene's animations began.

        What else moved it since the last moment is overwritten; the same moment again changes nothing.
        """
        if self._scene.animations is None or self._moment == seconds:
            return
        self.moved(show_moment(self._scene, seconds))
        self._moment, self._moments = seconds, self._moments + 1

    def moving_rows(self) -> Rows:
        """Return the rows (k,) of `objects` that animations move."""
        animations = self._scene.animations
        if animations is None:
            return np.zeros(0, np.int64)
        owners = self.owners()
        if self._moving_rows is None or self._moving_rows[0] is not owners:
            self._moving_rows = owners, rows_of(animations.moved_objects, owners)
        return self._moving_rows[1]

    def moving(self, view: View) -> "MovingObjects | None":
        """Return how what is animated moves at the moment of a view that was drawn last; None where nothing ever does.

        Only what the view may show counts.
        """
        if self._scene.animations is None:
            return None
        from depthwalk.render.world.moving_objects import moving_objects  # here: most scenes stand still

        rows, _ = in_sight(view, self.bounds(), 0.0, self.moving_rows())
        return moving_objects(self._scene, view.camera.time, self.owners()[rows], self.cylinders(rows))

    def moved(self, changed: slice | Rows | None = None) -> None:
        """Update the arrays for objects that moved; call this after `set_node_transform`.

        Parameters
        ----------
        changed : the slice of the scene's objects that `set_node_transform` returned, or (k,) rows of such objects,
            ascending; None: any may have moved.
        """
        self._changes += 1
        if changed is None or self._cells is None or self._bounds is None:
            self._objects = self._owners = self._bounds = self._cells = self._choice = self._arrays = None
            self._generation += 1
            return
        if isinstance(changed, slice):
            changed = np.arange(changed.start, changed.stop)
        if not len(changed):
            return
        table, objects = self.table(), self.objects()
        rows = rows_of(changed, self.owners())
        objects.put(rows, self._rows.place(changed))
        self._bounds.put(rows, object_bounds(objects.take(rows), table.centre, table.bounding_radius))
        self._cells.refit(self._bounds, rows)

    @property
    def representation(self) -> Representation | None:
        """Return the representation by which all objects are drawn whose asset allows it.

        None where each is drawn as the scene says, with meshes in place of depth images near by and, by `auto`, where
        they are quicker.
        """
        return self._representation

    @representation.setter
    def representation(self, representation: Representation | None) -> None:
        if representation is not self._representation:
            self._representation = representation
            self._forget()
