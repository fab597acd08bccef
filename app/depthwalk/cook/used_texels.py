"""Find the texels of its depth images that an object looks up; only these are stored in its virtual texture.

An image is divided into sub-tiles of 4 × 4 texels. A sub-tile is used if a triangle that looks into the image falls on
it. Most texels of most images are unused: they are empty, or another image shows the surface better.
"""

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import BakedObject, Face
from depthwalk.cook.lod_geometry import FACE_SHIFT, PAST_AXIS, LodGeometry
from depthwalk.parallel import Map, batches
from depthwalk.types import Array, Ints, Mask

SUB_TILE = 4  # texels
TILE = 2 * SUB_TILE  # texels; each tile has an entry in the virtual texture's table
_SLACK = 0.25  # texels around a triangle: pixels' surface points may lie beside it; 3 changed no picture of an ogre
_BATCH = 1 << 15  # triangles at a time: with fewer, threads wait for each other more than for memory
_FACE_BITS = 7 << FACE_SHIFT | PAST_AXIS  # of an image's number with flags: what determines the place of a lookup
_HALVINGS = 5  # most halvings of triangles' sides: one that winds about the axis never fits into a few sub-tiles


def used_sub_tiles(baked: BakedObject, grids: LodGeometry, levels: list[int], parallel: Map = map) -> list[Mask]:
    """Return the sub-tiles of an object's images that are touched by triangles that look into the images.

    Parameters
    ----------
    baked, grids
        The object, and the triangles of its levels of detail.
    levels
        Ascending numbers; the number k requests a mask of what the triangles of the k finest levels touch.
    parallel
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    list
        For each of `levels` a mask (images, rows, columns) bool of sub-tiles, True where one is touched. There are
        two rows and two columns for each of the image's tiles.
    """
    rows, columns = (2 * size for size in tile_counts(baked.images[0].depth.shape))
    counts = np.zeros((len(baked.images), rows + 1, 3 * columns + 1), np.int32)
    vertices = _project_vertices(baked, grids, parallel)
    covered, done = [], 0
    for ends in [int((grids.first + grids.count)[:count].max()) for count in levels]:
        corners = grids.triangles(done, ends - done)

        def boxes(batch: slice, corners: Ints = corners) -> list[tuple[Ints, Ints, Ints]]:
            return list(_boxes(baked, vertices, corners[batch]))

        found = chain.from_iterable(parallel(boxes, batches(len(corners), _BATCH)))
        _count(counts, *map(np.concatenate, zip(*found, strict=True)))
        sums = counts.cumsum(1).cumsum(2)[:, :-1, :-1] > 0
        covered.append(np.any(sums.reshape(len(sums), rows, 3, columns), axis=2))
        done = ends
    return covered


def tile_counts(shape: tuple[int, ...]) -> tuple[int, int]:
    """Return the numbers of rows and columns of tiles of an image of `shape`, (H, W) texels."""
    return -(-shape[0] // TILE), -(-shape[1] // TILE)


@dataclass(frozen=True, kw_only=True)
class _Vertices:
    """Hold the V vertices of all levels, and their positions on the faces of their own images.

    code: (V,) image with flags; point: (V, 3), metres; texel: (V, 2), column and row, texels.
    """

    code: Ints
    point: Array
    texel: Array

    def looked_up(self, baked: BakedObject, corners: Ints) -> Array:
        """Return column and row (t, 3, 2), texels, at the corners (t, 3) of triangles, in the triangles' images.

        Nearly all of a triangle's vertices carry its image; the others are projected again.
        """
        texel = self.texel.take(corners, 0)
        faces = (self.code & _FACE_BITS).take(corners)
        triangle, corner = (faces != faces[:, 2:]).nonzero()
        texel[triangle, corner] = _texels_at(baked, faces[triangle, 2], self.point.take(corners[triangle, corner], 0))
        return texel


def _project_vertices(baked: BakedObject, grids: LodGeometry, parallel: Map) -> _Vertices:
    """Return the vertices of `grids`, each projected once for all of its triangles."""
    code, point = grids.vertices[:, 3].astype(np.int64), grids.positions

    def texels(batch: slice) -> Array:
        return _texels_at(baked, code[batch], point[batch])

    found = parallel(texels, batches(len(point), _BATCH))
    return _Vertices(code=code, point=point, texel=np.concatenate(list(found)))


def _boxes(baked: BakedObject, vertices: _Vertices, corners: Ints) -> Iterator[tuple[Ints, Ints, Ints]]:
    """Yield boxes of at most 2 × 2 sub-tiles around all parts of triangles.

    Larger triangles are halved until their parts fit. Across the seam of the side, column numbers continue.

    Parameters
    ----------
    baked
        The object.
    vertices
        Its vertices.
    corners
        (t, 3) the triangles, rows of `vertices`; the last corner determines which image they look into.

    Yields
    ------
    tuple
        Number of the image (n,), lowest and highest column and row (n, 2) of sub-tiles.
    """
    code, texel = vertices.code.take(corners[:, 2]), vertices.looked_up(baked, corners)
    large = yield from _small_boxes(baked, code, texel, _HALVINGS > 0)
    code, points = np.repeat(code[large], 4), _quarters(vertices.point.take(corners[large], 0))
    for halving in range(1, _HALVINGS + 1):
        texel = _texels_at(baked, np.repeat(code, 3), points.reshape(-1, 3)).reshape(-1, 3, 2)
        large = yield from _small_boxes(baked, code, texel, halving < _HALVINGS)
        code, points = np.repeat(code[large], 4), _quarters(points[large])


def _small_boxes(
    baked: BakedObject, code: Ints, texel: Array, may_be_halved: bool
) -> Generator[tuple[Ints, Ints, Ints], None, Mask]:
    """Yield the boxes of triangles that fit into 2 × 2 sub-tiles; return which (t,) are larger and `may_be_halved`.

    code: (t,) the image that each triangle looks into, with flags; texel: (t, 3, 2) column and row at its corners,
    changed in place where the triangle crosses the seam.
    """
    face, width = code >> FACE_SHIFT & 7, baked.images[0].depth.shape[1]
    # If some corners are at one end of the image and some at the other, the former are moved a turn further.
    u = np.ascontiguousarray(texel[..., 0].T)
    across = (face == Face.SIDE) & (u.max(0) - u.min(0) > width / 2)
    texel[..., 0] += width * (across & (u < width / 2)).T
    a, b, c = texel.swapaxes(0, 1)  # `min` along so short an axis takes several times as long
    lowest, highest = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    low = np.floor((lowest - _SLACK) / SUB_TILE).astype(np.int64)
    high = np.floor((highest + _SLACK) / SUB_TILE).astype(np.int64)
    large = ((high[:, 0] - low[:, 0] > 1) | (high[:, 1] - low[:, 1] > 1)) & may_be_halved
    small = np.flatnonzero(~large)
    first = np.searchsorted([image.face for image in baked.images], face.take(small))
    yield first + (code.take(small) & 7), low.take(small, 0), high.take(small, 0)
    return np.asarray(large)


def _quarters(points: Array) -> Array:
    """Return the four triangles (4t, 3, 3) made by halving the sides of each triangle (t, 3, 3)."""
    a, b, c = points.swapaxes(0, 1)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    return np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], 1).reshape(-1, 3, 3)


def _count(counts: NDArray[np.int32], image: Ints, low: Ints, high: Ints) -> None:
    """Add boxes to a table of differences, whose cumulative sums count the boxes that hold each sub-tile.

    counts: (images, rows + 1, 3 · columns + 1), columns beginning a turn before the image; image: (n,); low, high:
    (n, 2) columns and rows of the boxes.
    """
    columns = counts.shape[2] // 3
    left, right = (end.clip(-columns, 2 * columns) + columns for end in (low[:, 0], high[:, 0] + 1))
    below, above = (end.clip(0, counts.shape[1] - 1) for end in (low[:, 1], high[:, 1] + 1))
    for row, column, step in ((below, left, 1), (below, right, -1), (above, left, -1), (above, right, 1)):
        place = (image * counts.shape[1] + row) * counts.shape[2] + column
        counts += step * np.bincount(place, minlength=counts.size).reshape(counts.shape)


def _texels_at(baked: BakedObject, code: Ints, point: Array) -> Array:
    """Return where points look up their colours: column and row (n, 2), texels.

    code: (n,) the images that they look into, with flags; point: (n, 3), metres.
    """
    height, width = baked.images[0].depth.shape
    face, past = code >> FACE_SHIFT & 7, code & PAST_AXIS > 0
    texel = np.empty((len(point), 2))
    for looked_into in Face:
        chosen = np.flatnonzero(face == looked_into)
        if not len(chosen):
            continue
        there = point.take(chosen, 0)
        if looked_into is Face.SIDE:  # half a turn
            there[past.take(chosen)] *= (-1, 1, -1)
        grid = FaceGrid(cylinder=baked.cylinder, face=looked_into, height=height, width=width)
        u, v = grid.position_of(there)
        texel[chosen] = np.stack([u * width, v * height], -1)
    return texel
