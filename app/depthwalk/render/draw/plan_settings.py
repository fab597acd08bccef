"""Gather the render settings that decide how a frame is planned."""

from collections.abc import Hashable
from dataclasses import dataclass

from depthwalk.scene.object_settings import LodParams, MeshLodParams, TileParams


@dataclass(frozen=True, kw_only=True)
class PlanSettings:
    """Hold the settings that a plan follows.

    Attributes
    ----------
    lod : how finely objects are drawn.
    layout : how impostor tiles are laid out, and how long they are reused.
    polygons : how coarse meshes may be.
    atlas_size : width and height of the tile atlas, texels.
    warp_limit : triangles that may be warped. Tiles beyond the limit that cannot wait are warped at a coarser level,
        and again later; None: no limit.
    tile_light : a key for the light that lit tiles were made with; tiles with another key are not reused. None where
        tiles are not lit.
    """

    lod: LodParams
    layout: TileParams
    polygons: MeshLodParams
    atlas_size: tuple[int, int]
    warp_limit: int | None = None
    tile_light: Hashable = None
