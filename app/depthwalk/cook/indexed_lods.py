"""Convert levels of triangles to vertex and index arrays: pieces, spatial order, shared vertices, chunks."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import RANGES, piece_horizons, piece_numbers
from depthwalk.cook.index_chunks import MOST_VERTICES
from depthwalk.cook.lod_geometry import POSITION_STEPS, LodGeometry, vertex_positions
from depthwalk.cook.view_selection import NOWHERE
from depthwalk.geometry.spatial_order import morton_codes
from depthwalk.geometry.triangles import row_ids
from depthwalk.parallel import Map, batches
from depthwalk.types import Array, Ints

_IMAGES = 1 << 16  # more than any image number with flags, which fits into 16 bits


@dataclass(frozen=True, kw_only=True)
class _Level:
    """Hold what one level adds to `LodGeometry`.

    vertices, indices: arrays of each of its chunks; count: (RANGES,) indices in each range; horizon: (PIECES, 4),
    metres.
    """

    vertices: list[NDArray[np.uint16]]
    indices: list[NDArray[np.uint16]]
    count: Ints
    horizon: Array


def index_levels(grid: LodGeometry, levels: list[Array], views: Ints, error: Array, parallel: Map = map) -> LodGeometry:
    """Convert levels of triangles to vertex and index arrays.

    Parameters
    ----------
    grid
        Other geometry of the same object, to whose box the encoded positions refer.
    levels
        (t, 3, 3) triangles of each level, metres, object frame; finest first.
    views
        (all t,) the image that each triangle of all levels looks into, as `select_views` returns it; triangles whose
        image is `NOWHERE` are dropped.
    error
        (levels,) geometric error of each level, metres.
    parallel
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    LodGeometry
        The levels, the finest first.
    """
    ends = np.cumsum([len(corners) for corners in levels])

    def indexed(level: tuple[Array, Ints]) -> _Level:
        return _indexed(grid, *level)

    parts = list(parallel(indexed, zip(levels, np.split(views, ends[:-1]), strict=True)))
    vertices = [chunk for part in parts for chunk in part.vertices]
    indices = [chunk for part in parts for chunk in part.indices]
    chunks = np.array([[0, 0], *([part.size, len(shared)] for part, shared in zip(indices, vertices, strict=True))])
    count = np.array([part.count for part in parts])
    return replace(
        grid,
        vertices=np.concatenate(vertices),
        texels=np.full((sum(map(len, vertices)), 2), -1, np.int16),
        indices=np.concatenate(indices),
        chunks=chunks[:-1].cumsum(0),
        first=(np.cumsum(count) - count.ravel()).reshape(count.shape),
        count=count,
        horizon=np.array([part.horizon for part in parts]),
        error=error,
    )


def _indexed(grid: LodGeometry, corners: Array, view: Ints) -> _Level:
    """Return the vertices and indices of one level; corners: (t, 3, 3), its triangles, metres; view: (t,)."""
    position = np.round(np.clip((corners - grid.box_low) / grid.box_size, 0, 1) * POSITION_STEPS).astype(np.uint16)
    placed = vertex_positions(position.reshape(-1, 3), grid.box_low, grid.box_size).reshape(-1, 3, 3)
    piece = piece_numbers(placed)
    # In spatial order, so that a vertex is shaded once for all its triangles.
    order = np.lexsort((morton_codes(corners.mean(1)), piece))
    order = order[view[order] != NOWHERE]
    vertices, indices = zip(*_chunks(position[order], view[order], MOST_VERTICES), strict=True)
    return _Level(
        vertices=list(vertices),
        indices=list(indices),
        count=3 * np.bincount(piece[order], minlength=RANGES),
        horizon=piece_horizons(placed[order], piece[order]),
    )


def _chunks(
    position: NDArray[np.uint16], view: Ints, size: int
) -> Iterator[tuple[NDArray[np.uint16], NDArray[np.uint16]]]:
    """Yield vertices (v, 4) and indices (i,) of each chunk of triangles.

    position: (t, 3, 3), as in `LodGeometry.vertices`; view: (t,), the images that they look into, with flags; size:
    most triangles of a chunk. Chunks that would have too many vertices are halved.
    """
    for batch in batches(len(position), size):
        vertices, numbers = _share_vertices(position[batch], view[batch])
        if len(vertices) <= MOST_VERTICES:
            yield vertices, numbers.ravel().astype(np.uint16)
        else:
            yield from _chunks(position[batch], view[batch], size // 2)


def _share_vertices(position: NDArray[np.uint16], view: Ints) -> tuple[NDArray[np.uint16], Ints]:
    """Return vertices (v, 4) in the order of their first use, and triangles (t, 3) of vertex numbers.

    A vertex carries the image of most of its triangles. Shaders take a triangle's image from its last, provoking
    vertex, so each triangle is rotated until that vertex has its image; if none has, the triangle gets an extra vertex.
    Parameters as in `_chunks`.
    """
    corner, first = row_ids((position.reshape(-1, 3) @ (1 << 32, 1 << 16, 1))[:, None])
    corner, points = corner.reshape(-1, 3), position.reshape(-1, 3)[first]
    pairs, uses = np.unique(corner * _IMAGES + view[:, None], return_counts=True)
    own = np.zeros(len(points), np.int64)
    rising = np.argsort(uses, kind="stable")
    own[pairs[rising] // _IMAGES] = pairs[rising] % _IMAGES  # the last one written stays
    last = (own[corner] == view[:, None]).argmax(1)  # 0 if no corner has it
    corner = np.take_along_axis(corner, (np.arange(3) + last[:, None] + 1) % 3, axis=1)
    corner_views = own[corner]
    corner_views[:, 2] = view
    number, first = row_ids((corner * _IMAGES + corner_views).reshape(-1, 1))
    by_use = np.argsort(first)
    vertices = np.column_stack([points[corner.ravel()[first]], corner_views.ravel()[first]])[by_use].astype(np.uint16)
    return vertices, np.argsort(by_use)[number.reshape(-1, 3)]
