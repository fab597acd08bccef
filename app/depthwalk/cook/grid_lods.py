"""Grids of steps 1, 2, 4 … of depth images: one vertex per texel in use, one index list per step and face.

Nothing that is empty or cut is in a list, so it costs nothing.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid, square_texel
from depthwalk.bake.grid import layer_triangles, triangle_places, whole_cells
from depthwalk.bake.images import BOX_FACES, BakedObject, BoundaryStrip, DepthImage, Face, face_outward
from depthwalk.bake.meso import straight_share
from depthwalk.cook.cases import (
    BOTTOM_PIECE,
    PAPER_FLANKS,
    PAPER_SIDE,
    PIECES,
    RANGES,
    SIDE_OF_BOTTOM,
    SIDE_OF_FLANKS,
    SIDE_OF_TOP,
    TOP_PIECE,
    piece_horizons,
    piece_numbers,
)
from depthwalk.cook.index_chunks import WHOLE
from depthwalk.cook.lod_geometry import (
    BORDER,
    EASE,
    EASE_SHIFT,
    EDGE,
    FACE_SHIFT,
    PAST_AXIS,
    POSITION_STEPS,
    LodGeometry,
    vertex_positions,
)
from depthwalk.cook.rtin import Surface, rtin_triangles
from depthwalk.geometry.vectors import lengths

# How far samples may come off the triangles of step s: this part of s texels, hence of about one pixel.
_TOLERANCE = 0.07
# Texels: about how far samples between those of step 2 are off its triangles; step s has s − 1 times that.
_STEP_ERROR = 0.25
_BLOCK = 8  # cells; indices run block by block, so that a vertex is shaded about 1.3 times instead of twice
_EASE_TEXELS = 6  # over which a face's own meso-structure grows from nothing, where another's samples take over


class Run(IntEnum):
    """The order of triangles in an index list. What another face samples better is kept apart, so that it is drawn only
    where that face is not."""

    BOX_FACES = 0  # their own
    TOP = 1  # the top cap's own
    SIDE_OF_TOP = 2  # on the side image, but better on the top cap
    SIDE_OF_FLANKS = 3
    SIDE = 4
    SIDE_OF_BOTTOM = 5
    BOTTOM = 6


_DRAWN = Run.BOX_FACES, Run.TOP, Run.SIDE, Run.BOTTOM  # unless for the paper's cases
_PAPER_RANGES = np.array(  # of `cook.cases`, by Run
    [PAPER_FLANKS, TOP_PIECE, SIDE_OF_TOP, SIDE_OF_FLANKS, PAPER_SIDE, SIDE_OF_BOTTOM, BOTTOM_PIECE]
)
_RUN_OF_OWNER = {  # of a triangle on the side image
    Face.SIDE: Run.SIDE, Face.TOP: Run.SIDE_OF_TOP, Face.BOTTOM: Run.SIDE_OF_BOTTOM
} | dict.fromkeys(BOX_FACES, Run.SIDE_OF_FLANKS)  # fmt: skip
_OWN_RUN = {Face.TOP: Run.TOP, Face.BOTTOM: Run.BOTTOM} | dict.fromkeys(BOX_FACES, Run.BOX_FACES)


def build_grid_lods(
    baked: BakedObject, paper_cases: bool = False, tolerance: float = _TOLERANCE, in_pieces: bool = True
) -> LodGeometry:
    """The arrays of all images and steps of `baked`.

    paper_cases: in index ranges for these, with what only they draw; tolerance: how far samples may come off the
    triangles of step s, in parts of s texels; −inf keeps every cell; in_pieces: sorted into the
    pieces of `cook.cases`, unless for the paper's cases; else all triangles are in the first, in the order of their
    faces.
    """
    low, size = baked.cylinder.box
    present = {image.face for image in baked.images}
    vertices: list[NDArray[np.uint16]] = []
    texels: list[NDArray[np.int16]] = []
    runs: dict[tuple[int, Run], list[NDArray[np.uint32]]] = {}
    total = 0
    for face in Face:
        images = [image for image in baked.images if image.face is face]
        if not images:
            continue
        borders = {border.level: border for border in baked.borders if border.face is face}
        # Meso-structure needs every vertex, however smooth the surface below it is.
        metres = tolerance * square_texel(baked) if baked.meso is None else -np.inf
        grid = FaceGrid.of(baked.cylinder, images[0])
        surfaces = _surfaces(grid, images)
        triangles = [
            _face_triangles(images, surfaces, level, borders.get(level), metres * 2**level, present)
            for level in range(baked.steps)
        ]
        points, numbers = _face_points(baked, grid, images, surfaces, borders)
        total_points = len(points.depth)
        used = np.zeros(2 * total_points, bool)  # every point may be there a second time, marked as EDGE
        for level, (corners, run, edge) in enumerate(triangles):
            drawn = np.isin(run, list(Run) if paper_cases else _DRAWN)
            corners, run, edge = corners[drawn], run[drawn], edge[drawn]
            corners = np.where(corners < numbers.samples, corners, corners + numbers.border_shift[level])
            corners = _outward(corners, points.depth, baked.cylinder.radius, face)
            corners[edge, 2] += total_points
            triangles[level] = corners, run, edge
            used[corners] = True
        kept = _blockwise(used.nonzero()[0], total_points, images[0].depth.shape)
        number = np.zeros(used.size, np.uint32)
        number[kept] = total + np.arange(len(kept), dtype=np.uint32)
        total += len(kept)
        vertices.append(_pack(points, kept, low, size))
        texels.append(_texels(kept % total_points, numbers.samples, images[0].depth.shape))
        for level, (corners, run, _) in enumerate(triangles):
            for kind in Run:
                runs.setdefault((level, kind), []).append(number[corners[run == kind]].ravel())
    every = np.concatenate(vertices)
    position = vertex_positions(every, low, size)
    levels = [
        _in_pieces([np.concatenate(runs[level, kind]).reshape(-1, 3) for kind in Run], position, paper_cases, in_pieces)
        for level in range(baked.steps)
    ]
    indices, counts, horizons = (list(column) for column in zip(*levels, strict=True))
    count = np.array(counts)
    first = (np.cumsum(count) - count.ravel()).reshape(count.shape)
    horizon = np.array(horizons)
    if baked.meso is not None or present == {Face.TOP}:
        horizon[:] = -np.inf  # relief turns triangles; a planar image is one cap
    error = _STEP_ERROR * square_texel(baked) * (2.0 ** np.arange(baked.steps) - 1)
    joined = np.concatenate(indices)
    return LodGeometry(
        vertices=every,
        texels=np.concatenate(texels),
        indices=joined,
        chunks=WHOLE,
        first=first,
        count=count,
        horizon=horizon,
        box_low=low,
        box_size=size,
        error=error,
    )


def _in_pieces(
    runs: list[NDArray[np.uint32]], position: NDArray[np.float64], paper_cases: bool, in_pieces: bool
) -> tuple[NDArray[np.uint32], NDArray[np.int64], NDArray[np.float64]]:
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


@dataclass(frozen=True)
class _Points:
    """All points of one face: samples, then border vertices level by level. position (n, 3); depth (n,);
    image (n,) with its flags."""

    position: NDArray[np.float32]
    depth: NDArray[np.float32]
    image: NDArray[np.int64]


@dataclass(frozen=True)
class _Numbers:
    """Points below `samples` are samples; other corners of a triangle are shifted by `border_shift` of its level."""

    samples: int
    border_shift: list[int]


def _face_points(
    baked: BakedObject,
    grid: FaceGrid,
    images: list[DepthImage],
    surfaces: list[Surface],
    borders: dict[int, BoundaryStrip],
) -> tuple[_Points, _Numbers]:
    samples = sum(image.depth.size for image in images)
    face_number = grid.face << FACE_SHIFT
    position = [surface.point for surface in surfaces]
    depth = [image.depth.ravel() for image in images]
    image_number = [
        face_number + image.layer + BORDER * (image.owner.ravel() != image.face).astype(np.int64) for image in images
    ]
    if baked.meso is not None and grid.face is not Face.SIDE:
        for number, image, surface in zip(image_number, images, surfaces, strict=True):
            number += _ease(image, surface.point).ravel() << EASE_SHIFT
    shifts, total = [], 0
    for level in range(1 + max(borders, default=-1)):
        shifts.append(total)
        border = borders.get(level)
        if border is None:
            continue
        points, depths = grid.border_points(images, border)
        position.append(points)
        depth.append(depths)
        image_number.append(face_number + border.start // images[0].depth.size + BORDER)
        total += len(depths)
    flat = np.concatenate(depth)
    past = (grid.face is Face.SIDE) & (flat > grid.cylinder.radius)
    every = _Points(np.concatenate(position), flat, np.concatenate(image_number) + PAST_AXIS * past)
    return every, _Numbers(samples, shifts + [0] * images[0].depth.size.bit_length())


def _ease(image: DepthImage, point: NDArray[np.float32]) -> NDArray[np.int64]:
    """0 to EASE (H, W): the `straight_share` of the samples of a cap or a flank, less near where the surface leaves the
    image, or another face owns it, whose images do not have that relief."""
    from scipy.ndimage import distance_transform_edt

    height, width = image.depth.shape
    both = 1 | 1 << 7
    whole = np.zeros((height, width), bool)
    whole[:-1, :-1] = (image.cells[0] & both == both).reshape(height - 1, width - 1)
    inside = np.pad(whole & np.isfinite(image.depth) & (image.owner == image.face), 1)
    distance = distance_transform_edt(inside)[1:-1, 1:-1]
    near = np.clip((distance - 1) / _EASE_TEXELS, 0, 1)
    away = np.where(np.isfinite(image.depth)[..., None], point.reshape(height, width, 3), 0) * [1, 0, 1]
    from_axis = away / np.maximum(lengths(away), 1e-6)[..., None]
    share = straight_share(image.normal, face_outward(image.face), from_axis)
    return np.round(EASE * near * share).astype(np.int64)


def _surfaces(grid: FaceGrid, images: list[DepthImage]) -> list[Surface]:
    """Points and normals of each layer; the label tells owners, and sides of the axis, apart."""
    surfaces = []
    for image in images:
        past = (grid.face is Face.SIDE) & (image.depth > grid.cylinder.radius)
        label = image.owner + np.uint8(len(Face)) * past
        points = grid.points(image.depth).reshape(-1, 3)
        surfaces.append(Surface(points, image.normal.reshape(-1, 3), label.ravel()))
    return surfaces


def _face_triangles(
    images: list[DepthImage],
    surfaces: list[Surface],
    level: int,
    border: BoundaryStrip | None,
    tolerance: float,
    present: set[Face],
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
    """Corner numbers (n, 3) of the surface triangles of step 2^level, border included, the Run (n,) of each, and
    whether texels beside it (n,) show another surface.

    Numbers are those of `BoundaryStrip.triangles`; present: the faces that have images. Only the side keeps what another face
    owns, for the paper's cases.
    """
    height, width = images[0].depth.shape
    samples = len(images) * height * width
    plain: list[NDArray[np.int64]] = []
    edges: list[NDArray[np.int64]] = []
    elsewhere = []
    for image, surface in zip(images, surfaces, strict=True):
        coarse, replaced = rtin_triangles(image, surface, level, tolerance)
        plain.append(coarse + image.layer * height * width)
        whole = whole_cells(image, level)
        for without, kind in ((replaced | ~whole, plain), (replaced | whole, edges)):
            layers, texels = layer_triangles(image, level, without)
            kind.append(texels + layers * height * width)
        half, cell = triangle_places(image, level, replaced | whole)
        elsewhere.append(image.cells[level][cell] >> 14 + half & 1 > 0)
    # Border vertices tell by themselves what their triangles are.
    plain += [] if border is None else [border.triangles.astype(np.int64)]
    corners = np.concatenate(plain + edges)
    edge = np.arange(len(corners)) >= sum(map(len, plain))
    face = images[0].face
    owner = np.stack([image.owner for image in images]).ravel()
    # The first corner always is a sample; border vertices go with it. A triangle belongs to another face only with all
    # its corners, so that neighbours overlap where owners meet.
    owners = owner[np.where(corners < samples, corners, corners[:, :1])]
    shared = np.where((owners == owners[:, :1]).all(1), owners[:, 0], face)
    held = np.flatnonzero(edge)[np.concatenate(elsewhere)]
    if present - {Face.SIDE}:
        shared[held] = _held_by(np.concatenate([surface.point for surface in surfaces])[corners[held]], present)
    if face is Face.SIDE:
        run = np.array([_RUN_OF_OWNER[owner] for owner in Face])[shared]
    else:
        corners, edge = corners[shared == face], edge[shared == face]
        run = np.full(len(corners), _OWN_RUN[face])
    row, column = np.divmod(corners[:, 0] % (height * width), width)
    block = _BLOCK << level
    order = np.lexsort((column // block, row // block))
    return corners[order], run[order], edge[order]


def _held_by(corners: NDArray[np.float32], present: set[Face]) -> NDArray[np.intp]:
    """The planar Face (n,) of those present that triangles (n, 3, 3) face most squarely."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    planar = sorted(present - {Face.SIDE})
    return np.array(planar)[np.argmax(across @ np.stack([face_outward(face) for face in planar]).T, axis=1)]


def _outward(corners: NDArray[np.int64], depth: NDArray[np.float32], radius: float, face: Face) -> NDArray[np.int64]:
    """Corners (n, 3), turned so that fronts are counter-clockwise and the last, provoking corner is a border vertex
    where there is one."""
    if face is Face.SIDE:  # past the axis θ runs the other way: the winding turns round
        past = depth[corners].mean(-1) > radius
        corners[past] = corners[past][:, [1, 0, 2]]
    # Border vertices have the highest numbers: turn the triangle until its highest comes last.
    shift = (corners.argmax(1) + 1) % 3
    return np.take_along_axis(corners, (np.arange(3) + shift[:, None]) % 3, axis=1)


def _blockwise(points: NDArray[np.int64], count: int, shape: tuple[int, ...]) -> NDArray[np.int64]:
    row, column = np.divmod(points % count % (shape[0] * shape[1]), shape[1])
    return points[np.lexsort((column // _BLOCK, row // _BLOCK))]


def _texels(points: NDArray[np.int64], samples: int, shape: tuple[int, ...]) -> NDArray[np.int16]:
    row, column = np.divmod(points % (shape[0] * shape[1]), shape[1])
    return np.where((points < samples)[:, None], np.stack([column, row], -1), -1).astype(np.int16)


def _pack(
    points: _Points, kept: NDArray[np.int64], low: NDArray[np.float32], size: NDArray[np.float32]
) -> NDArray[np.uint16]:
    twice, point = np.divmod(kept, len(points.depth))
    out = np.empty((len(kept), 4), np.uint16)
    out[:, :3] = np.round(np.clip((points.position[point] - low) / size, 0, 1) * POSITION_STEPS)
    out[:, 3] = points.image[point] + EDGE * twice
    return out
