"""Baked objects made ready for the GPU: their grids and pages, which take seconds to build; see `cooked_file`."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject, DepthImage, Face
from depthwalk.cook.cases import PIECES
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.simplified_lods import build_simplified_lods
from depthwalk.cook.virtual_texture import VirtualTexture, build_virtual_texture
from depthwalk.geometry.support_function import footprint

# Part of the names of cached files: raise it with every change of what `cook_object` yields. A test compares the code that
# cooks with what it was when the number was given.
COOK_VERSION = 2

# Texels of images for whose grids surfaces by error take longer to build than a visitor of the garden should wait, and
# spare few triangles. Grids of more than `_DENSE` triangles per texel are those of foliage, all borders: surfaces have
# a quarter of that, and leaves where grids of step 2 and 4 have lost them.
_SMALL = 128
_DENSE = 10


class CookOptions(NamedTuple):
    """What is built of an object. stepped: its levels are grids of step 1, 2, 4 …, not surfaces by error; paper_cases:
    they serve the paper's cases, too, which needs half as much again."""

    stepped: bool = False
    paper_cases: bool = False


@dataclass(frozen=True)
class CookedObject:
    """outline: the object, its images of the right size but without pixels; footprint: (DIRECTIONS,), see
    `geometry.support_function`; first, count, horizon, error: see `LodGeometry`; bytes: it takes on the GPU; load: its grids
    and pages. Raises OSError where the file that holds them has gone or is damaged."""

    outline: BakedObject
    footprint: NDArray[np.floating]
    first: NDArray[np.int64]
    count: NDArray[np.int64]
    horizon: NDArray[np.float64]
    error: NDArray[np.floating]
    bytes: int
    load: Callable[[], tuple[LodGeometry, VirtualTexture]]


def cook_object(baked: BakedObject, form: CookOptions) -> CookedObject:
    """Builds the grids and pages of `baked`."""
    grids = _build(baked, form)
    pages = build_virtual_texture(baked, grids)
    size = grids.vertices.nbytes + grids.indices.nbytes + pages.table.nbytes + pages.bytes_with_mip_maps
    around = footprint(grids.positions) + (0 if baked.meso is None else baked.meso.height)
    return CookedObject(_outline(baked), around, *_columns(grids), size, lambda: (grids, pages))


def _columns(grids: LodGeometry) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    return grids.first, grids.count, grids.horizon, grids.error


def _build(baked: BakedObject, form: CookOptions) -> LodGeometry:
    height, width = baked.images[0].depth.shape
    if form.stepped or max(height, width) <= _SMALL:
        grids = build_grid_lods(baked, form.paper_cases)
        if form.stepped or grids.count[0, :PIECES].sum() <= 3 * _DENSE * height * width:
            return grids
    return build_simplified_lods(baked)


def _outline(baked: BakedObject) -> BakedObject:
    return replace(baked, images=tuple(map(_bare, baked.images)), borders=())


def _bare(image: DepthImage) -> DepthImage:
    return bare_image(image.face, image.layer, image.depth.shape)


def bare_image(face: Face, layer: int, shape: tuple[int, ...]) -> DepthImage:
    """An image of `shape` that takes no memory."""
    empty = np.broadcast_to(np.float32(np.inf), shape)
    none = np.broadcast_to(np.float32(0), (*shape, 4))
    return DepthImage(
        face=face,
        layer=layer,
        depth=empty,
        normal=none[..., :3],
        albedo=none,
        cells=(),
        owner=np.broadcast_to(np.uint8(face), shape),
    )
