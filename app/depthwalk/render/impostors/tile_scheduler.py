"""Which intermediate images a frame warps anew, and which it shows as they are."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.impostors.reprojection_error import MARGIN, coarseness, due, frustum_rows, held, parallax
from depthwalk.render.impostors.tile_cache import CachedTiles, TileCache, shrunk
from depthwalk.render.impostors.tile_mapping import Tiles, plane_tiles, screen_tiles
from depthwalk.render.impostors.tile_records import place_tiles, tile_records
from depthwalk.render.impostors.warp_planes import GUARD, Planes, Volumes, choose_planes, crop_to_frustum, depths_behind
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Objects
from depthwalk.scene.render_settings import TileParams
from depthwalk.types import Array, Mask, Rows

# How far off a tile counts as in which something is missing that the viewer has just come round, 1 where as far as
# allowed: it is due, but within the budget. What turned its back when the tile was warped is still seen from the edge,
# and covers no more than the parallax by which the tile may be off.
_LACKING = 2.0
_MOST_ANEW = 0.5  # where more of what the last frame showed must be warped, all is, and packed tightly: a cut


@dataclass(frozen=True, kw_only=True)
class Shown:
    """m objects of a frame that are drawn by intermediate images, nearest first.

    row: (m,) of all objects; viewer: (m, 3) in their frames; level, pieces: (m,) of the grids that serve them now, the
    latter as bit masks (`cook.cases`); triangles: (m,) of all pieces.
    """

    row: Rows
    objects: Objects
    bounds: Bounds
    volumes: Volumes
    viewer: Array
    level: Rows
    pieces: Rows
    triangles: Rows

    def __len__(self) -> int:
        return len(self.row)

    def take(self, rows: Rows | Mask) -> "Shown":
        return Shown(
            row=self.row[rows],
            objects=self.objects.take(rows),
            bounds=self.bounds.take(rows),
            volumes=self.volumes.take(rows),
            viewer=self.viewer[rows],
            level=self.level[rows],
            pieces=self.pieces[rows],
            triangles=self.triangles[rows],
        )


@dataclass(kw_only=True)
class TileWork:
    """What passes 1 and 2 do in a frame.

    anew: (k,) numbers of those `Shown` whose tiles are warped; planes, tiles, slots (k, 4) of the atlas: where to;
    whole: (k,), the tile holds all of the object.
    drawn: (d,) numbers of those that are drawn, first the `aligned` ones whose texels are pixels, of either the nearest
    first; composite: (d,) COMPOSITE_RECORD; level, pieces, resolution: (d,), see `CachedTiles`; error: (d,), how far off
    they may be, 1 where as far as allowed.
    atlas_used: part of the atlas.
    """

    anew: Rows
    planes: Planes
    tiles: Tiles
    slots: Rows
    whole: Mask
    drawn: Rows
    aligned: int
    composite: NDArray[np.void]
    level: Rows
    pieces: Rows
    resolution: Array
    error: Array
    atlas_used: float


class TileScheduler:
    """Keeps tiles from frame to frame."""

    def __init__(self) -> None:
        self._cache = TileCache()
        self._budget = 0  # triangles left to this frame

    def forget(self, objects: int, atlas_size: tuple[int, int]) -> None:
        """Starts with an empty atlas of that size, for as many objects."""
        self._cache = TileCache(objects, atlas_size)

    def spoil(self, rows: Rows) -> None:
        """To be called when what tiles show is no longer as it was."""
        self._cache.spoil(rows)

    def plan(self, view: View, shown: Shown, layout: TileParams, continues: bool = False) -> TileWork:
        """What to warp and to draw for the view, of objects that have a plane each. goes_on: they join what was drawn
        of the frame before."""
        cache = self._cache
        lately = cache.shown_lately
        if not continues:
            cache.frame += 1
            self._budget = layout.triangle_budget
        error = self._errors(view, shown, layout)
        stale = due(error, shown.triangles, self._budget)
        cut = not layout.reuse_error or (not continues and stale.sum() > _MOST_ANEW * max(len(shown), lately))
        if cut:
            stale[:] = True
        self._budget -= int(shown.triangles[stale].sum())
        placed, slots = self._store(view, shown, np.flatnonzero(stale), layout, cut)
        error[placed.number] = 0
        stale[placed.number] = False  # what still is stale is out of sight
        row = cache.rows(shown.row)
        drawn = np.flatnonzero((row >= 0) & ~stale)
        aligned = np.zeros(len(shown), bool)
        aligned[placed.number] = np.isfinite(placed.tiles.pixel[:, 0])
        drawn = np.concatenate([drawn[aligned[drawn]], drawn[~aligned[drawn]]])
        kept, row = cache.tiles, row[drawn]
        composite = kept.record.take(row)  # of records, far quicker than an index
        place_tiles(composite, shown.viewer[drawn], shown.objects.scale[drawn], shown.objects.rotation[drawn])
        return TileWork(
            anew=placed.number,
            planes=placed.planes,
            tiles=placed.tiles,
            slots=slots,
            whole=placed.whole,
            drawn=drawn,
            aligned=int(aligned.sum()),
            composite=composite,
            level=kept.level[row],
            pieces=kept.pieces[row],
            resolution=kept.resolution[row],
            error=error[drawn],
            atlas_used=cache.used,
        )

    def _store(self, view: View, shown: Shown, number: Rows, layout: TileParams, pack: bool) -> tuple["_Placed", Rows]:
        """Puts those of `number` (n,) that are in sight into the atlas, and tells where and into which slots (k, 4).
        pack: into an empty one. So it does with all objects where it finds no room for these."""
        cache = self._cache
        placed = _place(view, shown, number, layout, min(cache.atlas_size))
        found = None if pack else cache.allocate(shown.row[placed.number], placed.tiles.size)
        if found is None:
            if len(number) < len(shown):
                placed = _place(view, shown, np.arange(len(shown)), layout, min(cache.atlas_size))
            cache.clear()
            found = cache.pack(placed.tiles.size, roomy=layout.reuse_error > 0)
        slots, resolution = found
        placed = replace(placed, tiles=placed.tiles.resized(shrunk(placed.tiles.size, resolution[:, None])))
        cache.store(_kept(view, placed, slots, resolution, cache.frame))
        return placed, slots

    def _errors(self, view: View, shown: Shown, layout: TileParams) -> Array:
        """How far off (n,) what is kept shows each object, 1 where as far as allowed; inf where nothing is kept."""
        error = np.full(len(shown), np.inf)
        row = self._cache.rows(shown.row)
        known = np.flatnonzero(row >= 0)
        if not layout.reuse_error or not len(known):
            return error
        tiles, row, viewer = self._cache.tiles, row[known], shown.viewer[known]
        tiles.seen[row] = self._cache.frame
        scale = shown.objects.scale[known]
        to_centre = shown.bounds.centre[known] - view.position
        pixels = parallax(tiles.record.take(row), viewer, view.focal_pixels)
        density = view.focal_pixels * scale / np.linalg.norm(to_centre, axis=1)
        error[known] = np.maximum(pixels / layout.reuse_error, coarseness(tiles.density[row], density))
        cut = np.flatnonzero(~tiles.whole[row])
        forward, bounding_radius = to_centre[cut] @ view.axes[2], shown.bounds.bounding_radius[known[cut]]
        span = np.stack([np.maximum(forward - bounding_radius, 0), forward + bounding_radius], -1) / scale[cut, None]
        holds = held(tiles.take(row[cut]), view, shown.objects.rotation[known[cut]], viewer[cut], span)
        error[known[cut[~holds]]] = np.inf
        lacks = known[shown.pieces[known] & ~tiles.pieces[row] != 0]
        error[lacks] = np.maximum(error[lacks], _LACKING)
        return error


@dataclass(frozen=True, kw_only=True)
class _Placed:
    """Planes and tiles of k objects, the `shown`, which are `number` (k,) of all, and which tiles hold the whole
    object."""

    shown: Shown
    number: Rows
    planes: Planes
    tiles: Tiles
    whole: Mask


def _place(view: View, shown: Shown, number: Rows, layout: TileParams, limit: int) -> _Placed:
    """Of the objects `number` (n,) those in sight, on planes cut to it, with tiles of `limit` texels at most."""
    some = shown.take(number)
    planes = choose_planes(some.viewer, some.volumes)
    guard = MARGIN if layout.reuse_error else GUARD
    planes, seen = crop_to_frustum(planes, view, some.objects.rotation, guard)
    if not seen.visible.all():
        rows = np.flatnonzero(seen.visible)
        planes, seen, some, number = planes.take(rows), seen.take(rows), some.take(rows), number[rows]
    if layout.tile_mapping == "plane":
        planes, tiles = plane_tiles(planes, view.focal_pixels * layout.tile_scale, limit)
    else:
        nearest = (some.bounds.centre - view.position) @ view.axes[2] - some.bounds.bounding_radius
        depth = np.maximum(nearest, view.depth_range[0]) / some.objects.scale
        tiles = screen_tiles(planes, seen, view, depth, layout.tile_scale, limit)
    return _Placed(shown=some, number=number, planes=planes, tiles=tiles, whole=seen.whole)


def _kept(view: View, placed: _Placed, slots: Rows, resolution: Array, frame: int) -> CachedTiles:
    """What is known of tiles warped now, into `slots` (k, 4) with the part `resolution` (k,) of their texels."""
    shown = placed.shown
    depths = depths_behind(placed.planes, shown.volumes)
    distance = np.linalg.norm(shown.bounds.centre - view.position, axis=1)
    return CachedTiles(
        record=tile_records(shown.viewer, placed.planes, depths, placed.tiles, slots[:, :2]),
        object=shown.row,
        slot=slots,
        seen=np.full(len(slots), frame),
        density=view.focal_pixels * shown.objects.scale / distance,
        frustum=frustum_rows(view, shown.objects.rotation),
        whole=placed.whole,
        level=shown.level,
        pieces=shown.pieces,
        resolution=resolution,
    )
