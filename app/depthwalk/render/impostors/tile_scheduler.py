"""Decide which impostor tiles a frame warps, and which of earlier frames it reuses."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.impostors.reprojection_error import (
    HARDEST,
    MARGIN,
    coarseness,
    covers_view,
    due,
    frustum_rows,
    parallax,
)
from depthwalk.render.impostors.tile_cache import CachedTiles, TileCache, shrunk
from depthwalk.render.impostors.tile_mapping import Tiles, plane_tiles, screen_tiles
from depthwalk.render.impostors.tile_records import place_tiles, tile_records
from depthwalk.render.impostors.warp_planes import GUARD, Planes, Volumes, choose_planes, crop_to_frustum, depths_behind
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Objects
from depthwalk.scene.render_settings import TileParams
from depthwalk.types import Array, Mask, Rows

# The reprojection error, 1 where as large as allowed, of a tile that is provisional or lacks pieces that the viewer now
# sees: it is due, but within the budget. What turned its back when the tile was warped is still seen at a grazing angle
# and covers no more than the parallax by which the tile may be off.
_LACKING = 2.0
_LEAST_SHARE = 0.25  # of the triangles that a frame may warp, for what a later phase finds in sight
_MOST_STALE = 0.5  # if more of the tiles that the last frame showed are stale, all are warped and packed tightly: a cut


@dataclass(frozen=True, kw_only=True)
class ImpostorObjects:
    """Hold m objects that impostor tiles show in a frame, nearest first.

    Attributes
    ----------
    row : (m,) row of each object among all, by which its tile is found again in the next frame.
    objects : the objects.
    bounds : the bounding spheres of the objects, world.
    volumes : the cylinders of the objects.
    viewer : (m, 3) the viewer in the objects' frames, metres.
    level : (m,) level of detail that serves each object now.
    pieces : (m,) pieces that serve each object now, bit masks, see `cook.cases`.
    triangles : (m,) how many triangles all pieces of that level have.
    provisional : (m,) whether that level is coarser than what serves, for want of time.
    """

    row: Rows
    objects: Objects
    bounds: Bounds
    volumes: Volumes
    viewer: Array
    level: Rows
    pieces: Rows
    triangles: Rows
    provisional: Mask

    def __len__(self) -> int:
        return len(self.row)

    def take(self, rows: Rows | Mask) -> "ImpostorObjects":
        """Return some of the objects, those that `rows` selects: numbers (k,) or a mask (m,)."""
        return ImpostorObjects(
            row=self.row[rows],
            objects=self.objects.take(rows),
            bounds=self.bounds.take(rows),
            volumes=self.volumes.take(rows),
            viewer=self.viewer[rows],
            level=self.level[rows],
            pieces=self.pieces[rows],
            triangles=self.triangles[rows],
            provisional=self.provisional[rows],
        )

    def coarsened(self, rows: Rows, level: Rows, pieces: Rows, triangles: Rows) -> "ImpostorObjects":
        """Return the objects with a provisional level for some of them.

        Parameters
        ----------
        rows : (k,) numbers of those objects.
        level, pieces, triangles : (k,) their columns at that level.

        Returns
        -------
        All objects.
        """
        new = {"level": level, "pieces": pieces, "triangles": triangles, "provisional": np.ones(len(rows), bool)}
        columns = {name: getattr(self, name).copy() for name in new}
        for name, column in columns.items():
            column[rows] = new[name]
        return replace(self, **columns)


@dataclass(kw_only=True)
class TileWork:
    """Hold what passes 1 and 2 do in a frame.

    Attributes
    ----------
    warped : (k,) numbers of the `ImpostorObjects` whose tiles pass 1 warps.
    planes : the planes of the warped tiles.
    tiles : how these planes map to texels.
    slots : (k, 4) where the warped tiles lie in the atlas: x, y, width, height, texels.
    whole : (k,) whether each warped tile holds all of its object.
    drawn : (d,) numbers of the `ImpostorObjects` that pass 2 draws, first the aligned ones; within either kind the
        nearest first.
    aligned : how many of those drawn are aligned, which means that their texels are pixels of the picture.
    composite : (d,) COMPOSITE_RECORD of each drawn tile.
    level : (d,) level of detail of each drawn tile, see `CachedTiles`.
    pieces : (d,) pieces that each drawn tile shows, bit masks, see `CachedTiles`.
    resolution : (d,) texels along each side of each drawn tile over those that it should have there, 0 to 1.
    error : (d,) reprojection error of each drawn tile, 1 where it is as large as allowed.
    provisional : how many of the drawn tiles are coarser than they should be, for want of time.
    atlas_used : part of the atlas that holds tiles, 0 to 1.
    """

    warped: Rows
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
    provisional: int
    atlas_used: float


class TileScheduler:
    """Decide in every frame which tiles are warped, and keep tiles from frame to frame."""

    def __init__(self) -> None:
        self._cache = TileCache()
        self._warped = 0  # triangles that were warped in this frame
        self._limit: int | None = None  # of these, where even what cannot wait has one
        self._shown_before = 0  # how many tiles the last frame showed; in later phases, this one
        self._continues = False  # whether this is a later phase of a frame

    def forget(self, objects: int, atlas_size: tuple[int, int]) -> None:
        """Drop all tiles, and start with an empty atlas.

        Parameters
        ----------
        objects : how many objects may have a tile.
        atlas_size : width and height of the atlas, texels.
        """
        self._cache = TileCache(objects, atlas_size)

    def reserve(self, objects: int) -> None:
        """Make room for the tiles of `objects` objects in all; the tiles that are cached stay."""
        self._cache.reserve(objects)

    def spoil(self, rows: Rows) -> None:
        """Have the tiles of the objects with the `rows` (m,) warped again in the next frame, because these changed."""
        self._cache.spoil(rows)

    def begin_phase(
        self,
        view: View,
        impostors: ImpostorObjects,
        layout: TileParams,
        limit: int | None = None,
        continues: bool = False,
    ) -> Array:
        """Return how far the tiles of some objects are off, before `plan` decides which to warp.

        Parameters
        ----------
        view : the view of the picture, near and far plane fitted.
        impostors : the n objects that impostors show, nearest first.
        layout : how tiles are laid out, and how long they are reused.
        limit : how many triangles the frame may warp, see `PlanSettings.warp_limit`.
        continues : whether the objects belong to the same frame as those of the last call, and share its budget.

        Returns
        -------
        (n,) reprojection errors, 1 where as large as allowed; inf where a tile is missing, or lacks what is seen.
        """
        self._shown_before, self._continues = self._cache.shown_now, continues
        if not continues:
            self._cache.frame += 1
            self._limit = limit if layout.reuse_error else None
            self._warped = 0
        return self._errors(view, impostors, layout)

    def allowed(self, error: Array) -> tuple[Rows, int] | None:
        """Return which tiles cannot wait, and how many triangles there may be for them; None where any number may.

        Parameters
        ----------
        error : (n,) reprojection errors from `begin_phase`.

        Returns
        -------
        (m,) numbers of the tiles, and the number of triangles. Every phase of a frame gets a part.
        """
        if self._limit is None:
            return None
        left = max(self._limit - self._warped, int(_LEAST_SHARE * self._limit))
        return np.flatnonzero(error > HARDEST), left

    def plan(self, view: View, impostors: ImpostorObjects, error: Array, layout: TileParams) -> TileWork:
        """Decide which tiles to warp and which to draw.

        Parameters
        ----------
        view : the view of the picture, near and far plane fitted.
        impostors : the n objects of the last call of `begin_phase`; other levels may serve them now.
        error : (n,) reprojection errors that this call returned.
        layout : how tiles are laid out, and how long they are reused.

        Returns
        -------
        The tiles to warp, and those to draw.
        """
        stale = due(error, impostors.triangles, layout.triangle_budget - self._warped)
        most_stale = _MOST_STALE * max(len(impostors), self._shown_before)
        jumped = self._limit is None and not self._continues and stale.sum() > most_stale
        cut = not layout.reuse_error or jumped
        if cut:
            stale[:] = True
        self._warped += int(impostors.triangles[stale].sum())
        placed, slots = self._store(view, impostors, np.flatnonzero(stale), layout, pack=cut)
        error[placed.number] = 0
        stale[placed.number] = False  # what is stale now is out of sight
        return self._work(impostors, placed, slots, error, stale)

    def _work(
        self, impostors: ImpostorObjects, placed: "_PlacedTiles", slots: Rows, error: Array, stale: Mask
    ) -> TileWork:
        """Return what pass 1 warps, the `placed`, and what pass 2 draws: all that is not `stale` (m,)."""
        cache = self._cache
        row = cache.rows(impostors.row)
        drawn = np.flatnonzero((row >= 0) & ~stale)
        aligned = np.zeros(len(impostors), bool)
        aligned[placed.number] = np.isfinite(placed.tiles.pixel[:, 0])
        drawn = np.concatenate([drawn[aligned[drawn]], drawn[~aligned[drawn]]])
        cached, row = cache.tiles, row[drawn]
        composite = cached.record.take(row)  # of records, far quicker than an index
        objects = impostors.objects
        place_tiles(composite, impostors.viewer[drawn], objects.scale[drawn], objects.rotation[drawn])
        return TileWork(
            warped=placed.number,
            planes=placed.planes,
            tiles=placed.tiles,
            slots=slots,
            whole=placed.whole,
            drawn=drawn,
            aligned=int(aligned.sum()),
            composite=composite,
            level=cached.level[row],
            pieces=cached.pieces[row],
            resolution=cached.resolution[row],
            error=error[drawn],
            provisional=int(cached.provisional[row].sum()),
            atlas_used=cache.used,
        )

    def _store(
        self, view: View, impostors: ImpostorObjects, number: Rows, layout: TileParams, pack: bool
    ) -> tuple["_PlacedTiles", Rows]:
        """Store tiles of those objects `number` (n,) that are in sight in the atlas.

        Where the atlas has no room for them, it is packed again with the tiles of all objects.

        If `pack` is true, they are packed into an empty atlas in any case.

        Returns
        -------
        The tiles, and their slots (k, 4).
        """
        cache = self._cache
        placed = _place(view, impostors, number, layout, min(cache.atlas_size))
        found = None if pack else cache.allocate(impostors.row[placed.number], placed.tiles.size)
        if found is None:
            if len(number) < len(impostors):
                placed = _place(view, impostors, np.arange(len(impostors)), layout, min(cache.atlas_size))
            cache.clear()
            found = cache.pack(placed.tiles.size, roomy=layout.reuse_error > 0)
        slots, resolution = found
        placed = replace(placed, tiles=placed.tiles.resized(shrunk(placed.tiles.size, resolution[:, None])))
        cache.store(_cached(view, placed, slots, resolution, cache.frame))
        return placed, slots

    def _errors(self, view: View, impostors: ImpostorObjects, layout: TileParams) -> Array:
        """Return the reprojection error (n,) of each object's cached tile, 1 where as large as allowed.

        It is inf where there is no tile, where the tile was cut off too near to what the view shows now, and where it
        is provisional in a frame that has no limit.
        """
        error = np.full(len(impostors), np.inf)
        row = self._cache.rows(impostors.row)
        known = np.flatnonzero(row >= 0)
        if not layout.reuse_error or not len(known):
            return error
        tiles, row, viewer = self._cache.tiles, row[known], impostors.viewer[known]
        tiles.seen[row] = self._cache.frame
        scale = impostors.objects.scale[known]
        to_centre = impostors.bounds.centre[known] - view.position
        pixels = parallax(tiles.record.take(row), viewer, view.detail_pixels)
        density = view.detail_pixels * scale / np.linalg.norm(to_centre, axis=1)
        error[known] = np.maximum(pixels / layout.reuse_error, coarseness(tiles.density[row], density))
        cut = np.flatnonzero(~tiles.whole[row])
        forward, radius = to_centre[cut] @ view.axes[2], impostors.bounds.bounding_radius[known[cut]]
        span = np.stack([np.maximum(forward - radius, 0), forward + radius], -1) / scale[cut, None]
        covers = covers_view(tiles.take(row[cut]), view, impostors.objects.rotation[known[cut]], viewer[cut], span)
        error[known[cut[~covers]]] = np.inf
        lacks = known[(impostors.pieces[known] & ~tiles.pieces[row] != 0) | tiles.provisional[row]]
        error[lacks] = np.maximum(error[lacks], _LACKING)
        if self._limit is None:  # nobody waits for this frame
            error[known[tiles.provisional[row]]] = np.inf
        return error


@dataclass(frozen=True, kw_only=True)
class _PlacedTiles:
    """Hold planes and tiles of k `impostors`, which are `number` (k,) of all. whole: (k,) tiles hold all of them."""

    impostors: ImpostorObjects
    number: Rows
    planes: Planes
    tiles: Tiles
    whole: Mask


def _place(view: View, impostors: ImpostorObjects, number: Rows, layout: TileParams, limit: int) -> _PlacedTiles:
    """Find planes and tiles for those of the objects `number` (n,) that are in sight, cut to what is seen of them.

    limit: texels along a tile at most.
    """
    chosen = impostors.take(number)
    planes = choose_planes(chosen.viewer, chosen.volumes)
    guard = MARGIN if layout.reuse_error else GUARD
    planes, seen = crop_to_frustum(planes, view, chosen.objects.rotation, guard)
    if not seen.visible.all():
        rows = np.flatnonzero(seen.visible)
        planes, seen, chosen, number = planes.take(rows), seen.take(rows), chosen.take(rows), number[rows]
    if layout.tile_mapping == "plane":
        planes, tiles = plane_tiles(planes, view.detail_pixels * layout.tile_scale, limit)
    else:
        nearest = (chosen.bounds.centre - view.position) @ view.axes[2] - chosen.bounds.bounding_radius
        depth = np.maximum(nearest, view.depth_range[0]) / chosen.objects.scale
        tiles = screen_tiles(planes, seen, view, depth, layout.tile_scale / view.scale, limit)
    return _PlacedTiles(impostors=chosen, number=number, planes=planes, tiles=tiles, whole=seen.whole)


def _cached(view: View, placed: _PlacedTiles, slots: Rows, resolution: Array, frame: int) -> CachedTiles:
    """Describe for the cache the tiles warped now, into `slots` (k, 4) with the part `resolution` (k,) of their texels.

    frame: number of the present frame.
    """
    impostors = placed.impostors
    depths = depths_behind(placed.planes, impostors.volumes)
    distance = np.linalg.norm(impostors.bounds.centre - view.position, axis=1)
    return CachedTiles(
        record=tile_records(impostors.viewer, placed.planes, depths, placed.tiles, slots[:, :2]),
        object=impostors.row,
        slot=slots,
        seen=np.full(len(slots), frame),
        density=view.detail_pixels * impostors.objects.scale / distance,
        frustum=frustum_rows(view, impostors.objects.rotation),
        whole=placed.whole,
        level=impostors.level,
        pieces=impostors.pieces,
        resolution=resolution,
        provisional=impostors.provisional,
    )
