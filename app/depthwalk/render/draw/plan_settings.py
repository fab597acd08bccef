"""Gather from the render settings those that decide how a frame is planned."""

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
    warp_limit : how many triangles may be warped. What cannot wait is warped coarser beyond that, and again later;
        None: everything is warped as finely as it should be.
    remembers : whether an object that was drawn as its mesh stays so for as long as depth images are not clearly
        quicker. If not, no earlier frame has a part in the choice.
    tile_light : what lit colours in tiles depend on besides what is planned here; None where tiles are not lit. Tiles
        of frames with other light are not reused.
    """

    lod: LodParams
    layout: TileParams
    polygons: MeshLodParams
    atlas_size: tuple[int, int]
    warp_limit: int | None = None
    remembers: bool = True
    tile_light: Hashable = None
