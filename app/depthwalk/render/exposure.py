"""What of depth images hardly anybody outside sees: inside a shell, but for what is near its openings."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid, square_texel
from depthwalk.bake.images import BakedObject, DepthImage
from depthwalk.bake.parallel import Map
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.vectors import lengths
from depthwalk.ingest.mesh import Mesh
from depthwalk.render.grids import Grids
from depthwalk.render.residency import BLOCK

_PROBES = 2, 6  # rows and columns of a block whose texels cast rays
_RAYS = 16  # of each of these four texels: with those of its neighbours, up to 576 tell about a block
_FEWEST = 128  # that can tell
_LEVEL = 1  # whose triangles they may meet
_LEAST = 0.02  # part of the directions above a surface, by the cosine, in which it can be seen


def hardly_seen(baked: BakedObject, grids: Grids, each: Map = map) -> NDArray[np.bool_]:
    """Blocks (images, rows, columns) of 8 × 8 texels of which less than `_LEAST` is to be seen from outside. Of first
    layers there are none: what a face sees is seen."""
    caster = RayCaster(_mesh(grids), two_sided=True)
    parts = each(lambda image: _hardly_seen(baked, caster, image), baked.images)
    return np.stack(list(parts))


def _mesh(grids: Grids) -> Mesh:
    corners = grids.drawn(min(_LEVEL, len(grids.error) - 1))
    used, faces = np.unique(corners, return_inverse=True)
    positions = grids.positions[used].astype(np.float32)
    none = np.zeros((0, 3), np.float32)
    return Mesh(positions, none, none.astype(np.uint8), none, faces.reshape(-1, 3).astype(np.int32), (), ())


def _hardly_seen(baked: BakedObject, caster: RayCaster, image: DepthImage) -> NDArray[np.bool_]:
    height, width = image.depth.shape
    rows, columns = -(-height // BLOCK), -(-width // BLOCK)
    if image.layer == 0:
        return np.zeros((rows, columns), bool)
    probed = np.isfinite(image.depth)
    for axis, size in enumerate((height, width)):
        probed &= np.expand_dims(np.isin(np.arange(size) % BLOCK, _PROBES), 1 - axis)
    row, column = probed.nonzero()
    normal = np.repeat(image.normal[row, column], _RAYS, axis=0)
    points = FaceGrid.of(baked.cylinder, image).points(image.depth)
    start = np.repeat(points[row, column], _RAYS, axis=0) + square_texel(baked) * normal
    random = np.random.default_rng(0).normal(size=normal.shape).astype(np.float32)
    # Nearly by the cosine: of length 1 the random part could cancel the normal.
    escaped = caster.escapes(start, normal + 0.98 * random / lengths(random)[:, None])
    block = np.repeat(row // BLOCK * columns + column // BLOCK, _RAYS)
    from scipy.ndimage import uniform_filter

    free, cast = (
        9 * uniform_filter(np.bincount(block, weights, rows * columns).reshape(rows, columns), 3, mode="constant")
        for weights in (escaped, np.ones(len(block)))
    )
    return np.asarray((cast >= _FEWEST) & (free < _LEAST * cast))
