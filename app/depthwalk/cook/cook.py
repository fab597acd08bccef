"""Cook baked objects: turn their depth images into the arrays that the GPU reads.

A baked object consists of depth images; a GPU draws triangles and looks up textures. Cooking converts one to the other,
once per asset, in seconds; `cooked_file` stores the result. Its steps, in the order of `cook_object`:

1. *Depth images → geometry levels.* `grid_lods` connects neighbouring samples to triangles, face by face
   (`face_grids`), at steps of 1, 2, 4 … texels, fewer where the surface is smooth (`rtin`). For larger images, and for
   foliage, `simplified_lods` takes the finest of these grids and simplifies it as one surface: by `vertex_clustering`,
   `hole_filling` and `edge_collapse` (`quadrics`), with its `sharp_features` restored. Finished levels are dilated if
   they are of foliage (`foliage_dilation`); of others, slits are closed (`slit_closing`).
2. *View selection.* Each simplified triangle is assigned the depth image that shows it best (`view_selection`);
   triangles of grids stay with the image that they are made from.
3. *Pieces.* The triangles of a level are sorted by the directions from which they can be seen (`cases`), and written
   as vertex and index arrays (`lod_geometry`, `indexed_lods`, `index_chunks`).
4. *Virtual texture.* The texels that those triangles look up (`used_texels`), except the finest of surfaces that can
   hardly be seen (`interior_visibility`), are encoded (`texel_encoding`) and packed into one small texture
   (`virtual_texture`, `mask_packing`), in mip tiers, with as few colour components as possible (`colour_pca`).
5. *Cooked object.* What drawing needs before the arrays are loaded is stored beside them: an outline, bounds, errors.
"""

from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject, DepthImage, Face
from depthwalk.cook.cases import PIECES
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.virtual_texture import VirtualTexture, build_mip_tiers, build_virtual_texture
from depthwalk.geometry.bounding_hull import bounding_hull
from depthwalk.parallel import Map, begin, thread_map
from depthwalk.types import Array, Ints

# Part of the names of cached files: raise it with every change of the output of `cook_object`. A test compares the
# cooking code with its state when the number was last set.
COOK_VERSION = 12

# Up to this many texels across, simplifying an image takes longer than a visitor of the garden should have to wait, and
# saves few triangles.
GRID_TEXELS = 128
# Grids with more triangles per texel show foliage and consist almost wholly of boundary strips. Simplified, they have a
# quarter of that, and keep leaves that grids of step 2 and 4 lose.
_FOLIAGE_DENSITY = 10


class CookOptions(NamedTuple):
    """Select what is built for an object.

    Attributes
    ----------
    stepped
        Whether to build levels as grids of step 1, 2, 4 … (the paper's level of detail), whatever the object's size.
    paper_cases
        Whether to add what only the paper's three cases draw (see `cook.cases`): half as many triangles again.
    """

    stepped: bool = False
    paper_cases: bool = False

    @property
    def needs_coarse_grids(self) -> bool:
        """Return whether grids of all steps are drawn even of images larger than `GRID_TEXELS`."""
        return self.stepped or self.paper_cases


@dataclass(frozen=True, kw_only=True)
class CookedObject:
    """Hold a cooked object: what drawing needs at once, and how to load the rest.

    Attributes
    ----------
    outline
        The baked object without pixels: its images have only their sizes.
    hull
        (CORNERS, 3) metres, object frame: corners of a polytope that encloses the object, see `geometry.bounding_hull`.
    first, count
        (levels, RANGES), first index and number of indices of each piece and further range, see `LodGeometry`.
    horizon
        (levels, PIECES, 4) metres, the viewpoints from which each piece may be seen, see `piece_horizons`.
    error
        (levels,) metres, geometric error of each level, the finest first.
    bytes
        Bytes of GPU memory that the object takes.
    load
        Returns geometry and texture. Raises OSError if the file that holds them is missing or damaged.
    """

    outline: BakedObject
    hull: Array
    first: Ints
    count: Ints
    horizon: NDArray[np.float64]
    error: Array
    bytes: int
    load: Callable[[], tuple[LodGeometry, VirtualTexture]]


MOST_PREFETCHED = 128e6  # bytes of geometry and textures that are read in advance


class HeldArrays:
    """Load geometry and texture of an object in advance; used in place of `CookedObject.load`.

    The first call hands over what was loaded and forgets it; later calls load again.
    """

    def __init__(self, load: Callable[[], tuple[LodGeometry, VirtualTexture]]) -> None:
        """Call `load`, the `CookedObject.load` to replace, at once. Raises what `load` does: OSError or InputError."""
        self._load = load
        self._arrays: tuple[LodGeometry, VirtualTexture] | None = load()

    @property
    def is_held(self) -> bool:
        """Return whether the loaded arrays are still in memory, so that the next call returns at once."""
        return self._arrays is not None

    def drop(self) -> None:
        """Free the loaded arrays if they have not been handed over yet."""
        self._arrays = None

    def __call__(self) -> tuple[LodGeometry, VirtualTexture]:
        """Return geometry and texture of the object, loaded again if they are no longer in memory."""
        arrays, self._arrays = self._arrays, None
        return self._load() if arrays is None else arrays


class PrefetchedArrays:
    """Load geometry and texture of an object in advance in a thread; used in place of `CookedObject.load`.

    The first call returns what the thread loaded, or raises its exception. If the thread has not started on it yet, and
    in later calls, the caller loads.
    """

    def __init__(self, load: Callable[[], tuple[LodGeometry, VirtualTexture]], threads: Executor) -> None:
        """Submit `load` to one of `threads`."""
        self._load = load
        self._ahead: Future[tuple[LodGeometry, VirtualTexture]] | None = threads.submit(load)

    def __call__(self) -> tuple[LodGeometry, VirtualTexture]:
        """Return geometry and texture."""
        ahead, self._ahead = self._ahead, None
        return self._load() if ahead is None or ahead.cancel() else ahead.result()


class Prefetcher:
    """Load the arrays of objects in a thread, in the order in which they are found: a first picture needs most."""

    def __init__(self, threads: Executor, most: float = MOST_PREFETCHED) -> None:
        """Read with `threads`, at most `most` bytes in all."""
        self._threads, self._left = threads, most

    def read(self, objects: tuple[CookedObject, ...]) -> tuple[CookedObject, ...]:
        """Return `objects`, whose arrays are being read unless the limit is exceeded."""
        self._left -= sum(cooked.bytes for cooked in objects)
        if self._left < 0:
            return objects
        return tuple(replace(cooked, load=PrefetchedArrays(cooked.load, self._threads)) for cooked in objects)


def cook_object(baked: BakedObject, options: CookOptions) -> CookedObject:
    """Turn a baked object into the arrays that the GPU draws.

    Parameters
    ----------
    baked
        The depth images, object frame.
    options
        What to build.

    Returns
    -------
    CookedObject
        The object, with geometry and texture in memory.
    """
    with thread_map() as parallel:
        mip_tiers = begin(lambda: build_mip_tiers(baked), parallel)  # where one step of geometry waits for another
        geometry = _build_geometry(baked, options, parallel)
        texture = build_virtual_texture(baked, geometry, parallel, mip_tiers())
    relief = 0.0 if baked.meso is None else baked.meso.height
    return CookedObject(
        outline=replace(baked, images=tuple(map(_bare, baked.images)), boundary_strips=()),
        hull=bounding_hull(geometry.positions, relief),
        first=geometry.first,
        count=geometry.count,
        horizon=geometry.horizon,
        error=geometry.error,
        bytes=geometry.vertices.nbytes + geometry.indices.nbytes + texture.table.nbytes + texture.bytes_with_mip_maps,
        load=lambda: (geometry, texture),
    )


def _build_geometry(baked: BakedObject, options: CookOptions, parallel: Map) -> LodGeometry:
    """Return grids if they are asked for, or if images are small and not of foliage; otherwise simplified levels."""
    from depthwalk.cook.grid_lods import build_grid_lods  # here, since drawing already cooked objects needs neither
    from depthwalk.cook.simplified_lods import build_simplified_lods

    height, width = baked.images[0].depth.shape
    if options.stepped or max(height, width) <= GRID_TEXELS:
        grids = build_grid_lods(baked, options.paper_cases, parallel=parallel)
        if options.stepped or grids.count[0, :PIECES].sum() <= 3 * _FOLIAGE_DENSITY * height * width:
            return grids
    return build_simplified_lods(baked, parallel)


def _bare(image: DepthImage) -> DepthImage:
    return bare_image(image.face, image.layer, image.depth.shape)


def bare_image(face: Face, layer: int, shape: tuple[int, ...]) -> DepthImage:
    """Return an image without samples, of `shape` (H, W) texels, on layer `layer` of `face`; it takes no memory."""
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
