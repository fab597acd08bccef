"""Gather the compiled functions; whoever imports this compiles them, or reads them from the cache."""

from typing import Any

import numba

from depthwalk.render.kernels import folder

_config: Any = numba.config
_default, _config.CACHE_DIR = _config.CACHE_DIR, str(folder())
try:
    from depthwalk.render.kernels.culling_loops import cells_in_sight, hidden, upright_cylinders, visible
    from depthwalk.render.kernels.detail_loops import close, levels, pieces, viewers
    from depthwalk.render.kernels.layout_loops import place, plane_distances
    from depthwalk.render.kernels.reprojection_loops import errors
    from depthwalk.render.kernels.silhouette_loops import silhouettes
    from depthwalk.render.kernels.tile_loops import allocate, composite_records, tile_records, warp_records
finally:
    _config.CACHE_DIR = _default  # of others in this process

__all__ = [
    "allocate",
    "cells_in_sight",
    "close",
    "composite_records",
    "errors",
    "hidden",
    "levels",
    "pieces",
    "place",
    "plane_distances",
    "silhouettes",
    "tile_records",
    "upright_cylinders",
    "viewers",
    "visible",
    "warp_records",
]
