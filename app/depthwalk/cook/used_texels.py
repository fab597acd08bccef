"""Find the texels of its depth images that an object looks up: only these are stored in its virtual texture.

An image is divided into sub-tiles of 4 × 4 texels. A sub-tile is used where a triangle that looks into the image falls
on it. Where a triangle is beside an edge, shaders look into the layers before and behind too; of these a sub-tile is
used if it holds samples at the triangle's depth. Most texels of most images are not: they are empty, or another image
shows the surface better.
"""

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from itertools import chain, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import BakedObject, Face
from depthwalk.cook.lod_geometry import EDGE, FACE_SHIFT, PAST_AXIS, LodGeometry
from depthwalk.cook.texel_encoding import SAME_SURFACE_BESIDE
from depthwalk.parallel import Map, batches
from depthwalk.types import Array, Ints, Mask

SUB_TILE = 4  # texels
TILE = 2 * SUB_TILE  # texels: has an entry of the virtual texture's table
_SLACK = 0.25  # texels around a triangle: surface points of pixels may lie beside it; 3 changed no picture of an ogre
_BATCH = 1 << 15  # triangles at a time: with fewer, threads wait for each other more than for memory
_FACE_BITS = 7 << FACE_SHIFT | PAST_AXIS  # of an image's number with flags: what decides where a point is looked up
_HALVINGS = 5  # of triangles' sides, at most: what winds about the axis never fits into a few sub-tiles of the side


def used_sub_tiles(baked: BakedObject, grids: LodGeometry, levels: list[int], parallel: Map = map) -> list[Mask]:
    """Return which sub-tiles of an object's images are touched by the triangles that look into the images.

    Parameters
    ----------
    baked, grids
        The object, and the triangles of its levels of detail.
    levels
        Ascending numbers; the number k asks for a mask of what the triangles of the k finest levels touch.
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
    depths = _depth_ranges(baked, (rows, columns))
    vertices = _project_vertices(baked, grids, parallel)
    covered, done = [], 0
    for ends in [int((grids.first + grids.count)[:count].max()) for count in levels]:
        corners = grids.triangles(done, ends - done)

        def boxes(batch: slice, corners: Ints = corners) -> list[tuple[Ints, Ints, Ints]]:
            return list(_boxes(baked, depths, vertices, corners[batch]))

        found = chain.from_iterable(parallel(boxes, batches(len(corners), _BATCH)))
        _count(counts, *map(np.concatenate, zip(*found, strict=True)))
        sums = counts.cumsum(1).cumsum(2)[:, :-1, :-1] > 0
        covered.append(np.any(sums.reshape(len(sums), rows, 3, columns), axis=2))
        done = ends
    return covered


def tile_counts(shape: tuple[int, ...]) -> tuple[int, int]:
    """Return the rows and columns of tiles that an image of `shape`, (H, W) texels, has."""
    return -(-shape[0] // TILE), -(-shape[1] // TILE)


@dataclass(frozen=True, kw_only=True)
class _Vertices:
    """Hold the V vertices of all levels, and where the faces of their own images show them.

    code: (V,) image with flags; point: (V, 3), metres; texel: (V, 3), column and row, texels, and depth, metres.
    """

    code: Ints
    point: Array
    texel: Array

    def looked_up(self, baked: BakedObject, corners: Ints) -> Array:
        """Return column, row and depth (t, 3, 3) at the corners (t, 3) of triangles, in the triangles' images.

        Nearly all of a triangle's vertices carry its image; the others are looked up anew.
        """
        texel = self.texel.take(corners, 0)
        faces = (self.code & _FACE_BITS).take(corners)
        triangle, corner = (faces != faces[:, 2:]).nonzero()
        texel[triangle, corner] = _texels_at(baked, faces[triangle, 2], self.point.take(corners[triangle, corner], 0))
        return texel


class _DepthRanges(NamedTuple):
    """Hold the depths of samples on and beside each sub-tile: (images, rows, columns), metres.

    Where there are none, least is +inf and most −inf.
    """

    least: NDArray[np.float32]
    most: NDArray[np.float32]

    def meet(self, baked: BakedObject, image: Ints, low: Ints, high: Ints, depth: Array) -> Mask:
        """Return which boxes (n,) of sub-tiles hold samples at about the depths that triangles have there.

        image: (n,), numbers; low, high: (n, 2), lowest and highest column and row; depth: (n, 2), least and most,
        metres.
        """
        rows, columns = self.least.shape[1:]
        least, most = np.full(len(image), np.inf), np.full(len(image), -np.inf)
        for right, up in product((0, 1), repeat=2):  # of what is not small enough no more than the corners
            column = (high if right else low)[:, 0] % columns
            row = (high if up else low)[:, 1].clip(0, rows - 1)
            least = np.minimum(least, self.least[image, row, column])
            most = np.maximum(most, self.most[image, row, column])
        slack = np.array([FaceGrid.of(baked.cylinder, other).longest_texel for other in baked.images])[image]
        slack *= SAME_SURFACE_BESIDE
        return np.asarray((least - slack <= depth[:, 1]) & (most + slack >= depth[:, 0]))


def _depth_ranges(baked: BakedObject, shape: tuple[int, int]) -> _DepthRanges:
    """Return the depths in each sub-tile of all images; shape: rows and columns of sub-tiles."""
    least: list[NDArray[np.float32]] = []
    most: list[NDArray[np.float32]] = []
    for image in baked.images:
        height, width = image.depth.shape
        beyond = (0, SUB_TILE * shape[0] - height), (0, SUB_TILE * shape[1] - width)
        for ranges, depth in (least, image.depth), (most, np.where(np.isinf(image.depth), np.inf, -image.depth)):
            around = np.pad(depth, 1, constant_values=np.inf)
            around = np.minimum.reduce([around[1:-1], around[:-2], around[2:]])
            around = np.minimum.reduce([around[:, 1:-1], around[:, :-2], around[:, 2:]])
            cells = np.pad(around, beyond, constant_values=np.inf).reshape(shape[0], SUB_TILE, shape[1], SUB_TILE)
            ranges.append(cells.min((1, 3)))
    return _DepthRanges(np.stack(least), -np.stack(most))


def _project_vertices(baked: BakedObject, grids: LodGeometry, parallel: Map) -> _Vertices:
    """Return the vertices of `grids`, each looked up once for all of its triangles."""
    code, point = grids.vertices[:, 3].astype(np.int64), grids.positions

    def texels(batch: slice) -> Array:
        return _texels_at(baked, code[batch], point[batch])

    found = parallel(texels, batches(len(point), _BATCH))
    return _Vertices(code=code, point=point, texel=np.concatenate(list(found)))


def _boxes(
    baked: BakedObject, depths: _DepthRanges, vertices: _Vertices, corners: Ints
) -> Iterator[tuple[Ints, Ints, Ints]]:
    """Yield boxes of at most 2 × 2 sub-tiles around all parts of triangles.

    Larger triangles are halved until their parts fit. Across the seam of the side, columns go on counting.

    Parameters
    ----------
    baked, depths
        The object, and the depths of its samples.
    vertices
        Its vertices.
    corners
        (t, 3) the triangles, rows of `vertices`; the last corner says which image they look into.

    Yields
    ------
    tuple
        Number of the image (n,), lowest and highest column and row (n, 2) of sub-tiles.
    """
    code, texel = vertices.code.take(corners[:, 2]), vertices.looked_up(baked, corners)
    large = yield from _small_boxes(baked, depths, code, texel, _HALVINGS > 0)
    code, points = np.repeat(code[large], 4), _quarters(vertices.point.take(corners[large], 0))
    for halving in range(1, _HALVINGS + 1):
        texel = _texels_at(baked, np.repeat(code, 3), points.reshape(-1, 3)).reshape(-1, 3, 3)
        large = yield from _small_boxes(baked, depths, code, texel, halving < _HALVINGS)
        code, points = np.repeat(code[large], 4), _quarters(points[large])


def _small_boxes(
    baked: BakedObject, depths: _DepthRanges, code: Ints, texel: Array, may_be_halved: bool
) -> Generator[tuple[Ints, Ints, Ints], None, Mask]:
    """Yield the boxes of triangles that fit into 2 × 2 sub-tiles; return which (t,) are larger and `may_be_halved`.

    Those beside an edge are yielded for the layers before and behind too, where these may show their surface.

    code: (t,) the image that each triangle looks into, with flags; texel: (t, 3, 3) column, row and depth at its
    corners, which are changed where it lies across the seam.
    """
    face, width = code >> FACE_SHIFT & 7, baked.images[0].depth.shape[1]
    # Some corners are at one end of the image, some at the other: those go a turn further.
    u = np.ascontiguousarray(texel[..., 0].T)
    across = (face == Face.SIDE) & (u.max(0) - u.min(0) > width / 2)
    texel[..., 0] += width * (across & (u < width / 2)).T
    a, b, c = texel.swapaxes(0, 1)  # `min` along so short an axis takes several times as long
    lowest, highest = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    low = np.floor((lowest[:, :2] - _SLACK) / SUB_TILE).astype(np.int64)
    high = np.floor((highest[:, :2] + _SLACK) / SUB_TILE).astype(np.int64)
    large = ((high[:, 0] - low[:, 0] > 1) | (high[:, 1] - low[:, 1] > 1)) & may_be_halved
    small = np.flatnonzero(~large)
    faces = np.array([image.face for image in baked.images])
    number = np.searchsorted(faces, face.take(small)) + (code.take(small) & 7)
    yield number, low.take(small, 0), high.take(small, 0)
    beside = np.flatnonzero(code.take(small) & EDGE)
    edge, number = small.take(beside), number.take(beside)
    depth = np.stack([lowest[edge, 2], highest[edge, 2]], -1)
    for step in -1, 1:
        other = (number + step).clip(0, len(faces) - 1)
        there = np.flatnonzero((other != number) & (faces[other] == face.take(edge)))
        box = other.take(there), low.take(edge.take(there), 0), high.take(edge.take(there), 0)
        meets = depths.meet(baked, *box, depth.take(there, 0))
        yield box[0][meets], box[1][meets], box[2][meets]
    return np.asarray(large)


def _quarters(points: Array) -> Array:
    """Return the four triangles (4t, 3, 3) that halving its sides makes of each triangle (t, 3, 3)."""
    a, b, c = points.swapaxes(0, 1)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    return np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], 1).reshape(-1, 3, 3)


def _count(counts: NDArray[np.int32], image: Ints, low: Ints, high: Ints) -> None:
    """Add boxes to a table of differences, whose cumulative sums are how many boxes hold each sub-tile.

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
    """Return where points find their colours (n, 3): column and row, texels, and their depth in the image, metres.

    code: (n,) the images that they look into, with flags; point: (n, 3), metres.
    """
    height, width = baked.images[0].depth.shape
    face, past = code >> FACE_SHIFT & 7, code & PAST_AXIS > 0
    texel = np.empty((len(point), 3))
    for looked_into in Face:
        chosen = np.flatnonzero(face == looked_into)
        if not len(chosen):
            continue
        there = point.take(chosen, 0)
        if looked_into is Face.SIDE:  # half a turn
            there[past.take(chosen)] *= (-1, 1, -1)
        grid = FaceGrid(cylinder=baked.cylinder, face=looked_into, height=height, width=width)
        u, v = grid.position_of(there)
        if looked_into is Face.SIDE:
            radial = np.hypot(there[:, 0], there[:, 2])
            depth = baked.cylinder.radius - np.where(past.take(chosen), -radial, radial)
        else:
            origin, inward = grid.rays_at(u, v)
            depth = np.einsum("ij,ij->i", there - origin, inward)
        texel[chosen] = np.stack([u * width, v * height, depth], -1)
    return texel
