"""Which of its depth images shows a piece of an object's surface best."""

from collections.abc import Iterator
from itertools import product
from typing import Any, NamedTuple

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
from depthwalk.bake.parallel import Map, batches
from depthwalk.bake.sampling import face_normals
from depthwalk.bake.vectors import lengths
from depthwalk.render.grids import EDGE, FACE_SHIFT, PAST_AXIS

NOWHERE = -1
_ELSEWHERE, _ASKEW = 0.1, 0.3  # what it costs a triangle to look where another face owns the surface, or aslant
_TURNED = 0.5  # or where the surface faces elsewhere
_EDGE_ON = 0.1  # cosine: a sample faces its ray, wherever a leaf's normals point; where rays are steeper, these tell
_NEAR = 2.0  # times a triangle's longest side and a texel: samples farther away are not of its surface
_BATCH = 1 << 13  # triangles at a time: what is known of them stays in the cache

Array = NDArray[np.floating]
Ints = NDArray[np.int64]


class _View(NamedTuple):
    """Where an image of a face is looked up for t triangles at p points of each: row, column (t, p); facing: (t, p)
    cosines between rays and what faces them; askew: (t, p) what it costs that they meet it aslant; before: (t, p) how
    far they begin before the triangle's plane, metres; origin, inward (t, p, 3): of those through texels' middles."""

    row: NDArray[Any]
    column: NDArray[Any]
    facing: Array
    askew: Array
    before: Array
    origin: Array
    inward: Array

    def at(self, rows: Ints) -> "_View":
        return _View(*(values[rows] for values in self))


class _Pieces(NamedTuple):
    """t triangles. probes: (t, p, 3) points on them; normal: (t, 3), unit; size: (t,), their longest
    side, metres; scale: (t,), that or a texel, if that is longer."""

    probes: Array
    normal: Array
    size: Array
    scale: Array

    def at(self, rows: Ints) -> "_Pieces":
        return _Pieces(*(values[rows] for values in self))


def best_images(baked: BakedObject, corners: Array, each: Map = map) -> Ints:
    """The image (t,), with PAST_AXIS and EDGE, that best holds each triangle (t, 3, 3): where the samples at its middle
    and near its corners lie on its plane, are on its side of it, are that face's own and are seen squarely.
    `NOWHERE` for one that is turned away from all samples near it: a fold, which shows where the surface is seen from
    behind."""
    beside_edges = [_beside_edges(image) for image in baked.images]

    def best(some: slice) -> Ints:
        return _best_images(baked, beside_edges, corners[some])

    return np.concatenate(list(each(best, batches(len(corners), _BATCH))))


def _best_images(baked: BakedObject, beside_edges: list[NDArray[np.bool_]], corners: Array) -> Ints:
    middle = corners.mean(1, keepdims=True)
    probes = np.concatenate([middle, (middle + corners) / 2], 1)
    size = lengths(corners - np.roll(corners, 1, axis=1)).max(1)
    texel = square_texel(baked)
    pieces = _Pieces(probes, face_normals(corners)[0], size, np.maximum(size, texel))
    looks = list(_views(baked, beside_edges, pieces))
    # What images cost at least leaves few to look into: the likeliest is the best, mostly.
    least = np.stack([_least_cost(image, pieces, view) for image, _, _, view in looks])
    likeliest = least.argmin(0)
    best, code = np.full(len(corners), np.inf), np.full(len(corners), NOWHERE)
    for first, (number, (image, beside, past, view)) in product((True, False), enumerate(looks)):
        hopeful = np.flatnonzero(likeliest == number if first else (least[number] < best) & (likeliest != number))
        cost, there = _cost(image, texel, pieces.at(hopeful), view.at(hopeful))
        better = (cost < best[hopeful]) & there
        hopeful = hopeful[better]
        edge = beside[view.row[hopeful], view.column[hopeful]].any(1)
        best[hopeful] = cost[better]
        code[hopeful] = (image.face << FACE_SHIFT) + image.layer + PAST_AXIS * past + EDGE * edge
    return code


def _least_cost(image: DepthImage, pieces: _Pieces, view: _View) -> Array:
    """What speaks (t,) at least against an image for triangles, by the depths of its samples."""
    at = view.row, view.column
    with np.errstate(invalid="ignore"):  # infinitely far along a plane
        off = np.abs(view.before - view.facing * image.depth[at]) / pieces.scale[:, None]
    cost = np.fmin(off, 1) + _ELSEWHERE * (image.owner[at] != image.face) + view.askew
    return np.asarray(np.einsum("tp->t", cost))  # much faster than `sum` along so short an axis


def _cost(image: DepthImage, texel: float, pieces: _Pieces, view: _View) -> tuple[Array, NDArray[np.bool_]]:
    """What speaks (t,) against an image for triangles, and whether (t,) it has a sample of them."""
    depth = image.depth[view.row, view.column]
    solid = np.isfinite(depth)
    away = view.origin + np.where(solid, depth, 0)[..., None] * view.inward - pieces.probes
    off = np.abs(np.einsum("tpi,ti->tp", away, pieces.normal)) / pieces.scale[:, None]
    cosine = np.einsum("tpi,ti->tp", image.normal[view.row, view.column], pieces.normal)
    same_side = np.where(np.abs(view.facing) > _EDGE_ON, view.facing, cosine) > 0
    there = solid & same_side & (lengths(away) < _NEAR * (pieces.size + texel)[:, None])
    cost = np.where(there, np.minimum(off, 1) + _TURNED * (1 - np.minimum(np.abs(cosine), 1)), 1)
    cost += _ELSEWHERE * (image.owner[view.row, view.column] != image.face) + view.askew
    return np.asarray(cost.sum(1)), np.asarray(there.any(1))


def _views(
    baked: BakedObject, beside_edges: list[NDArray[np.bool_]], pieces: _Pieces
) -> Iterator[tuple[DepthImage, NDArray[np.bool_], bool, _View]]:
    """All images, those of the side also past the axis; with what of them is beside edges."""
    looks = [*((face, False) for face in Face), (Face.SIDE, True)]
    shape = baked.images[0].depth.shape
    present = {image.face for image in baked.images}
    views = {look: _look_up(baked, shape, *look, pieces) for look in looks if look[0] in present}
    for image, beside in zip(baked.images, beside_edges, strict=True):
        for (face, past), view in views.items():
            if face is image.face:
                yield image, beside, past, view


def _look_up(baked: BakedObject, shape: tuple[int, ...], face: Face, past: bool, pieces: _Pieces) -> _View:
    height, width = shape
    turned = pieces.probes * (-1, 1, -1) if past else pieces.probes
    u, v = (axis.reshape(turned.shape[:2]) for axis in image_position(baked.cylinder, face, turned.reshape(-1, 3)))
    row, column = ((at * count).astype(int).clip(0, count - 1) for at, count in ((v, height), (u, width)))
    origin, inward = surface_rays(baked.cylinder, face, (column + 0.5) / width, (row + 0.5) / height)
    facing = -np.einsum("tpi,ti->tp", inward, pieces.normal)
    askew = _ASKEW * (1 - facing)
    before = np.einsum("tpi,ti->tp", origin - pieces.probes, pieces.normal)
    return _View(row, column, facing, askew, before, origin, inward)


def _beside_edges(image: DepthImage) -> NDArray[np.bool_]:
    """Texels (H, W) that are a corner of a cell that is not whole: filtered, they show another surface, too."""
    broken = ~whole_cells(image, 0).reshape(len(image.depth) - 1, -1)
    broken = np.pad(broken, ((1, 1), (1, 0)), mode="wrap") if image.face is Face.SIDE else np.pad(broken, 1)
    broken[[0, -1]] = False
    return broken[1:, 1:] | broken[:-1, 1:] | broken[1:, :-1] | broken[:-1, :-1]
