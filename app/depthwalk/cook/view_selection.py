"""Which of its depth images shows a piece of an object's surface best."""

from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import FaceGrid, square_texel
from depthwalk.bake.grid import whole_cells
from depthwalk.bake.images import BakedObject, DepthImage, Face, face_outward
from depthwalk.cook.lod_geometry import EDGE, FACE_SHIFT, PAST_AXIS
from depthwalk.geometry.triangles import face_normals
from depthwalk.geometry.vectors import lengths
from depthwalk.parallel import Map, batches
from depthwalk.types import Array, Ints

NOWHERE = -1
_ELSEWHERE, _ASKEW = 0.1, 0.3  # what it costs a triangle to look where another face owns the surface, or aslant
_TURNED = 0.5  # or where the surface faces elsewhere
_EDGE_ON = 0.1  # cosine: a sample faces its ray, wherever a leaf's normals point; where rays are steeper, these tell
_NEAR = 2.0  # times a triangle's longest side and a texel: samples farther away are not of its surface
_ROUNDING = 1e-3  # by which these may be too high: all is in single precision
_BATCH = 1 << 13  # triangles at a time: what is known of them stays in the cache


class _Look(NamedTuple):
    """The images of a face, on one side of the axis. code: (layers,) of each, as in `select_views`, without EDGE; the
    rest (H, W, layers, …), so that one place has what lies behind it beside it. strange: whether another face owns the
    surface; beside: whether edges are."""

    grid: FaceGrid
    past: bool
    code: Ints
    depth: NDArray[np.float32]
    normal: NDArray[np.float32]
    strange: NDArray[np.bool_]
    beside: NDArray[np.bool_]


class _View(NamedTuple):
    """Where a face is looked up for t triangles at p points of each: row, column (t, p); facing: (t, p)
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
    """t triangles. probes: (t, p, 3) points on them; normal: (t, 3), unit; reach: (t,), how far samples of theirs are
    from a probe at most, metres; scale: (t,), their longest side, or a texel, if that is longer."""

    probes: Array
    normal: Array
    reach: Array
    scale: Array

    def at(self, rows: Ints) -> "_Pieces":
        return _Pieces(*(values[rows] for values in self))


def select_views(baked: BakedObject, corners: Array, each: Map = map) -> Ints:
    """The image (t,), with PAST_AXIS and EDGE, that best holds each triangle (t, 3, 3): where the samples at its middle
    and near its corners lie on its plane, are on its side of it, are that face's own and are seen squarely.
    `NOWHERE` for one that is turned away from all samples near it: a fold, which shows where the surface is seen from
    behind."""
    looks = _looks(baked)

    def best(some: slice) -> Ints:
        return _best_images(baked, looks, corners[some])

    return np.concatenate(list(each(best, batches(len(corners), _BATCH))))


def _looks(baked: BakedObject) -> list[_Look]:
    """All images by face; those of the side a second time, past the axis."""
    looks = []
    for face in Face:
        images = [image for image in baked.images if image.face is face]
        if not images:
            continue
        depth, normal, strange, beside = (
            np.stack(layers, 2)
            for layers in zip(
                *((image.depth, image.normal, image.owner != face, _beside_edges(image)) for image in images),
                strict=True,
            )
        )
        code = (face << FACE_SHIFT) + np.array([image.layer for image in images])
        looks.append(_Look(FaceGrid.of(baked.cylinder, images[0]), False, code, depth, normal, strange, beside))
        if face is Face.SIDE:
            looks.append(looks[-1]._replace(past=True, code=code + PAST_AXIS))
    return looks


def _best_images(baked: BakedObject, looks: list[_Look], corners: Array) -> Ints:
    pieces = _pieces(baked, corners)
    some = [_not_from_behind(look, pieces) for look in looks]
    views = [_look_up(look, pieces.at(rows)) for look, rows in zip(looks, some, strict=True)]
    # What images cost at least leaves few to look into: the likeliest is the best, mostly.
    ends = np.cumsum([len(look.code) for look in looks])
    least = np.full((len(corners), ends[-1]), np.inf, np.float32)
    for look, rows, view, end in zip(looks, some, views, ends, strict=True):
        least[rows, end - len(look.code) : end] = _least_cost(look, pieces.scale[rows], view)
    likely = np.zeros(least.shape, bool)
    likely[np.arange(len(least)), least.argmin(1)] = True
    best, code = np.full(len(corners), np.inf), np.full(len(corners), NOWHERE)
    for first, (look, rows, view, end) in product((True, False), list(zip(looks, some, views, ends, strict=True))):
        its = rows, slice(end - len(look.code), end)
        row, layer = (likely[its] if first else (least[its] < best[rows, None]) & ~likely[its]).nonzero()
        cost, there = _cost(look, layer, pieces.at(rows[row]), view.at(row))
        # The last written stays: the least, and of equals the first.
        better = np.flatnonzero((cost < best[rows[row]]) & there)
        better = better[np.argsort(cost[better], kind="stable")[::-1]]
        row, layer = row[better], layer[better]
        edge = look.beside[view.row[row], view.column[row], layer[:, None]].any(1)
        best[rows[row]] = cost[better]
        code[rows[row]] = look.code[layer] + EDGE * edge
    return code


def _pieces(baked: BakedObject, corners: Array) -> _Pieces:
    middle = corners.mean(1, keepdims=True)
    probes = np.concatenate([middle, (middle + corners) / 2], 1)
    size, texel = lengths(corners - np.roll(corners, 1, axis=1)).max(1), square_texel(baked)
    values = probes, face_normals(corners)[0], _NEAR * (size + texel), np.maximum(size, texel)
    return _Pieces(*(value.astype(np.float32) for value in values))


def _not_from_behind(look: _Look, pieces: _Pieces) -> Ints:
    """Triangles (n,) of which `look` may have a sample: not those that its rays all meet from behind."""
    if look.grid.face is Face.SIDE:
        return np.arange(len(pieces.normal))
    return np.flatnonzero(pieces.normal @ face_outward(look.grid.face) >= -_EDGE_ON)


def _least_cost(look: _Look, scale: Array, view: _View) -> Array:
    """What speaks (t, layers) at least against images for triangles of `scale` (t,), by the depths of their samples."""
    at = view.row, view.column
    before, facing = view.before[..., None], view.facing[..., None]
    with np.errstate(invalid="ignore"):  # infinitely far along a plane
        off = np.abs(before - facing * look.depth[at]) / scale[:, None, None]
    cost = np.where(facing < -_EDGE_ON, np.float32(1), np.fmin(off, np.float32(1))) + view.askew[..., None]
    cost += _ELSEWHERE * look.strange[at]
    return np.asarray(np.einsum("tpl->tl", cost)) - _ROUNDING  # much faster than `sum` along so short an axis


def _cost(look: _Look, layer: Ints, pieces: _Pieces, view: _View) -> tuple[Array, NDArray[np.bool_]]:
    """What speaks (t,) against the image of a `layer` (t,) for triangles, and whether (t,) it has a sample of them."""
    at = view.row, view.column, layer[:, None]
    depth = look.depth[at]
    solid = np.isfinite(depth)
    away = view.origin + np.where(solid, depth, 0)[..., None] * view.inward - pieces.probes
    off = np.abs(np.einsum("tpi,ti->tp", away, pieces.normal)) / pieces.scale[:, None]
    cosine = np.einsum("tpi,ti->tp", look.normal[at], pieces.normal)
    same_side = np.where(np.abs(view.facing) > _EDGE_ON, view.facing, cosine) > 0
    there = solid & same_side & (lengths(away) < pieces.reach[:, None])
    cost = np.where(there, np.minimum(off, 1) + _TURNED * (1 - np.minimum(np.abs(cosine), 1)), 1)
    cost += _ELSEWHERE * look.strange[at] + view.askew
    return np.asarray(cost.sum(1)), np.asarray(there.any(1))


def _look_up(look: _Look, pieces: _Pieces) -> _View:
    turned = pieces.probes * np.array((-1, 1, -1), np.float32) if look.past else pieces.probes
    texels = look.grid.texel_at(*look.grid.position_of(turned.reshape(-1, 3)))
    row, column = (axis.reshape(turned.shape[:2]) for axis in texels)
    origin, inward = (rays[row, column] for rays in look.grid.rays)
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
