"""Build levels of detail as grids of steps 1, 2, 4 … of depth images, as Liu et al. 2007 draw them.

Neighbouring samples are connected to triangles unless the surface is cut between them. There is one vertex per texel in
use, and one index list per level. Empty or cut cells are in no list and so cost nothing.
"""

from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import square_texel
from depthwalk.bake.images import BakedObject, Face
from depthwalk.cook.cases import (
    BOTTOM_PIECE,
    PAPER_BOX_FACES,
    PAPER_SIDE,
    PIECES,
    RANGES,
    SIDE_OF_BOTTOM,
    SIDE_OF_BOX_FACES,
    SIDE_OF_TOP,
    TOP_PIECE,
    piece_horizons,
    piece_numbers,
)
from depthwalk.cook.face_grids import FaceGrids, Run, build_face_grids
from depthwalk.cook.index_chunks import WHOLE
from depthwalk.cook.lod_geometry import LodGeometry, vertex_positions
from depthwalk.parallel import Map
from depthwalk.types import Ints

# How far samples may be off the triangles of step s, in units of s texels, which are about one pixel.
_TOLERANCE = 0.07
# Texels: about how far samples between those of step 2 are off its triangles; for step s, multiply by s − 1.
_STEP_ERROR = 0.25
_PAPER_RANGES = np.array(  # of `cook.cases`, by Run
    [PAPER_BOX_FACES, TOP_PIECE, SIDE_OF_TOP, SIDE_OF_BOX_FACES, PAPER_SIDE, SIDE_OF_BOTTOM, BOTTOM_PIECE]
)


def build_grid_lods(
    baked: BakedObject,
    paper_cases: bool = False,
    tolerance: float = _TOLERANCE,
    in_pieces: bool = True,
    parallel: Map = map,
) -> LodGeometry:
    """Build the levels of an object as the grids of all its images.

    Parameters
    ----------
    baked
        The object; it has `baked.steps` grids per image.
    paper_cases
        Whether to sort triangles into the index ranges of the paper's cases, including those that only these draw.
    tolerance
        How far samples may be off the triangles of step s, in units of s texels; −inf keeps every cell.
    in_pieces
        Whether to sort triangles into the pieces of `cook.cases`, if `paper_cases` is False. Otherwise all are in the
        first piece, in the order of their faces.
    parallel
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    LodGeometry
        One level per grid, the finest first.
    """
    low, size = baked.cylinder.box

    def face_grids(face: Face) -> FaceGrids:
        return build_face_grids(baked, face, tolerance, paper_cases)

    faces = list(parallel(face_grids, sorted({image.face for image in baked.images})))
    before = [0, *accumulate(len(grids.vertices) for grids in faces)]  # for each face: vertices of those before it
    vertices = np.concatenate([grids.vertices for grids in faces])
    position = vertex_positions(vertices, low, size)
    levels = [
        _in_pieces(
            [
                np.concatenate(
                    [grids.runs[level, run] + np.uint32(start) for grids, start in zip(faces, before, strict=False)]
                )
                for run in Run
            ],
            position,
            paper_cases,
            in_pieces,
        )
        for level in range(baked.steps)
    ]
    indices, counts, horizons = (list(column) for column in zip(*levels, strict=True))
    count = np.array(counts)
    horizon = np.array(horizons)
    if baked.meso is not None or all(image.face is Face.TOP for image in baked.images):
        horizon[:] = -np.inf  # relief turns triangles; a planar image is one cap
    return LodGeometry(
        vertices=vertices,
        texels=np.concatenate([grids.texels for grids in faces]),
        indices=np.concatenate(indices),
        chunks=WHOLE,
        first=(np.cumsum(count) - count.ravel()).reshape(count.shape),
        count=count,
        horizon=horizon,
        box_low=low,
        box_size=size,
        error=_STEP_ERROR * square_texel(baked) * (2.0 ** np.arange(baked.steps) - 1),
    )


def _in_pieces(
    runs: list[NDArray[np.uint32]], position: NDArray[np.float64], paper_cases: bool, in_pieces: bool
) -> tuple[NDArray[np.uint32], Ints, NDArray[np.float64]]:
    """Return one level's indices (i,), range after range, the length (RANGES,) of each, and its `LodGeometry.horizon`.

    runs: triangles (t, 3) of each Run; position: (V, 3) of the vertices; paper_cases, in_pieces: see `build_grid_lods`.
    """
    triangles = np.concatenate(runs)
    horizon = np.full((PIECES, 4), -np.inf)
    if paper_cases:
        piece = np.repeat(_PAPER_RANGES, [len(run) for run in runs])
    elif in_pieces:
        corners = position[triangles]
        piece = piece_numbers(corners)
        horizon = piece_horizons(corners, piece)
    else:
        piece = np.zeros(len(triangles), np.int64)
    order = np.argsort(piece, kind="stable")
    return triangles[order].ravel(), 3 * np.bincount(piece, minlength=RANGES), horizon
