"""Check the arrays of a cooked object from a file before shaders read them and follow any row number in them.

A GPU that reads beyond its buffers may end the program, or reveal other programs' memory.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import PIECES, RANGES
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.used_texels import SUB_TILE
from depthwalk.cook.virtual_texture import VirtualTexture

_Shape = tuple[int | None, ...]
_LARGEST_SIDE = 1 << 15  # texels: shifts in the table have 16 bits


def check_geometry(geometry: LodGeometry) -> None:
    """Raise ValueError if arrays of `geometry` are inconsistent or hold numbers out of range."""
    count, levels = len(np.atleast_1d(geometry.vertices)), len(np.atleast_1d(geometry.first))
    _fits("vertices", geometry.vertices, (None, 4), np.uint16)
    _fits("texels", geometry.texels, (count, 2), np.int16)
    _fits("indices", geometry.indices, (None,), np.uint16, np.uint32)
    _fits("chunks", geometry.chunks, (None, 2), np.int64)
    _fits("first", geometry.first, (levels, RANGES), np.int64)
    _fits("count", geometry.count, (levels, RANGES), np.int64)
    _fits("horizon", geometry.horizon, (levels, PIECES, 4), np.float64)
    _fits("error", geometry.error, (levels,), np.float32, np.float64)
    _fits("box_low", geometry.box_low, (3,), np.float32)
    _fits("box_size", geometry.box_size, (3,), np.float32)
    length = len(geometry.indices)
    _holds("levels", levels > 0)
    _holds("first or count", _within(geometry.first, length) and _within(geometry.count, length))
    _holds("first or count", (geometry.first + geometry.count <= length).all())
    _holds("horizon", not np.isnan(geometry.horizon).any())
    _holds("error", np.isfinite(geometry.error).all() and (np.diff(geometry.error, prepend=0) >= 0).all())
    _holds("box", np.isfinite(geometry.box_low).all() and np.isfinite(geometry.box_size).all())
    _check_chunks(geometry, count)


def check_texture(texture: VirtualTexture) -> None:
    """Raise ValueError if arrays of `texture` are inconsistent or hold numbers out of range."""
    _fits("normals", texture.normals, (None, None, 4), np.uint8)
    height, width = texture.normals.shape[:2]
    _holds("normals", 0 < max(height, width) <= _LARGEST_SIDE and not (height % SUB_TILE or width % SUB_TILE))
    _fits("colours", texture.colours, (height, width, None), np.uint8, np.int8)
    _fits("tints", texture.tints, (None, None, None), np.uint8)
    _fits("palette", texture.palette, (4, 4), np.float32)
    _holds("tints", texture.tints.shape[0] <= height and texture.tints.shape[1] <= width)
    _holds("palette", np.isfinite(texture.palette).all())
    _fits("table", texture.table, (None, None, None, 2), np.int16)
    tiers, rows = texture.first_rows, texture.table.shape[1]
    _holds("first_rows", isinstance(tiers, list) and all(isinstance(row, int) and 0 <= row <= rows for row in tiers))
    _holds("last_mip_tier", isinstance(texture.last_mip_tier, int) and 0 <= texture.last_mip_tier < len(tiers))
    _holds("colour_level", isinstance(texture.colour_level, int) and texture.colour_level >= 0)
    if texture.has_coordinates:
        _fits("coordinates", texture.coordinates, (height, width, 2), np.uint16)
        _fits("texture", texture.texture, (None, None, 3), np.uint8)
        _holds("texture", texture.texture.size > 0)


def _check_chunks(geometry: LodGeometry, vertices: int) -> None:
    first, base = geometry.chunks.T
    length = len(geometry.indices)
    _holds("chunks", len(first) > 0 and first[0] == 0 and _within(first, length) and (np.diff(first) >= 0).all())
    _holds("chunks", _within(base, vertices))
    filled = np.flatnonzero(np.diff(first, append=length))  # an empty run has no highest index
    highest = np.maximum.reduceat(geometry.indices, first[filled]) if len(filled) else np.zeros(0, np.uint16)
    _holds("indices", (base[filled] + highest < vertices).all())


def _within(values: NDArray[np.integer], most: int) -> bool:
    return bool(((values >= 0) & (values <= most)).all())


def _fits(name: str, values: Any, shape: _Shape, *types: type[np.generic]) -> None:
    same = values.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, values.shape, strict=True))
    if not same or values.dtype not in types:
        raise ValueError(f"{name} are {values.dtype} of {values.shape}")


def _holds(name: str, truth: bool | np.bool_) -> None:
    if not truth:
        raise ValueError(f"{name} out of range")
