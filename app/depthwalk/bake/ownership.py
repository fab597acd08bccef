"""Which face samples a piece of surface best, so that it is drawn once, by that one, where several faces are drawn.

A sample's footprint is the distance on the surface to its neighbour sample: the spacing of the rays there over the
cosine between ray and surface.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.grid import layer_triangles, triangle_corners, triangle_places
from depthwalk.bake.images import (
    FLANKS,
    Cylinder,
    DepthImage,
    Face,
    image_points,
    image_position,
    surface_rays,
    texel_size,
)
from depthwalk.bake.parallel import Map, batches
from depthwalk.bake.vectors import lengths
from depthwalk.types import Array

Inner = dict[Face, NDArray[np.bool_]]  # `inner_texels` of each face that has images
_GRAZING = 1e-3  # cosine below which a face is taken to see nothing
_CORNERS = 6  # triangles around a texel that is inside its surface, not at a border
# A flank takes over only where its footprint is smaller by this factor: each takes a surface apart a little more.
_FLANK_GAIN = 1.3
_OVERLAP_GAIN = 2.0  # a triangle with corners of two owners is left to the other where that is better by this factor
_BATCH = 1 << 15  # triangles at a time
_WALL = 0.5  # cosine between a triangle and the surface at its corners, below which it is no part of that surface


def assign_owners(
    cylinder: Cylinder, images: list[DepthImage], inner: Inner, each: Map = map
) -> list[NDArray[np.uint8]]:
    """For each image the Face (H, W) that samples the surface at a texel with the smallest footprint."""

    def assign(image: DepthImage) -> NDArray[np.uint8]:
        owner = np.full(image.depth.shape, image.face, np.uint8)
        solid = np.isfinite(image.depth)
        point, normal = image_points(cylinder, image)[solid], image.normal[solid]
        winner = owner[solid]
        best = _handicap(image.face) * footprints(cylinder, image.face, image.depth.shape, point, normal)
        for face in inner:
            if face is image.face:
                continue
            size = footprints(cylinder, face, image.depth.shape, point, normal)
            better = np.flatnonzero(_handicap(face) * size < best)
            seen = better[
                _seen_by(cylinder, face, images, inner, point.take(better, 0), normal.take(better, 0), size[better])
            ]
            winner[seen], best[seen] = face, _handicap(face) * size[seen]
        owner[solid] = winner
        return owner

    return list(each(assign, images))


def worth_adding(
    cylinder: Cylinder, images: list[DepthImage], inner: Inner, face: Face, point: Array, normal: Array
) -> NDArray[np.bool_]:
    """Which points (n, 3) with normals (n, 3) `face` would own against `images` of other faces."""
    shape = images[0].depth.shape
    own = _handicap(face) * footprints(cylinder, face, shape, point, normal)
    worth = np.isfinite(own)
    for other in inner:
        rows = np.flatnonzero(worth)
        size = footprints(cylinder, other, shape, point.take(rows, 0), normal.take(rows, 0))
        as_good = np.flatnonzero(_handicap(other) * size <= own[rows])
        rows, size = rows[as_good], size[as_good]
        seen = _seen_by(cylinder, other, images, inner, point.take(rows, 0), normal.take(rows, 0), size)
        worth[rows[seen]] = False
    return worth


def yield_triangles(cylinder: Cylinder, images: list[DepthImage], inner: Inner, each: Map = map) -> list[DepthImage]:
    """`images` with those triangles marked in `cells` that another face holds better, whoever owns their corners.

    A wall spans what no ray samples between two samples (the tread of a step between two risers). It lies on another
    surface than they do, so their normals and owners say nothing of it. And where owners meet, triangles overlap, of
    which a slanted one is a worse guess at the surface.
    """

    return [image for face in inner for image in _yield_face(cylinder, images, inner, face, each)]


def _yield_face(cylinder: Cylinder, images: list[DepthImage], inner: Inner, face: Face, each: Map) -> list[DepthImage]:
    layers = [image for image in images if image.face is face]
    points = np.concatenate([image_points(cylinder, layer).reshape(-1, 3) for layer in layers])
    normals = np.concatenate([layer.normal.reshape(-1, 3) for layer in layers])
    owner = np.concatenate([layer.owner.ravel() for layer in layers])

    def yielded(task: tuple[DepthImage, int, NDArray[np.intp], NDArray[np.intp]]) -> NDArray[np.bool_]:
        image, level, half, cell = task
        layer, texel = triangle_corners(image, level, half, cell)
        corner = (layer * image.depth.size + texel).T
        corners, owners = points.take(corner, 0), owner.take(corner)  # (3, triangles, …)
        across = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        across /= np.maximum(lengths(across), np.float32(1e-20))[:, None]
        wall = (np.einsum("cni,ni->cn", normals.take(corner, 0), across) < _WALL).any(0)
        mixed = (owners != face).any(0) & (owners == face).any(0)
        some = np.flatnonzero(wall | mixed)
        gain = np.where(wall[some], 1.0, _OVERLAP_GAIN)
        held = np.zeros(len(cell), bool)
        middle = corners.take(some, 1).mean(0)
        held[some] = _held_better(cylinder, face, images, inner, middle, across.take(some, 0), gain)
        return held

    places = [(image, level, *triangle_places(image, level)) for image in layers for level in range(len(image.cells))]
    tasks = [
        (image, level, half[some], cell[some])
        for image, level, half, cell in places
        for some in batches(len(cell), _BATCH)
    ]
    cells = [[codes.copy() for codes in image.cells] for image in layers]
    for (image, level, half, cell), held in zip(tasks, each(yielded, tasks), strict=True):
        np.bitwise_or.at(cells[image.layer][level], cell[held], (1 << 14 + half[held]).astype(np.uint16))
    return [replace(image, cells=tuple(codes)) for image, codes in zip(layers, cells, strict=True)]


def _held_better(
    cylinder: Cylinder,
    face: Face,
    images: list[DepthImage],
    inner: Inner,
    point: Array,
    normal: Array,
    gain: Array,
) -> NDArray[np.bool_]:
    """Which points (n, 3) with normals (n, 3) another face holds with a footprint smaller by `gain` (n,)."""
    shape = images[0].depth.shape
    own = footprints(cylinder, face, shape, point, normal)
    held = np.zeros(len(point), bool)
    for other in inner.keys() - {face}:
        rows = np.flatnonzero(~held)
        size = footprints(cylinder, other, shape, point.take(rows, 0), normal.take(rows, 0))
        better = np.flatnonzero(np.isfinite(size) & (gain[rows] * size < own[rows]))
        rows, size = rows[better], size[better]
        held[rows] = _seen_by(cylinder, other, images, inner, point.take(rows, 0), normal.take(rows, 0), size)
    return held


def _handicap(face: Face) -> float:
    """By which its footprints are compared: those of flanks are made worse by what they must gain."""
    return _FLANK_GAIN if face in FLANKS else 1.0


def footprints(
    cylinder: Cylinder, face: Face, shape: tuple[int, ...], point: Array, normal: Array
) -> NDArray[np.float64]:
    """Footprint (n,) in metres of surface points (n, 3) with normals (n, 3); +inf where `face` sees their back."""
    u, v = image_position(cylinder, face, point)
    _, direction = surface_rays(cylinder, face, u, v)
    width, height = texel_size(cylinder, face, (shape[0], shape[1]))
    spacing = np.full(len(point), max(width, height))
    if face is Face.SIDE:
        spacing = np.maximum(height, width * np.hypot(point[:, 0], point[:, 2]) / cylinder.radius)
    cosine = -np.einsum("ni,ni->n", direction, normal)
    return np.where(cosine > _GRAZING, spacing / np.maximum(cosine, _GRAZING), np.inf)


def _seen_by(
    cylinder: Cylinder,
    face: Face,
    images: list[DepthImage],
    inner: Inner,
    point: Array,
    normal: Array,
    footprint: Array,
) -> NDArray[np.bool_]:
    """Which points (n, 3) one of the layers of `face` holds, well inside a connected piece of surface. footprint (n,):
    theirs in `face`."""
    height, width = images[0].depth.shape
    u, v = image_position(cylinder, face, point)
    i = np.clip((u * width).astype(int), 0, width - 1)
    texel = np.clip((v * height).astype(int), 0, height - 1) * width + i
    origin, _ = surface_rays(cylinder, face, u, v)
    depth = lengths(point - origin)
    seen = np.zeros(len(point), bool)
    for rival in (image for image in images if image.face is face):
        with np.errstate(invalid="ignore"):
            same = np.abs(rival.depth.take(texel) - depth) < 1.5 * footprint
        some = np.flatnonzero(same & inner[face][rival.layer].take(texel))
        rivals = rival.normal.reshape(-1, 3).take(texel[some], 0)
        seen[some] |= np.einsum("ni,ni->n", rivals, normal.take(some, 0)) > 0.5
    return seen


def inner_texels(layers: list[DepthImage]) -> NDArray[np.bool_]:
    """The texels (L, H, W) of a face's layers that its finest grid surrounds with triangles on all sides."""
    size = layers[0].depth.size
    count = np.zeros(len(layers) * size, np.int64)
    for anchor in layers:
        layer, texel = layer_triangles(anchor, 0)
        count += np.bincount((layer * size + texel).ravel(), minlength=len(count))
    return (count >= _CORNERS).reshape(len(layers), *layers[0].depth.shape)
