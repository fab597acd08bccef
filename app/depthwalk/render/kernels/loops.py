"""Collect the compiled functions; importing this module compiles them, or reads them from the cache."""

from depthwalk.render.kernels.culling_loops import (
    boxes_about,
    cells_in_sight,
    hidden,
    meshlets,
    upright_cylinders,
    visible,
)
from depthwalk.render.kernels.detail_loops import describe, nearer_than, surfaces
from depthwalk.render.kernels.lamp_loops import boxes_in_sight, cluster_lists
from depthwalk.render.kernels.layout_loops import place
from depthwalk.render.kernels.prewarp_loops import prewarp
from depthwalk.render.kernels.reprojection_loops import errors
from depthwalk.render.kernels.silhouette_loops import silhouettes
from depthwalk.render.kernels.tile_loops import (
    allocate,
    areas,
    composite_records,
    kept_slots,
    released,
    tile_records,
    warp_records,
)

__all__ = [
    "allocate",
    "areas",
    "boxes_about",
    "boxes_in_sight",
    "cells_in_sight",
    "cluster_lists",
    "composite_records",
    "describe",
    "errors",
    "hidden",
    "kept_slots",
    "meshlets",
    "nearer_than",
    "place",
    "prewarp",
    "released",
    "silhouettes",
    "surfaces",
    "tile_records",
    "upright_cylinders",
    "visible",
    "warp_records",
]
