"""Connect the samples of one face to triangles, at every step; `grid_lods` joins the faces.

Vertices are numbered in blocks, so that those of neighbouring triangles are near each other in memory. The last vertex
of a triangle determines which image it looks into.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid, square_texel
from depthwalk.bake.grid import layer_triangles, triangle_places, whole_cells
from depthwalk.bake.images import BOX_FACES, BakedObject, BoundaryStrip, DepthImage, Face, face_outward
from depthwalk.bake.meso import straight_share
from depthwalk.cook.lod_geometry import BORDER, EASE, EASE_SHIFT, EDGE, FACE_SHIFT, PAST_AXIS, POSITION_STEPS
from depthwalk.cook.rtin import Surface, rtin_triangles
from depthwalk.geometry.vectors import lengths
from depthwalk.types import Ints, Mask

_BLOCK = 8  # cells; indices run block by block, so that a vertex is shaded about 1.3 times instead of twice
_EASE_TEXELS = 6  # over which a face's own meso-structure fades in from where another face's samples take over


class Run(IntEnum):
    """Order the triangles in an index list by the faces that sample them best.

    Triangles on the side image that another face samples better are kept separate, so that they can be drawn only where
    that face is not.
    """

    BOX_FACES = 0  # their own
    TOP = 1  # the top cap's own
    SIDE_OF_TOP = 2  # on the side image, but better on the top cap
    SIDE_OF_BOX_FACES = 3
    SIDE = 4
    SIDE_OF_BOTTOM = 5
    BOTTOM = 6


_DRAWN = Run.BOX_FACES, Run.TOP, Run.SIDE, Run.BOTTOM  # except for the paper's cases
_RUN_OF_OWNER = {  # of a triangle on the side image
    Face.SIDE: Run.SIDE, Face.TOP: Run.SIDE_OF_TOP, Face.BOTTOM: Run.SIDE_OF_BOTTOM
} | dict.fromkeys(BOX_FACES, Run.SIDE_OF_BOX_FACES)  # fmt: skip
_OWN_RUN = {Face.TOP: Run.TOP, Face.BOTTOM: Run.BOTTOM} | dict.fromkeys(BOX_FACES, Run.BOX_FACES)


@dataclass(frozen=True)
class FaceGrids:
    """Hold the triangles of all grids of one face, and their vertices.

    Attributes
    ----------
    vertices
        (v, 4) uint16, encoded position and image of each vertex, as in `LodGeometry.vertices`.
    texels
        (v, 2) int16, column and row of the sample of each vertex; −1 where it is not a sample.
    runs
        Triangles (t, 3) uint32, rows of `vertices`, by level and Run.
    """

    vertices: NDArray[np.uint16]
    texels: NDArray[np.int16]
    runs: dict[tuple[int, Run], NDArray[np.uint32]]


def build_face_grids(baked: BakedObject, face: Face, tolerance: float, paper_cases: bool) -> FaceGrids:
    """Build the triangles of all grids of one face.

    Parameters
    ----------
    baked
        The object.
    face
        One of the object's faces that has images.
    tolerance
        How far samples may be off the triangles of step s, in units of s texels; −inf keeps every cell.
    paper_cases
        Whether to keep triangles that only the paper's cases draw.

    Returns
    -------
    FaceGrids
        Vertices, and the triangles of each level and run.
    """
    images = [image for image in baked.images if image.face is face]
    present = {image.face for image in baked.images}
    shape = images[0].depth.shape
    borders = {border.level: border for border in baked.boundary_strips if border.face is face}
    # Meso-structure needs every vertex, however smooth the surface below is.
    metres = tolerance * square_texel(baked) if baked.meso is None else -np.inf
    grid = FaceGrid.of(baked.cylinder, images[0])
    surfaces = _surfaces(grid, images)
    points, numbers = _face_points(baked, grid, images, surfaces, borders)
    total_points = len(points.depth)
    used = np.zeros(2 * total_points, bool)  # every point may be used a second time, marked as EDGE
    triangles = []
    for level in range(baked.steps):
        corners, run, edge = _face_triangles(images, surfaces, level, borders.get(level), metres * 2**level, present)
        drawn = np.isin(run, list(Run) if paper_cases else _DRAWN)
        corners, run, edge = corners[drawn], run[drawn], edge[drawn]
        corners = np.where(corners < numbers.samples, corners, corners + numbers.border_shift[level])
        corners = _outward(corners, points.depth, baked.cylinder.radius, face)
        corners[edge, 2] += total_points
        triangles.append((corners, run))
        used[corners] = True
    kept = _blockwise(used.nonzero()[0], total_points, shape)
    number = np.zeros(used.size, np.uint32)
    number[kept] = np.arange(len(kept), dtype=np.uint32)
    return FaceGrids(
        vertices=_pack(points, kept, *baked.cylinder.box),
        texels=_texels(kept % total_points, numbers.samples, shape),
        runs={
            (level, kind): number[corners[run == kind]]
            for level, (corners, run) in enumerate(triangles)
            for kind in Run
        },
    )


@dataclass(frozen=True)
class _Points:
    """Hold all points of one face: samples, then vertices of boundary strips level by level.

    position: (n, 3), metres; depth: (n,), metres; image: (n,), number with flags.
    """

    position: NDArray[np.float32]
    depth: NDArray[np.float32]
    image: Ints


@dataclass(frozen=True)
class _Numbers:
    """Hold the numbering of points: those below `samples` are samples.

    Other corners of a triangle are shifted by the `border_shift` of its level.
    """

    samples: int
    border_shift: list[int]


def _face_points(
    baked: BakedObject,
    grid: FaceGrid,
    images: list[DepthImage],
    surfaces: list[Surface],
    borders: dict[int, BoundaryStrip],
) -> tuple[_Points, _Numbers]:
    """Return all points of one face, and their numbering in triangles; borders: by level."""
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


def _ease(image: DepthImage, point: NDArray[np.float32]) -> Ints:
    """Return how much of the meso-structure applies to samples (H, W) of a cap or a box face: 0 to EASE.

    That is their `straight_share`, reduced near places where the surface leaves the image or another face owns it,
    since that face's images do not have this relief. point: (n, 3) of the samples, metres.
    """
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
    return np.asarray(np.round(EASE * near * share), np.int64)


def _surfaces(grid: FaceGrid, images: list[DepthImage]) -> list[Surface]:
    """Return the samples of each layer; their labels distinguish owners, and the two sides of the axis."""
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
) -> tuple[Ints, Ints, Mask]:
    """Return the surface triangles of step 2^level of one face, including its boundary strip.

    Only the side keeps what another face owns, for the paper's cases. tolerance: metres; present: the faces that have
    images.

    Returns
    -------
    tuple
        Corners (n, 3), numbered as in `BoundaryStrip.triangles`; the Run (n,) of each triangle; and whether (n,) texels
        beside it show another surface.
    """
    height, width = images[0].depth.shape
    samples = len(images) * height * width
    plain: list[Ints] = []
    edges: list[Ints] = []
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
    # Triangles of boundary strips need no mark: their vertices identify them.
    plain += [] if border is None else [border.triangles.astype(np.int64)]
    corners = np.concatenate(plain + edges)
    edge = np.arange(len(corners)) >= sum(map(len, plain))
    face = images[0].face
    owner = np.stack([image.owner for image in images]).ravel()
    # The first corner is always a sample, and boundary vertices go with it. A triangle belongs to another face only if
    # all its corners do, so that neighbours overlap where owners meet.
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
    """Return the planar Face (n,), of those present, that triangles (n, 3, 3) face most squarely."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    planar = sorted(present - {Face.SIDE})
    outward = np.stack([face_outward(face) for face in planar])
    return np.asarray(np.array(planar)[np.argmax(across @ outward.T, axis=1)])


def _outward(corners: Ints, depth: NDArray[np.float32], radius: float, face: Face) -> Ints:
    """Return corners (n, 3), reordered so that fronts are counter-clockwise.

    The last, provoking corner is a vertex of a boundary strip if the triangle has one. depth: of points, metres.
    """
    if face is Face.SIDE:  # past the axis θ runs the other way, which reverses the winding
        past = depth[corners].mean(-1) > radius
        corners[past] = corners[past][:, [1, 0, 2]]
    # Boundary vertices have the highest numbers: turn the triangle until its highest comes last.
    shift = (corners.argmax(1) + 1) % 3
    return np.take_along_axis(corners, (np.arange(3) + shift[:, None]) % 3, axis=1)


def _blockwise(points: Ints, count: int, shape: tuple[int, ...]) -> Ints:
    """Return points (n,) block by block of the image of `shape`; points from `count` on are marked as EDGE."""
    row, column = np.divmod(points % count % (shape[0] * shape[1]), shape[1])
    return points[np.lexsort((column // _BLOCK, row // _BLOCK))]


def _texels(points: Ints, samples: int, shape: tuple[int, ...]) -> NDArray[np.int16]:
    """Return column and row (n, 2) of points (n,), −1 where they are not samples."""
    row, column = np.divmod(points % (shape[0] * shape[1]), shape[1])
    return np.where((points < samples)[:, None], np.stack([column, row], -1), -1).astype(np.int16)


def _pack(points: _Points, kept: Ints, low: NDArray[np.float32], size: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Return the vertices (n, 4), as in `LodGeometry`, of the points `kept` (n,); low, size: the box, metres."""
    edge, point = np.divmod(kept, len(points.depth))
    out = np.empty((len(kept), 4), np.uint16)
    out[:, :3] = np.round(np.clip((points.position[point] - low) / size, 0, 1) * POSITION_STEPS)
    out[:, 3] = points.image[point] + EDGE * edge
    return out
