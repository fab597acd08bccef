"""Find the parts of an object's depth images that are hardly visible from outside: inside shells, far from openings."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid, square_texel
from depthwalk.bake.images import BakedObject, DepthImage
from depthwalk.bake.raycast import RayCaster
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.used_texels import TILE, tile_counts
from depthwalk.geometry.vectors import lengths
from depthwalk.ingest.mesh import Mesh, positions_only
from depthwalk.parallel import Map
from depthwalk.types import Array, Ints, Mask

_RAYS = 16  # from each texel: with those of its neighbours, up to 9216 decide about a tile
_FEWEST = 2048  # rays needed to decide
_LEVEL = 1  # level of detail whose triangles the rays may hit
_LEAST = 0.04  # cosine-weighted part of the directions above a surface from which it must be visible
_OPEN = 0.25  # part of a texel's rays: where as many escape, the tile's hidden surface lies beside a visible one


def hardly_seen(baked: BakedObject, grids: LodGeometry, parallel: Map = map) -> Mask:
    """Return which tiles of an object's images can be seen from outside in hardly any direction.

    Tiles of first layers never are: what a face sees is visible. Nor are tiles in or beside which some texels are
    plainly visible: in one layer a surface that is hidden, such as the underside of water, may continue beside another
    that is not, such as the bowl below it.

    Parameters
    ----------
    baked
        The object.
    grids
        The triangles of its levels of detail, which hide the inside.
    parallel
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    numpy.ndarray
        (images, rows, columns) bool, True for tiles of 8 × 8 texels that show only such surface.
    """
    caster = RayCaster(_mesh(grids), two_sided=True)
    return np.stack(list(parallel(lambda image: _hardly_seen(baked, caster, image), baked.images)))


def _mesh(grids: LodGeometry) -> Mesh:
    """Return the triangles of one level of `grids` as a mesh with positions only, object frame."""
    used, faces = np.unique(grids.drawn(min(_LEVEL, len(grids.error) - 1)), return_inverse=True)
    return positions_only(grids.positions[used], faces.reshape(-1, 3))


def _hardly_seen(baked: BakedObject, caster: RayCaster, image: DepthImage) -> NDArray[np.bool_]:
    """Return the tiles (rows, columns) of one image that are hardly visible."""
    from scipy.ndimage import maximum_filter, uniform_filter

    rows, columns = tile_counts(image.depth.shape)
    if image.layer == 0:
        return np.zeros((rows, columns), bool)
    row, column = np.isfinite(image.depth).nonzero()
    normal = np.repeat(image.normal[row, column], _RAYS, axis=0)
    points = FaceGrid.of(baked.cylinder, image).points(image.depth)[row, column]
    start = np.repeat(points, _RAYS, axis=0) + square_texel(baked) * normal
    random = np.random.default_rng(0).normal(size=normal.shape).astype(np.float32)
    # Almost cosine-weighted: a random part of length 1 could cancel the normal.
    escaped = caster.escapes(start, normal + 0.98 * random / lengths(random)[:, None])
    hits = escaped.reshape(-1, _RAYS).sum(1)
    free, cast = (
        9 * uniform_filter(counts, 3, mode="constant")
        for counts in (_sums(row // TILE, column // TILE, values, (rows, columns)) for values in (hits, _RAYS))
    )
    lit = hits >= _OPEN * _RAYS
    beside_lit = maximum_filter(_sums(row[lit] // TILE, column[lit] // TILE, 1, (rows, columns)) > 0, 3)
    return np.asarray((cast >= _FEWEST) & (free < _LEAST * cast) & ~beside_lit)


def _sums(row: Ints, column: Ints, values: Ints | int, shape: tuple[int, int]) -> Array:
    """Return the sums, of `shape`, of the `values` (n,) in each row and column (n,)."""
    weights = np.broadcast_to(np.float64(values), row.shape)
    sums = np.bincount(row * shape[1] + column, weights, shape[0] * shape[1])
    return np.asarray(sums, np.float64).reshape(shape)
