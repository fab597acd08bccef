"""Which of its depth images shows a piece of an object's surface best."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import (
    BakedObject,
    DepthImage,
    Face,
    image_position,
    square_texel,
    surface_rays,
    whole_cells,
)
from depthwalk.bake.sampling import face_normals
from depthwalk.render.grids import EDGE, FACE_SHIFT, PAST_AXIS

_ELSEWHERE, _ASKEW = 0.1, 0.3  # what it costs a triangle to look where another face owns the surface, or aslant
_TURNED = 0.5  # or where the surface faces elsewhere
_EDGE_ON = 0.1  # cosine: a sample faces its ray, wherever a leaf's normals point; where rays are steeper, these tell
_NEAR = 2.0  # times a triangle's longest side and a texel: samples farther away are not of its surface

Array = NDArray[np.floating]
Ints = NDArray[np.int64]


class _View(NamedTuple):
    """Where an image of a face is looked up for t triangles at p points of each: row, column (t, p); facing: the cosine
    (t, p) at which rays meet the triangle; origin, inward (t, p, 3): of the rays through these texels' middles."""

    row: Ints
    column: Ints
    facing: Array
    origin: Array
    inward: Array


def best_images(baked: BakedObject, corners: Array) -> Ints:
    """The image (t,), with PAST_AXIS and EDGE, that best holds each triangle (t, 3, 3): where the samples at its middle
    and near its corners lie on its plane, are on its side of it, are that face's own and are seen squarely."""
    middle = corners.mean(1, keepdims=True)
    probes = np.concatenate([middle, (middle + corners) / 2], 1)
    normal = face_normals(corners)[0]
    texel = square_texel(baked)
    size = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max(1)[:, None]
    best, code = np.full(len(corners), np.inf), np.zeros(len(corners), np.int64)
    for image, past, view in _views(baked, probes, normal):
        depth = image.depth[view.row, view.column]
        solid = np.isfinite(depth)
        away = view.origin + np.where(solid, depth, 0)[..., None] * view.inward - probes
        off = np.abs(np.einsum("tpi,ti->tp", away, normal)) / np.maximum(size, texel)
        cosine = np.einsum("tpi,ti->tp", image.normal[view.row, view.column], normal)
        same_side = np.where(np.abs(view.facing) > _EDGE_ON, view.facing, cosine) > 0
        there = solid & same_side & (np.linalg.norm(away, axis=-1) < _NEAR * (size + texel))
        cost = np.where(there, np.minimum(off, 1) + _TURNED * (1 - np.minimum(np.abs(cosine), 1)), 1)
        cost += _ELSEWHERE * (image.owner[view.row, view.column] != image.face) + _ASKEW * (1 - np.abs(view.facing))
        total = cost.sum(1)
        better = np.flatnonzero(total < best)
        edge = _beside_edges(image)[view.row[better], view.column[better]].any(1)
        number = (image.face << FACE_SHIFT) + image.layer + PAST_AXIS * past
        best[better], code[better] = total[better], number + EDGE * edge
    return code


def _views(baked: BakedObject, probes: Array, normal: Array) -> Iterator[tuple[DepthImage, bool, _View]]:
    """All images, those of the side also past the axis, as seen at points (t, p, 3) on planes of `normal` (t, 3)."""
    for face, past in [*((face, False) for face in Face), (Face.SIDE, True)]:
        images = [image for image in baked.images if image.face is face]
        if images:
            view = _look_up(baked, images[0].depth.shape, face, past, probes, normal)
            yield from ((image, past, view) for image in images)


def _look_up(baked: BakedObject, shape: tuple[int, ...], face: Face, past: bool, probes: Array, normal: Array) -> _View:
    height, width = shape
    turned = probes * (-1, 1, -1) if past else probes
    u, v = (axis.reshape(probes.shape[:2]) for axis in image_position(baked.cylinder, face, turned.reshape(-1, 3)))
    row, column = ((at * count).astype(int).clip(0, count - 1) for at, count in ((v, height), (u, width)))
    origin, inward = surface_rays(baked.cylinder, face, (column + 0.5) / width, (row + 0.5) / height)
    return _View(row, column, -np.einsum("tpi,ti->tp", inward, normal), origin, inward)


def _beside_edges(image: DepthImage) -> NDArray[np.bool_]:
    """Texels (H, W) that are a corner of a cell that is not whole: filtered, they show another surface, too."""
    broken = ~whole_cells(image, 0).reshape(len(image.depth) - 1, -1)
    broken = np.pad(broken, ((1, 1), (1, 0)), mode="wrap") if image.face is Face.SIDE else np.pad(broken, 1)
    broken[[0, -1]] = False
    return broken[1:, 1:] | broken[:-1, 1:] | broken[1:, :-1] | broken[:-1, :-1]
