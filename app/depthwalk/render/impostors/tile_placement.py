"""Lay out impostor tiles: the planes that they are warped on, cropped to the view, and how these map to texels."""

from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np

from depthwalk.render import kernels
from depthwalk.render.impostors.frustum_crop import GUARD, crop_to_frustum
from depthwalk.render.impostors.reprojection_error import MARGIN, frustum_rows
from depthwalk.render.impostors.tile_cache import CachedTiles
from depthwalk.render.impostors.tile_mapping import Tiles, plane_tiles, screen_tiles
from depthwalk.render.impostors.tile_records import tile_records
from depthwalk.render.impostors.warp_planes import Planes, Volumes, choose_planes, depths_behind
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Objects
from depthwalk.scene.object_settings import TileParams
from depthwalk.types import Array, Mask, Rows


@dataclass(frozen=True, kw_only=True)
class ImpostorObjects:
    """Hold m objects that impostor tiles show in a frame, nearest first.

    They are given as indices into n `objects`, so that nothing need be copied.

    Attributes
    ----------
    row : (m,) row of each object in the scene, by which its tile is found again in the next frame.
    at : (m,) index of each in `objects`.
    objects : n objects.
    bounds : the bounding spheres of `objects`, world.
    volumes : cylinders, of the objects or of their assets.
    volume : (n,) index in `volumes` of the cylinder of each of the `objects`.
    viewer : (m, 3) the viewer in the objects' frames, metres.
    level : (m,) level of detail to draw each object at.
    pieces : (m,) pieces to draw of each object, bit masks, see `cook.cases`.
    triangles : (m,) number of triangles in all pieces of that level.
    provisional : (m,) whether that level is coarser than it should be, for lack of time.
    """

    row: Rows
    at: Rows
    objects: Objects
    bounds: Bounds
    volumes: Volumes
    volume: Rows
    viewer: Array
    level: Rows
    pieces: Rows
    triangles: Rows
    provisional: Mask

    def __len__(self) -> int:
        return len(self.row)

    @property
    def asset(self) -> Rows:
        """Return the numbers (m,) of the objects' assets in `CookedParts`."""
        return self.objects.asset[self.at]

    def coarsened(self, rows: Rows, level: Rows, pieces: Rows, triangles: Rows) -> "ImpostorObjects":
        """Return the objects, with a provisional level for those at `rows`.

        Parameters
        ----------
        rows : (k,) indices among the m objects.
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


@dataclass(frozen=True, kw_only=True)
class PlacedTiles:
    """Hold planes and tiles that k objects are to be warped into.

    Attributes
    ----------
    number : (k,) their indices among the `ImpostorObjects` of the frame.
    planes : the planes that they are warped on.
    tiles : how these map to texels.
    depths : (k, 2) least and greatest depth of each object behind its plane, metres.
    whole : (k,) whether each tile holds all of its object.
    density : (k,) pixels per metre at the object's centre, object frame.
    frustum : (k, 3, 3) what a tile that is not whole holds, see `CachedTiles.frustum`.
    """

    number: Rows
    planes: Planes
    tiles: Tiles
    depths: Array
    whole: Mask
    density: Array
    frustum: Array

    def described(self, impostors: ImpostorObjects, slots: Rows, resolution: Array, frame: int) -> CachedTiles:
        """Return the tiles as the cache stores them.

        Parameters
        ----------
        impostors : the objects that `number` refers to.
        slots : (k, 4) where they lie in the atlas: x, y, width, height, texels.
        resolution : (k,) texels along each side over those that the tile should have there, 0 to 1.
        frame : number of the present frame.

        Returns
        -------
        The k tiles.
        """
        number = self.number
        return CachedTiles(
            record=tile_records(impostors.viewer[number], self.planes, self.depths, self.tiles, slots[:, :2]),
            object=impostors.row[number],
            slot=slots,
            seen=np.full(len(slots), frame),
            density=self.density,
            frustum=self.frustum,
            whole=self.whole,
            level=impostors.level[number],
            pieces=impostors.pieces[number],
            resolution=resolution,
            provisional=impostors.provisional[number],
        )


def _nothing_placed() -> PlacedTiles:
    """Return the placement of no tiles."""
    number, real, pair, vector = np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 2)), np.zeros((0, 3))
    matrix, size = np.zeros((0, 3, 3)), np.zeros((0, 2), np.int64)
    planes = Planes(
        face=number,
        right=vector,
        up=vector,
        normal=vector,
        distance=real,
        epipole=pair,
        offset=real,
        low=pair,
        high=pair,
        diagonals=np.zeros((0, 4)),
    )
    return PlacedTiles(
        number=number,
        planes=planes,
        tiles=Tiles(texel=matrix, nearest=real, size=size, pixel=pair),
        depths=pair,
        whole=np.zeros(0, bool),
        density=real,
        frustum=matrix,
    )


NOTHING_PLACED = _nothing_placed()
"""The placement of no tiles, as in most frames."""


def place_impostors(
    view: View, impostors: ImpostorObjects, number: Rows, layout: TileParams, limit: int
) -> PlacedTiles:
    """Find planes and tiles for those objects `number` that are in sight, cropped to the visible part of each.

    Parameters
    ----------
    view : the view of the picture, near and far plane fitted.
    impostors : the objects that impostors show.
    number : (n,) indices of those to place.
    layout : how tiles are laid out, and how long they are reused.
    limit : most texels along a side of a tile.

    Returns
    -------
    The k tiles, k ≤ n.
    """
    guard = MARGIN if layout.reuse_error else GUARD
    loops = kernels.loaded()
    if loops is not None and layout.tile_mapping == "screen":
        return _place_compiled(loops, view, impostors, number, layout.tile_scale, guard, limit)
    volumes = impostors.volumes.take(impostors.volume[impostors.at[number]])
    planes = choose_planes(impostors.viewer[number], volumes)
    planes, seen = crop_to_frustum(planes, view, impostors.objects.rotation[impostors.at[number]], guard)
    if not seen.visible.all():
        rows = np.flatnonzero(seen.visible)
        planes, seen, volumes, number = planes.take(rows), seen.take(rows), volumes.take(rows), number[rows]
    at = impostors.at[number]
    scale, rotation = impostors.objects.scale[at], impostors.objects.rotation[at]
    to_centre = impostors.bounds.centre[at] - view.position
    if layout.tile_mapping == "plane":
        planes, tiles = plane_tiles(planes, view.detail_pixels * layout.tile_scale, limit)
    else:
        nearest = to_centre @ view.axes[2] - impostors.bounds.bounding_radius[at]
        depth = np.maximum(nearest, view.depth_range[0]) / scale
        tiles = screen_tiles(planes, seen, view, depth, layout.tile_scale / view.scale, limit)
    return PlacedTiles(
        number=number,
        planes=planes,
        tiles=tiles,
        depths=depths_behind(planes, volumes),
        whole=seen.whole,
        density=view.detail_pixels * scale / np.linalg.norm(to_centre, axis=1),
        frustum=frustum_rows(view, rotation),
    )


def _place_compiled(
    loops: ModuleType, view: View, impostors: ImpostorObjects, number: Rows, texels: float, guard: float, limit: int
) -> PlacedTiles:
    """Place impostors by compiled `loops`, for tiles whose texels are pixels. texels: per pixel."""
    volumes, bounds, objects = impostors.volumes, impostors.bounds, impostors.objects
    kept, face, frame, bound, diagonals, texel, nearest, size, pixel, depths, whole, density, frustum = loops.place(
        number=number,
        at=impostors.at,
        viewer=impostors.viewer,
        volume=impostors.volume,
        radius=volumes.radius,
        bottom=volumes.bottom,
        top=volumes.top,
        hull=volumes.hull,
        has_side=volumes.has_side,
        rotation=objects.rotation,
        centre=bounds.centre,
        bounding_radius=bounds.bounding_radius,
        scale=objects.scale,
        position=view.position,
        axes=view.axes,
        tangent=np.array(view.half_extent),
        size=np.array(view.size, float),
        near=view.depth_range[0],
        guard=guard,
        kept_guard=MARGIN / GUARD,
        texels=texels / view.scale,
        detail_pixels=view.detail_pixels,
        limit=limit,
    )
    return PlacedTiles(
        number=kept,
        planes=Planes(
            face=face,
            right=frame[:, 0],
            up=frame[:, 1],
            normal=frame[:, 2],
            distance=frame[:, 4, 0],
            epipole=frame[:, 3, :2],
            offset=frame[:, 4, 1],
            low=bound[:, 0],
            high=bound[:, 1],
            diagonals=diagonals,
        ),
        tiles=Tiles(texel=texel, nearest=nearest, size=size, pixel=pixel),
        depths=depths,
        whole=whole,
        density=density,
        frustum=frustum,
    )
