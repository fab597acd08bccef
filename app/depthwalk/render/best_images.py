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
from depthwalk.bake.parallel import Map, batches
from depthwalk.bake.sampling import face_normals
from depthwalk.bake.vectors import lengths
from depthwalk.render.grids import EDGE, FACE_SHIFT, PAST_AXIS

NOWHERE = -1
_ELSEWHERE, _ASKEW = 0.1, 0.3  # what it costs a triangle to look where another face owns the surface, or aslant
_TURNED = 0.5  # or where the surface faces elsewhere
_EDGE_ON = 0.1  # cosine: a sample faces its ray, wherever a leaf's normals point; where rays are steeper, these tell
_NEAR = 2.0  # times a triangle's longest side and a texel: samples farther away are not of its surface
_MIDDLE, _OTHERS = slice(0, 1), slice(1, None)  # of the points that are looked at on a triangle
_BATCH = 1 << 13  # triangles at a time: what is known of them stays in the cache

Array = NDArray[np.floating]
Ints = NDArray[np.int64]


class _View(NamedTuple):
    """Where an image of a face is looked up for t triangles at p points of each: row, column (t, p); facing: (t, p)
    cosines between rays and what faces them; origin, inward (t, p, 3): of the rays through texels' middles."""

    row: Ints
    column: Ints
    facing: Array
    origin: Array
    inward: Array

    @property
    def askew(self) -> Array:
        """What it costs (t, p) that rays meet the triangle aslant."""
        return np.asarray(_ASKEW * (1 - self.facing))

    def at(self, rows: Ints, points: slice) -> "_View":
        at = rows, points
        return _View(self.row[at], self.column[at], self.facing[at], self.origin[at], self.inward[at])


class _Pieces(NamedTuple):
    """t triangles. probes: (t, p, 3) points on them; normal: (t, 3), unit; size: (t, 1), their longest side, metres."""

    probes: Array
    normal: Array
    size: Array

    def at(self, rows: Ints, points: slice) -> "_Pieces":
        return _Pieces(self.probes[rows, points], self.normal[rows], self.size[rows])


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
    size = lengths(corners - np.roll(corners, 1, axis=1)).max(1)[:, None]
    pieces, texel = _Pieces(probes, face_normals(corners)[0], size), square_texel(baked)
    best, code = np.full(len(corners), np.inf), np.full(len(corners), NOWHERE)
    for image, beside, past, view in _views(baked, beside_edges, pieces):
        # Most images are out of the question at once, most of the others after a look at the middle.
        nothing = np.isinf(image.depth[view.row[:, 0], view.column[:, 0]])
        hopeful = np.flatnonzero(nothing + view.askew.sum(1) < best)
        cost, there = _cost(image, texel, pieces.at(hopeful, _MIDDLE), view.at(hopeful, _MIDDLE))
        total = cost[:, 0] + view.askew[hopeful, _OTHERS].sum(1)
        better = total < best[hopeful]
        hopeful, cost, there = hopeful[better], cost[better], there[better]
        cost_of_others, others_there = _cost(image, texel, pieces.at(hopeful, _OTHERS), view.at(hopeful, _OTHERS))
        total = cost[:, 0] + cost_of_others.sum(1)
        better = (total < best[hopeful]) & (there[:, 0] | others_there.any(1))
        hopeful = hopeful[better]
        edge = beside[view.row[hopeful], view.column[hopeful]].any(1)
        number = (image.face << FACE_SHIFT) + image.layer + PAST_AXIS * past
        best[hopeful], code[hopeful] = total[better], number + EDGE * edge
    return code


def _cost(image: DepthImage, texel: float, pieces: _Pieces, view: _View) -> tuple[Array, NDArray[np.bool_]]:
    """What speaks (t, p) against an image at points of triangles, and whether (t, p) it has a sample there."""
    depth = image.depth[view.row, view.column]
    solid = np.isfinite(depth)
    away = view.origin + np.where(solid, depth, 0)[..., None] * view.inward - pieces.probes
    off = np.abs(np.einsum("tpi,ti->tp", away, pieces.normal)) / np.maximum(pieces.size, texel)
    cosine = np.einsum("tpi,ti->tp", image.normal[view.row, view.column], pieces.normal)
    same_side = np.where(np.abs(view.facing) > _EDGE_ON, view.facing, cosine) > 0
    there = solid & same_side & (lengths(away) < _NEAR * (pieces.size + texel))
    cost = np.where(there, np.minimum(off, 1) + _TURNED * (1 - np.minimum(np.abs(cosine), 1)), 1)
    return cost + _ELSEWHERE * (image.owner[view.row, view.column] != image.face) + view.askew, there


def _views(
    baked: BakedObject, beside_edges: list[NDArray[np.bool_]], pieces: _Pieces
) -> Iterator[tuple[DepthImage, NDArray[np.bool_], bool, _View]]:
    """All images, those of the side also past the axis; with what of them is beside edges. Those come first that are
    likely: the first layers, and of these the ones that see most pieces squarely."""
    looks = [*((face, False) for face in Face), (Face.SIDE, True)]
    shape = baked.images[0].depth.shape
    present = {image.face for image in baked.images}
    views = {look: _look_up(baked, shape, *look, pieces) for look in looks if look[0] in present}
    found = [
        (image, beside, past, view)
        for image, beside in zip(baked.images, beside_edges, strict=True)
        for (face, past), view in views.items()
        if face is image.face
    ]
    yield from sorted(found, key=lambda each: (each[0].layer, each[3].askew.mean()))


def _look_up(baked: BakedObject, shape: tuple[int, ...], face: Face, past: bool, pieces: _Pieces) -> _View:
    height, width = shape
    turned = pieces.probes * (-1, 1, -1) if past else pieces.probes
    u, v = (axis.reshape(turned.shape[:2]) for axis in image_position(baked.cylinder, face, turned.reshape(-1, 3)))
    row, column = ((at * count).astype(int).clip(0, count - 1) for at, count in ((v, height), (u, width)))
    origin, inward = surface_rays(baked.cylinder, face, (column + 0.5) / width, (row + 0.5) / height)
    return _View(row, column, -np.einsum("tpi,ti->tp", inward, pieces.normal), origin, inward)


def _beside_edges(image: DepthImage) -> NDArray[np.bool_]:
    """Texels (H, W) that are a corner of a cell that is not whole: filtered, they show another surface, too."""
    broken = ~whole_cells(image, 0).reshape(len(image.depth) - 1, -1)
    broken = np.pad(broken, ((1, 1), (1, 0)), mode="wrap") if image.face is Face.SIDE else np.pad(broken, 1)
    broken[[0, -1]] = False
    return broken[1:, 1:] | broken[:-1, 1:] | broken[1:, :-1] | broken[:-1, :-1]
