"""View selection: find the depth image that best shows each triangle of an object's surface.

A simplified triangle is no longer part of one image. Its colours and normals are looked up in the image in which the
samples near it lie on its plane and are seen head-on; a wrong choice shows as a patch of another surface.
"""

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
from depthwalk.types import Array, Ints, Mask

NOWHERE = -1
_ELSEWHERE, _ASKEW = 0.1, 0.3  # cost of an image where another face owns the surface, or that sees it at a slant
_STRETCHED = 0.02  # cost of one more width by which texels are stretched; edge-on, a row of them shows a whole triangle
_MOST_STRETCHED = 50.0  # widths: one that is stretched farther costs no more
_OTHER_LAYER = 0.1  # cost of finding it only in another layer, where shaders search for what the image lacks
_TURNED = 0.5  # cost where the surface faces elsewhere
_EDGE_ON = 0.1  # cosine; samples face their rays, whatever a leaf's normals; these count where rays are steeper
_NEAR = 2.0  # times a triangle's longest side and a texel: samples farther away belong to another surface
_OUTWARD = 0.75  # of the way from the centre to the corners, where a triangle is probed; its rim may cover other texels
_ROUNDING = 1e-3  # by which lower bounds may be too high: everything is in single precision
_BATCH = 1 << 15  # triangles at a time: with fewer, threads wait for each other more than for memory


class _Look(NamedTuple):
    """Hold the images of a face, on one side of the axis.

    code: (layers,) their numbers, as in `select_views`, without EDGE. The rest is (H · W, layers, …), so that the
    layers of one texel are adjacent in memory. depth: metres; normal: unit; foreign: the cost if another face owns the
    surface; beside_edge: whether the texel is next to a discontinuity.
    """

    grid: FaceGrid
    past: bool
    code: Ints
    depth: NDArray[np.float32]
    normal: NDArray[np.float32]
    foreign: NDArray[np.float32]
    beside_edge: Mask


class _View(NamedTuple):
    """Hold the lookups in a face for t triangles at p points (probes) of each.

    texel: (t, p), number in the image; facing: (t, p), cosines between the rays there and the triangle's normal; askew:
    (t, p), cost of seeing it at a slant; before: (t, p), how far the rays begin before the triangle's plane, metres.
    """

    texel: NDArray[Any]
    facing: Array
    askew: Array
    before: Array

    def at(self, rows: Ints) -> "_View":
        """Return the lookups of the triangles `rows`."""
        return _View(*(values.take(rows, 0) for values in self))


class _Triangles(NamedTuple):
    """Hold t triangles.

    probes: (t, p, 3), points on them, metres; normal: (t, 3), unit; max_distance: (t,), largest distance of their
    samples from a probe, metres; scale: (t,), their least height or a texel, whichever is longer, metres.
    """

    probes: Array
    normal: Array
    max_distance: Array
    scale: Array

    def at(self, rows: Ints) -> "_Triangles":
        """Return the triangles `rows`."""
        return _Triangles(*(values.take(rows, 0) for values in self))


def select_views(baked: BakedObject, corners: Array, parallel: Map = map) -> Ints:
    """Return the depth image that best shows each triangle.

    In that image, the samples at the triangle's centre and near its corners lie on the triangle's plane, face the same
    way, are owned by the image's face, and are seen head-on.

    Parameters
    ----------
    baked
        The object, one of whose depth images is chosen for each triangle.
    corners
        (t, 3, 3) triangles, counter-clockwise seen from the front, metres, object frame.
    parallel
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    Ints
        (t,) numbers of images (face · 8 + layer), with the flags PAST_AXIS and EDGE of `lod_geometry`. `NOWHERE` for a
        triangle that is turned away from all samples near it: a fold, which is visible only where the surface is seen
        from behind.
    """
    looks = _looks(baked)

    def best(batch: slice) -> Ints:
        return _best_images(baked, looks, corners[batch])

    return np.concatenate(list(parallel(best, batches(len(corners), _BATCH))))


def _looks(baked: BakedObject) -> list[_Look]:
    """Return all images by face; those of the side twice, the second time for what is past the axis."""
    looks = []
    for face in Face:
        images = [image for image in baked.images if image.face is face]
        if not images:
            continue
        elsewhere = np.array([0, _ELSEWHERE], np.float32)
        depth, normal, foreign, beside_edge = (
            np.stack([layer.reshape(-1, *layer.shape[2:]) for layer in layers], 1)
            for layers in zip(
                *(
                    (image.depth, image.normal, elsewhere[(image.owner != face).astype(np.int64)], _beside_edges(image))
                    for image in images
                ),
                strict=True,
            )
        )
        code = (face << FACE_SHIFT) + np.array([image.layer for image in images])
        looks.append(_Look(FaceGrid.of(baked.cylinder, images[0]), False, code, depth, normal, foreign, beside_edge))
        if face is Face.SIDE:
            looks.append(looks[-1]._replace(past=True, code=code + PAST_AXIS))
    return looks


def _best_images(baked: BakedObject, looks: list[_Look], corners: Array) -> Ints:
    """Do the same as `select_views` for one batch of triangles (t, 3, 3)."""
    triangles = _probed(baked, corners)
    candidates = [_not_from_behind(look, triangles) for look in looks]
    views = [_look_up(look, triangles.at(rows)) for look, rows in zip(looks, candidates, strict=True)]
    # Lower bounds of the costs leave few images to examine: the one with the lowest is usually the best.
    ends = np.cumsum([len(look.code) for look in looks])
    least = np.full((len(corners), ends[-1]), np.inf, np.float32)
    for look, rows, view, end in zip(looks, candidates, views, ends, strict=True):
        least[rows, end - len(look.code) : end] = _least_cost(look, triangles.scale[rows], view)
    likely = np.zeros(least.shape, bool)
    likely[np.arange(len(least)), least.argmin(1)] = True
    best, code = np.full(len(corners), np.inf), np.full(len(corners), NOWHERE)
    for first, (look, rows, view, end) in product(
        (True, False), list(zip(looks, candidates, views, ends, strict=True))
    ):
        own = rows, slice(end - len(look.code), end)
        row, layer = (likely[own] if first else (least[own] < best[rows, None]) & ~likely[own]).nonzero()
        cost, sampled = _cost(look, layer, triangles.at(rows[row]), view.at(row))
        # The last one written stays: the least, and among equals the first.
        better = np.flatnonzero((cost < best[rows[row]]) & sampled.any(1))
        better = better[np.argsort(cost[better], kind="stable")[::-1]]
        row, layer = row[better], layer[better]
        # A large triangle may extend across an edge even if none of its probes is beside it.
        edge = look.beside_edge[view.texel[row], layer[:, None]].any(1) | ~sampled[better].all(1)
        best[rows[row]] = cost[better]
        code[rows[row]] = look.code[layer] + EDGE * edge
    return code


def _probed(baked: BakedObject, corners: Array) -> _Triangles:
    """Return triangles (t, 3, 3) with their probes: the centre, and points towards the corners."""
    middle = corners.mean(1, keepdims=True)
    probes = np.concatenate([middle, middle + _OUTWARD * (corners - middle)], 1)
    size, texel = lengths(corners - np.roll(corners, 1, axis=1)).max(1), square_texel(baked)
    normal, area = face_normals(corners)
    # A sliver is as long as it likes, but lies on the surface all the same: what is off it by more than its height or a
    # texel is another one, such as the underside of the slab whose rim it is on.
    height = 2 * area / np.maximum(size, 1e-30)
    values = probes, normal, _NEAR * (size + texel), np.maximum(height, texel)
    return _Triangles(*(value.astype(np.float32) for value in values))


def _not_from_behind(look: _Look, triangles: _Triangles) -> Ints:
    """Return the triangles (n,) of which `look` may have a sample: not those that all its rays hit from behind."""
    if look.grid.face is not Face.SIDE:
        return np.flatnonzero(triangles.normal @ face_outward(look.grid.face) >= -_EDGE_ON)
    x, z = triangles.probes[..., 0], triangles.probes[..., 2]
    facing = x * triangles.normal[:, 0, None] + z * triangles.normal[:, 2, None]
    # Rays pass through the centres of texels, which turns them by up to half a texel.
    least = -(_EDGE_ON + 2 * np.pi / look.grid.width) * np.hypot(x, z)
    return np.flatnonzero(((-facing if look.past else facing) >= least).any(1))


def _least_cost(look: _Look, scale: Array, view: _View) -> Array:
    """Return lower bounds (t, layers) of the costs of images, from the depths of their samples alone.

    scale: (t,), of the triangles, metres.
    """
    with np.errstate(invalid="ignore"):  # infinitely far along a plane
        off = view.facing[..., None] * look.depth.take(view.texel, 0)
        off -= view.before[..., None]
        np.abs(off, out=off)
        off /= scale[:, None, None]
        cost = np.fmin(off, np.float32(1), out=off)
    cost[view.facing < -_EDGE_ON] = 1
    cost += look.foreign.take(view.texel, 0)
    np.minimum(cost, cost.min(-1, keepdims=True) + np.float32(_OTHER_LAYER), out=cost)
    cost += view.askew[..., None]
    return np.asarray(np.einsum("tpl->tl", cost)) - _ROUNDING  # much faster than `sum` along so short an axis


def _cost(look: _Look, layer: Ints, triangles: _Triangles, view: _View) -> tuple[Array, Mask]:
    """Return the cost (t,) of the image of one layer for each triangle, and for which probes (t, p) it has a sample.

    A missing sample costs little if another layer has it.

    layer: (t,), the image's place in `look`.
    """
    cost, sampled = _probe_costs(look, np.broadcast_to(layer[:, None], view.texel.shape), triangles, view)
    some = np.asarray(sampled.any(1))  # an image without any sample is not chosen
    row, probe = (~sampled & some[:, None]).nonzero()
    of = _View(*(values[row, probe, None] for values in view))
    lacking = triangles.at(row)._replace(probes=triangles.probes[row, probe, None])
    for other in range(len(look.code)):
        elsewhere, found = _probe_costs(look, np.full((len(row), 1), other), lacking, of)
        cheaper = np.minimum(cost[row, probe], elsewhere[:, 0] + _OTHER_LAYER)
        cost[row, probe] = np.where(found[:, 0], cheaper, cost[row, probe])
    return np.asarray((cost + view.askew).sum(1)), sampled


def _probe_costs(look: _Look, layer: Ints, triangles: _Triangles, view: _View) -> tuple[Array, Mask]:
    """Return the cost of looking up each probe in a layer, without slant, and whether there is a sample: (t, p).

    layer: (t, p), places in `look`.
    """
    at = view.texel * len(look.code) + layer
    depth = look.depth.take(at)
    solid = np.isfinite(depth)
    origin, inward = (rays.reshape(-1, 3).take(view.texel, 0) for rays in look.grid.rays)
    away = origin + np.where(solid, depth, 0)[..., None] * inward - triangles.probes
    off = np.abs(np.einsum("tpi,ti->tp", away, triangles.normal)) / triangles.scale[:, None]
    cosine = np.einsum("tpi,ti->tp", look.normal.reshape(-1, 3).take(at, 0), triangles.normal)
    same_side = np.where(np.abs(view.facing) > _EDGE_ON, view.facing, cosine) > 0
    sampled = solid & same_side & (off < 1) & (lengths(away) < triangles.max_distance[:, None])
    cost = np.where(sampled, off + _TURNED * (1 - np.minimum(np.abs(cosine), 1)), 1)
    return np.asarray(cost + look.foreign.take(at)), sampled


def _look_up(look: _Look, triangles: _Triangles) -> _View:
    """Return the lookups of the triangles' probes in the face of `look`."""
    turned = triangles.probes * np.array((-1, 1, -1), np.float32) if look.past else triangles.probes
    texels = look.grid.texel_at(*look.grid.position_of(turned.reshape(-1, 3)))
    row, column = (axis.reshape(turned.shape[:2]) for axis in texels)
    texel = row * look.grid.width + column
    origin, inward = (rays.reshape(-1, 3) for rays in look.grid.rays)
    if look.grid.face is Face.SIDE:
        facing = -np.einsum("tpi,ti->tp", inward.take(texel, 0), triangles.normal)
    else:  # all rays are parallel
        facing = np.repeat(triangles.normal @ -inward[:1].T, texel.shape[1], axis=1)
    stretched = 1 / np.maximum(facing, 1 / _MOST_STRETCHED) - 1
    askew = _ASKEW * (1 - facing) + _STRETCHED * stretched
    before = np.einsum("tpi,ti->tp", origin.take(texel, 0) - triangles.probes, triangles.normal)
    return _View(texel, facing, askew, before)


def _beside_edges(image: DepthImage) -> Mask:
    """Return the texels (H, W) at a corner of a cell that is not whole: filtered, they show another surface."""
    broken = ~whole_cells(image, 0).reshape(len(image.depth) - 1, -1)
    broken = np.pad(broken, ((1, 1), (1, 0)), mode="wrap") if image.face is Face.SIDE else np.pad(broken, 1)
    broken[[0, -1]] = False
    return broken[1:, 1:] | broken[:-1, 1:] | broken[1:, :-1] | broken[:-1, :-1]
