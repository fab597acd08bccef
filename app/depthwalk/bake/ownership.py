"""Find the owner of each piece of surface: the face that samples it best, which alone draws it.

A sample's footprint is the distance along the surface to its neighbouring sample: the spacing of the rays over the
cosine between ray and surface.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid, Projection
from depthwalk.bake.grid import layer_triangles, triangle_corners, triangle_places
from depthwalk.bake.images import BOX_FACES, DepthImage, Face
from depthwalk.geometry.vectors import lengths
from depthwalk.parallel import Map, batches
from depthwalk.types import Array, Mask

_GRAZING = 1e-3  # cosine below which a face counts as not seeing a surface
_CORNERS = 6  # triangles around a texel that is inside its surface, not at its boundary
# A box face takes over only if its footprint is smaller by this factor: each box face fragments a surface further.
_BOX_FACE_GAIN = 1.3
_OVERLAP_GAIN = 2.0  # a triangle with corners of two owners is left to the other if that is better by this factor
_BATCH = 1 << 15  # triangles at a time
_WALL = 0.5  # cosine between a triangle and the surface at its corners, below which it is not part of that surface


@dataclass(frozen=True, kw_only=True)
class FaceLayers:
    """Hold the layers that a face enters into the competition for a surface, and where they are well connected.

    Attributes
    ----------
    grid
        Rays and texels of the face.
    images
        The depth images of the face's layers, in order; at least one.
    inner
        (L, H, W) bool, True for texels that the face's finest grid surrounds with triangles on all sides.
    """

    grid: FaceGrid
    images: Sequence[DepthImage]
    inner: Mask


Rivals = Mapping[Face, FaceLayers]
"""The faces that compete for a surface, in the order in which they were sampled."""


def face_layers(grid: FaceGrid, images: Sequence[DepthImage]) -> FaceLayers:
    """Return the layers of one face, with the texels well inside a surface, where it may be an owner.

    Parameters
    ----------
    grid
        Rays and texels of the face.
    images
        The face's layers, in order; at least one.

    Returns
    -------
    FaceLayers
        The face, ready to be compared with others.
    """
    return FaceLayers(grid=grid, images=images, inner=inner_texels(images))


def assign_owners(rivals: Rivals, parallel_map: Map = map) -> list[NDArray[np.uint8]]:
    """Choose for each texel the face that samples its surface with the smallest footprint.

    Parameters
    ----------
    rivals
        The competing faces, each with its layers.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    list
        For each image of each of `rivals`, in order, the owners (H, W) uint8, values of `Face`.
    """

    def assign(task: tuple[FaceLayers, DepthImage]) -> NDArray[np.uint8]:
        layers, image = task
        owner = np.full(image.depth.shape, image.face, np.uint8)
        solid = np.isfinite(image.depth)
        point, normal = layers.grid.points(image.depth)[solid], image.normal[solid]
        winner = owner[solid]
        best = _handicap(image.face) * footprints(layers.grid, layers.grid.project(point), normal)
        for face, rival in rivals.items():
            if face is image.face:
                continue
            seen_from = rival.grid.project(point)
            size = footprints(rival.grid, seen_from, normal)
            better = np.flatnonzero(_handicap(face) * size < best)
            seen = better[_holds(rival, seen_from.take(better), normal.take(better, 0), size[better])]
            winner[seen], best[seen] = face, _handicap(face) * size[seen]
        owner[solid] = winner
        return owner

    return list(parallel_map(assign, [(layers, image) for layers in rivals.values() for image in layers.images]))


def worth_adding(rivals: Rivals, grid: FaceGrid, point: Array, normal: Array) -> Mask:
    """Return which points of a surface an additional face would own, because it samples them finest.

    Parameters
    ----------
    rivals
        The layers of the existing faces.
    grid
        Rays and texels of the additional face.
    point, normal
        (n, 3) points of the surface, metres, and its unit normals, object frame.

    Returns
    -------
    numpy.ndarray
        (n,) bool, True where the additional face would be the owner.
    """
    own = _handicap(grid.face) * footprints(grid, grid.project(point), normal)
    worth = np.isfinite(own)
    for face, rival in rivals.items():
        rows = np.flatnonzero(worth)
        seen_from, facing = rival.grid.project(point.take(rows, 0)), normal.take(rows, 0)
        size = footprints(rival.grid, seen_from, facing)
        as_good = np.flatnonzero(_handicap(face) * size <= own[rows])
        seen = _holds(rival, seen_from.take(as_good), facing.take(as_good, 0), size[as_good])
        worth[rows[as_good[seen]]] = False
    return worth


def yield_triangles(rivals: Rivals, parallel_map: Map = map) -> list[DepthImage]:
    """Mark the triangles that another face holds better, whoever owns their corners.

    A triangle across a gap between two samples, such as the tread of a step between two risers, lies on another surface
    than the samples, so their owners do not determine which face should draw it. And where the areas of two owners
    meet, triangles of both overlap, and the more slanted one is the worse approximation of the surface.

    Parameters
    ----------
    rivals
        The competing faces, each with its layers.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    list
        The images of all of `rivals`, in order, with bits 14 and 15 of their `cells` set.
    """
    return [image for face in rivals for image in _yield_face(rivals, face, parallel_map)]


def _yield_face(rivals: Rivals, face: Face, parallel_map: Map) -> list[DepthImage]:
    grid, layers = rivals[face].grid, rivals[face].images
    points = np.concatenate([grid.points(layer.depth).reshape(-1, 3) for layer in layers])
    normals = np.concatenate([layer.normal.reshape(-1, 3) for layer in layers])
    owner = np.concatenate([layer.owner.ravel() for layer in layers])

    def yielded(task: tuple[DepthImage, int, NDArray[np.intp], NDArray[np.intp]]) -> Mask:
        image, level, half, cell = task
        layer, texel = triangle_corners(image, level, half, cell)
        corner = (layer * image.depth.size + texel).T
        corners, owners = points.take(corner, 0), owner.take(corner)  # (3, triangles, …)
        across = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        across /= np.maximum(lengths(across), np.float32(1e-20))[:, None]
        wall = (np.einsum("cni,ni->cn", normals.take(corner, 0), across) < _WALL).any(0)
        mixed = (owners != face).any(0) & (owners == face).any(0)
        selected = np.flatnonzero(wall | mixed)
        gain = np.where(wall[selected], 1.0, _OVERLAP_GAIN)
        held = np.zeros(len(cell), bool)
        held[selected] = _held_better(rivals, face, corners.take(selected, 1).mean(0), across.take(selected, 0), gain)
        return held

    places = [(image, level, *triangle_places(image, level)) for image in layers for level in range(len(image.cells))]
    tasks = [
        (image, level, half[batch], cell[batch])
        for image, level, half, cell in places
        for batch in batches(len(cell), _BATCH)
    ]
    cells = [[codes.copy() for codes in image.cells] for image in layers]
    for (image, level, half, cell), held in zip(tasks, parallel_map(yielded, tasks), strict=True):
        np.bitwise_or.at(cells[image.layer][level], cell[held], (1 << 14 + half[held]).astype(np.uint16))
    return [replace(image, cells=tuple(codes)) for image, codes in zip(layers, cells, strict=True)]


def _held_better(rivals: Rivals, face: Face, point: Array, normal: Array, gain: Array) -> Mask:
    """Return which points (n, 3) with normals (n, 3) another face holds with a footprint smaller by `gain` (n,)."""
    grid = rivals[face].grid
    own = footprints(grid, grid.project(point), normal)
    held = np.zeros(len(point), bool)
    for other, rival in rivals.items():
        if other is face:
            continue
        rows = np.flatnonzero(~held)
        if not len(rows):
            break
        seen_from, facing = rival.grid.project(point.take(rows, 0)), normal.take(rows, 0)
        size = footprints(rival.grid, seen_from, facing)
        better = np.flatnonzero(np.isfinite(size) & (gain[rows] * size < own[rows]))
        if not len(better):
            continue
        held[rows[better]] = _holds(rival, seen_from.take(better), facing.take(better, 0), size[better])
    return held


def _handicap(face: Face) -> float:
    """Return the factor on a face's footprints in the competition: box faces must be better by it to win."""
    return _BOX_FACE_GAIN if face in BOX_FACES else 1.0


def footprints(grid: FaceGrid, seen_from: Projection, normal: Array) -> NDArray[np.float64]:
    """Measure how finely a face samples surface points.

    Parameters
    ----------
    grid
        Rays and texels of the face.
    seen_from
        n points, projected by `grid`.
    normal
        (n, 3) unit normals of the surface at those points, object frame.

    Returns
    -------
    numpy.ndarray
        Footprints (n,), metres: the distance along the surface to the neighbouring sample; +inf where the face sees the
        surface from behind or edge-on.
    """
    width, height = grid.texel_size
    spacing = np.full(len(seen_from.u), grid.longest_texel)
    if grid.face is Face.SIDE:
        point = seen_from.point
        spacing = np.maximum(height, width * np.hypot(point[:, 0], point[:, 2]) / grid.cylinder.radius)
    cosine = -np.einsum("ni,ni->n", seen_from.direction, normal)
    return np.where(cosine > _GRAZING, spacing / np.maximum(cosine, _GRAZING), np.inf)


def _holds(rival: FaceLayers, seen_from: Projection, normal: Array, footprint: Array) -> Mask:
    """Return which of n points are held by one of the rival's layers, well inside a connected piece of surface.

    seen_from: the points projected by its grid; normal: (n, 3); footprint: (n,) metres, in that grid.
    """
    row, column = rival.grid.texel_at(seen_from.u, seen_from.v)
    texel = row * rival.grid.width + column
    depth = seen_from.depth
    seen = np.zeros(len(texel), bool)
    for image, inner in zip(rival.images, rival.inner, strict=True):
        with np.errstate(invalid="ignore"):
            same = np.abs(image.depth.take(texel) - depth) < 1.5 * footprint
        selected = np.flatnonzero(same & inner.take(texel))
        normals = image.normal.reshape(-1, 3).take(texel[selected], 0)
        seen[selected] |= np.einsum("ni,ni->n", normals, normal.take(selected, 0)) > 0.5
    return seen


def inner_texels(layers: Sequence[DepthImage]) -> Mask:
    """Return which texels are surrounded on all sides by triangles of a face's finest grid.

    Parameters
    ----------
    layers
        All layers of the face, L images of (H, W) texels.

    Returns
    -------
    numpy.ndarray
        (L, H, W) bool, True for such texels.
    """
    size = layers[0].depth.size
    count = np.zeros(len(layers) * size, np.int64)
    for anchor in layers:
        layer, texel = layer_triangles(anchor, 0)
        count += np.bincount((layer * size + texel).ravel(), minlength=len(count))
    return (count >= _CORNERS).reshape(len(layers), *layers[0].depth.shape)
