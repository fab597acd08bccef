"""Decide which impostor tiles a frame warps, and which tiles of earlier frames it reuses."""

from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from depthwalk.render import kernels
from depthwalk.render.impostors.reprojection_error import (
    COARSER,
    HARDEST,
    coarseness,
    covers_view,
    due,
    parallax,
)
from depthwalk.render.impostors.tile_cache import TileCache, shrunk
from depthwalk.render.impostors.tile_mapping import Tiles
from depthwalk.render.impostors.tile_placement import (
    NOTHING_PLACED,
    ImpostorObjects,
    PlacedTiles,
    place_impostors,
)
from depthwalk.render.impostors.tile_records import place_tiles, record_numbers
from depthwalk.render.impostors.warp_planes import Planes
from depthwalk.render.view.view import View
from depthwalk.scene.object_settings import TileParams
from depthwalk.types import Array, Mask, Rows

# The reprojection error, 1 where as large as allowed, of a tile that is provisional or lacks pieces that the viewer now
# sees: it is due, but within the budget. A piece that was back-facing when the tile was warped is still seen at a
# grazing angle, and covers no more than the parallax that is allowed.
_LACKING = 2.0
_LEAST_SHARE = 0.25  # of a frame's warp limit, reserved for what each later phase finds in sight
_MOST_STALE = 0.5  # if more of the last frame's tiles are stale, it is a camera cut: all are warped and packed tightly
_NO_SLOTS = np.zeros((0, 4), np.int64)


@dataclass(kw_only=True)
class TileWork:
    """Hold what passes 1 and 2 do in a frame.

    Attributes
    ----------
    warped : (k,) indices of the `ImpostorObjects` whose tiles pass 1 warps.
    planes : the planes of the warped tiles.
    tiles : how these planes map to texels.
    slots : (k, 4) where the warped tiles lie in the atlas: x, y, width, height, texels.
    whole : (k,) whether each warped tile holds all of its object.
    drawn : (d,) indices of the `ImpostorObjects` that pass 2 draws, first the aligned ones; within either kind the
        nearest first.
    aligned : how many of those drawn are aligned, that is, their texels are pixels of the picture.
    composite : (d,) COMPOSITE_RECORD of each drawn tile.
    level : (d,) level of detail of each drawn tile, see `CachedTiles`.
    pieces : (d,) pieces that each drawn tile shows, bit masks, see `CachedTiles`.
    resolution : (d,) texels along each side of each drawn tile over those that it should have there, 0 to 1.
    error : (d,) reprojection error of each drawn tile, 1 where it is as large as allowed.
    provisional : how many of the drawn tiles are coarser than they should be, for lack of time.
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
    """Decide in every frame which tiles are warped, and cache tiles from frame to frame."""

    def __init__(self) -> None:
        self._cache = TileCache()
        self._warped = 0  # triangles that were warped in this frame
        self._limit: int | None = None  # most triangles to warp; holds for tiles that cannot wait, too
        self._shown_before = 0  # how many tiles the last frame showed
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

    def invalidate(self, rows: Rows) -> None:
        """Mark the tiles of the objects with the `rows` (m,) as invalid, because the objects changed."""
        self._cache.invalidate(rows)

    def begin_phase(
        self,
        view: View,
        impostors: ImpostorObjects,
        layout: TileParams,
        limit: int | None = None,
        continues: bool = False,
    ) -> Array:
        """Return the reprojection errors of the tiles of some objects, from which `plan` decides which to warp.

        Parameters
        ----------
        view : the view of the picture, near and far plane fitted.
        impostors : the n objects that impostors show, nearest first.
        layout : how tiles are laid out, and how long they are reused.
        limit : how many triangles the frame may warp, see `PlanSettings.warp_limit`.
        continues : whether the objects belong to the same frame as those of the last call, and share its budget.

        Returns
        -------
        (n,) reprojection errors, 1 where as large as allowed; inf where a tile is missing, or does not cover the view.
        """
        self._continues = continues
        if not continues:
            self._shown_before = self._cache.shown_now
            self._cache.frame += 1
            self._limit = limit if layout.reuse_error else None
            self._warped = 0
        return self._errors(view, impostors, layout)

    def allowed(self, error: Array) -> tuple[Rows, int] | None:
        """Return which tiles cannot wait, and how many triangles may be warped for them; None: there is no limit.

        Parameters
        ----------
        error : (n,) reprojection errors from `begin_phase`.

        Returns
        -------
        (m,) indices of the tiles, and the number of triangles. Every phase of a frame gets a part of the limit.
        """
        if self._limit is None:
            return None
        left = max(self._limit - self._warped, int(_LEAST_SHARE * self._limit))
        return (error > HARDEST).nonzero()[0], left

    def plan(self, view: View, impostors: ImpostorObjects, error: Array, layout: TileParams) -> TileWork:
        """Decide which tiles to warp and which to draw.

        Parameters
        ----------
        view : the view of the picture, near and far plane fitted.
        impostors : the n objects of the last call of `begin_phase`; their levels may have changed since.
        error : (n,) reprojection errors that this call returned.
        layout : how tiles are laid out, and how long they are reused.

        Returns
        -------
        The tiles to warp, and those to draw.
        """
        area = self._cache.areas(impostors.row)
        stale = due(error, impostors.triangles, area, layout.triangle_budget - self._warped)
        jumped = self._limit is None and not self._continues
        jumped = jumped and stale.sum() > _MOST_STALE * max(len(impostors), self._shown_before)
        cut = not layout.reuse_error or jumped
        if cut:
            stale[:] = True
        number = stale.nonzero()[0]
        if not (len(number) or cut):
            return self._work(impostors, NOTHING_PLACED, _NO_SLOTS, error, stale)
        self._warped += int(impostors.triangles[number].sum())
        placed, slots = self._store(view, impostors, number, layout, pack=cut)
        error[placed.number] = 0
        stale[placed.number] = False  # what is stale now is out of sight
        return self._work(impostors, placed, slots, error, stale)

    def _work(
        self, impostors: ImpostorObjects, placed: PlacedTiles, slots: Rows, error: Array, stale: Mask
    ) -> TileWork:
        """Return what pass 1 warps, the `placed` tiles, and what pass 2 draws: all tiles that are not `stale` (m,)."""
        cache = self._cache
        row = cache.rows(impostors.row)
        drawn, aligned = ((row >= 0) & ~stale).nonzero()[0], 0
        if len(placed.number):
            lies_on_pixels = np.zeros(len(impostors), bool)
            lies_on_pixels[placed.number] = np.isfinite(placed.tiles.pixel[:, 0])
            of_drawn, aligned = lies_on_pixels[drawn], int(lies_on_pixels.sum())
            drawn = np.concatenate([drawn[of_drawn], drawn[~of_drawn]])
        cached, row, at, viewer = cache.tiles, row[drawn], impostors.at[drawn], impostors.viewer.take(drawn, 0)
        return TileWork(
            warped=placed.number,
            planes=placed.planes,
            tiles=placed.tiles,
            slots=slots,
            whole=placed.whole,
            drawn=drawn,
            aligned=aligned,
            composite=place_tiles(cached.record, row, viewer, impostors.objects, at),
            level=cached.level[row],
            pieces=cached.pieces[row],
            resolution=cached.resolution[row],
            error=error[drawn],
            provisional=int(cached.provisional[row].sum()),
            atlas_used=cache.used,
        )

    def _store(
        self, view: View, impostors: ImpostorObjects, number: Rows, layout: TileParams, pack: bool
    ) -> tuple[PlacedTiles, Rows]:
        """Place tiles for those objects `number` (n,) that are in sight, and store them in the atlas.

        If `pack` is set, they are packed into an empty atlas. Otherwise, where the atlas has no room for them, it is
        packed again with the tiles of all objects.

        Returns
        -------
        The tiles, and their slots (k, 4).
        """
        cache = self._cache
        placed = place_impostors(view, impostors, number, layout, min(cache.atlas_size))
        found = None if pack else cache.allocate(impostors.row[placed.number], placed.tiles.size)
        if found is None:
            if len(number) < len(impostors):
                placed = place_impostors(view, impostors, np.arange(len(impostors)), layout, min(cache.atlas_size))
            cache.clear()
            found = cache.pack(placed.tiles.size, roomy=layout.reuse_error > 0)
        slots, resolution = found
        if (resolution < 1).any():
            placed = replace(placed, tiles=placed.tiles.resized(shrunk(placed.tiles.size, resolution[:, None])))
        cache.store(placed.described(impostors, slots, resolution, cache.frame))
        return placed, slots

    def _errors(self, view: View, impostors: ImpostorObjects, layout: TileParams) -> Array:
        """Return the reprojection error (n,) of each object's cached tile, 1 where as large as allowed.

        It is inf where there is no tile, where the tile is cropped and does not cover the present view, and where it is
        provisional in a frame that has no limit.
        """
        row = self._cache.rows(impostors.row)
        known = (row >= 0).nonzero()[0]
        if not layout.reuse_error or not len(known):
            return np.full(len(impostors), np.inf)
        tiles, loops = self._cache.tiles, kernels.loaded()
        tiles.seen[row[known]] = self._cache.frame
        if loops is not None:
            return self._compiled_errors(loops, view, impostors, row, layout)
        error = np.full(len(impostors), np.inf)
        row, at, viewer = row[known], impostors.at[known], impostors.viewer[known]
        objects, bounds = impostors.objects, impostors.bounds
        scale, to_centre = objects.scale[at], bounds.centre[at] - view.position
        pixels = parallax(tiles.record.take(row), viewer, view.detail_pixels)
        density = view.detail_pixels * scale / np.linalg.norm(to_centre, axis=1)
        error[known] = np.maximum(pixels / layout.reuse_error, coarseness(tiles.density[row], density))
        cut = np.flatnonzero(~tiles.whole[row])
        forward, radius = to_centre[cut] @ view.axes[2], bounds.bounding_radius[at[cut]]
        span = np.stack([np.maximum(forward - radius, 0), forward + radius], -1) / scale[cut, None]
        covers = covers_view(tiles.take(row[cut]), view, objects.rotation[at[cut]], viewer[cut], span)
        error[known[cut[~covers]]] = np.inf
        lacks = known[(impostors.pieces[known] & ~tiles.pieces[row] != 0) | tiles.provisional[row]]
        error[lacks] = np.maximum(error[lacks], _LACKING)
        if self._limit is None:  # the frame has time to replace them
            error[known[tiles.provisional[row]]] = np.inf
        return error

    def _compiled_errors(
        self, loops: ModuleType, view: View, impostors: ImpostorObjects, row: Rows, layout: TileParams
    ) -> Array:
        """Compute `_errors` by compiled `loops`. row: (n,) see `TileCache.rows`."""
        tiles, objects, bounds = self._cache.tiles, impostors.objects, impostors.bounds
        return np.asarray(
            loops.errors(
                row=row,
                record=record_numbers(tiles.record),
                density=tiles.density,
                frustum=tiles.frustum,
                whole=tiles.whole,
                tile_pieces=tiles.pieces,
                provisional=tiles.provisional,
                at=impostors.at,
                viewer=impostors.viewer,
                pieces=impostors.pieces,
                rotation=objects.rotation,
                centre=bounds.centre,
                bounding_radius=bounds.bounding_radius,
                scale=objects.scale,
                position=view.position,
                axes=view.axes,
                ray_from_screen=view.ray_from_screen,
                detail_pixels=view.detail_pixels,
                reuse_error=layout.reuse_error,
                coarser=COARSER,
                lacking=_LACKING,
                limited=self._limit is not None,
            )
        )
