"""Levels of an object coarser than its grids: one surface over all of its faces, welded, with ever fewer triangles.

Grids end at every edge, in borders, and overlap where owners meet: however coarse, they are hundreds of triangles. Here
the surface is simplified as a whole. Shading still comes from the depth images: each triangle looks into the one that
holds it best.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from depthwalk.bake.images import BakedObject, Face, image_position, square_texel, surface_rays
from depthwalk.bake.sampling import face_normals, sample_triangles
from depthwalk.render.contract import contract, weld
from depthwalk.render.grids import BORDER, FACE_SHIFT, PAST_AXIS, Grids, build_grids
from depthwalk.render.lod import Case

_FINE = 2  # grids that are drawn as they are: steps 1 and 2
_WELD = 2.0  # texels, within which points of the last of these become one
_FIRST_TOLERANCE = 1.0  # texels, of the first coarse level, see `contract`
_GROWTH = 2**0.5  # from one to the next: leaves somewhat more than half of the triangles
_COARSE = 13  # levels at most
_FEWEST = 24  # triangles that are worth a level
_WORTH = 0.65  # of the finer level's triangles: with more than that it is no level of its own
_PROBES, _DISCS = 8_000, 20_000  # samples, and discs on a level, at least, that tell how far apart they are
_SHARE = 0.98  # of the samples, which are no farther off than a level's error
_ELSEWHERE, _ASKEW = 0.2, 0.1  # what it costs a triangle to look where another face owns the surface, or aslant

Array = NDArray[np.floating]
Ints = NDArray[np.int64]


def build_levels(baked: BakedObject) -> Grids:
    """The arrays of `baked`, for all faces, in levels by geometric error: its finest grids, then coarse surfaces.
    Objects with meso-structure, which displaces every sample, have all their grids instead."""
    if baked.meso is not None:
        return build_grids(baked)
    grids = build_grids(replace(baked, steps=min(baked.steps, _FINE)))
    fine = [_triangles(grids, level) for level in range(len(grids.first))]
    point, yields = _points(grids), grids.vertices[:, 3] & BORDER > 0
    levels = list(_coarse_surfaces(baked, point, fine[-1], yields))
    samples = np.unique(fine[0])
    samples = samples[~yields[samples]]
    probes = point[np.random.default_rng(0).permutation(samples)[:_PROBES]]
    error = [_deviation(probes, point[triangles]) for triangles in fine[1:]]
    error += [_deviation(probes, corners) for corners in levels]
    return _with_levels(grids, baked, levels, np.maximum.accumulate([0.0, *error]))


def _triangles(grids: Grids, level: int) -> Ints:
    """Vertex numbers (t, 3) of a level, for all faces."""
    runs = zip(grids.first[level, Case.ALL], grids.count[level, Case.ALL], strict=True)
    return np.concatenate([grids.indices[first : first + count] for first, count in runs]).reshape(-1, 3).astype(int)


def _points(grids: Grids) -> Array:
    return grids.box_low.astype(np.float64) + grids.vertices[:, :3] * (grids.box_size / 65535.0)


def _coarse_surfaces(baked: BakedObject, point: Array, triangles: Ints, yields: NDArray[np.bool_]) -> Iterator[Array]:
    """Corners (t, 3, 3) of the triangles of one level after the other.

    point (n, 3), triangles (t, 3): of the last grid; yields (n,): points that lie less surely on the surface.
    """
    texel, before = square_texel(baked), len(triangles)
    surface = weld(point, triangles, yields, _WELD * texel)
    for level in range(_COARSE):
        surface = contract(surface, _FIRST_TOLERANCE * _GROWTH**level * texel)
        if len(surface.triangles) < _FEWEST:
            return
        if len(surface.triangles) <= _WORTH * before:
            before = len(surface.triangles)
            yield surface.point[surface.triangles]


def _deviation(probes: Array, corners: Array) -> float:
    """How far most of the points `probes` (n, 3) are at most from triangles (t, 3, 3), metres. Discs that just overlap
    stand for these, which is right within a disc's radius beside the nearest one, and exact above it."""
    count = max(_DISCS, 2 * len(corners))
    middle, normal = sample_triangles(corners, count)
    away, nearest = cKDTree(middle).query(probes)
    above = np.einsum("ij,ij->i", probes - middle[nearest], normal[nearest])
    beside = np.sqrt(np.maximum(away**2 - above**2, 0))
    radius = 2 * np.sqrt(face_normals(corners)[1].sum() / count)
    return float(np.quantile(np.hypot(above, np.maximum(beside - radius, 0)), _SHARE))


def _with_levels(grids: Grids, baked: BakedObject, levels: list[Array], error: Array) -> Grids:
    """`grids` with further levels, of triangles with `levels` (t, 3, 3) as corners."""
    vertices, indices = [grids.vertices], [grids.indices]
    more = ((0, len(levels)), (0, 0), (0, 0))
    first, count = np.pad(grids.first, more), np.pad(grids.count, more)
    for level, corners in enumerate(levels, start=len(grids.first)):
        position = np.round(np.clip((corners - grids.box_low) / grids.box_size, 0, 1) * 65535)
        image = np.broadcast_to(_best_images(baked, corners)[:, None, None], (*corners.shape[:2], 1))
        samples = np.concatenate([position, image], -1).reshape(-1, 4).astype(np.uint16)
        samples, number = np.unique(samples, axis=0, return_inverse=True)
        first[level, :, 0], count[level, :, 0] = sum(map(len, indices)), number.size
        indices.append((number.ravel() + sum(map(len, vertices))).astype(np.uint32))
        vertices.append(samples)
    added = sum(map(len, vertices)) - len(grids.vertices)
    return replace(
        grids,
        vertices=np.concatenate(vertices),
        texels=np.concatenate([grids.texels, np.full((added, 2), -1, np.int16)]),
        indices=np.concatenate(indices),
        first=first,
        count=count,
        error=error,
    )


def _best_images(baked: BakedObject, corners: Array) -> Ints:
    """The image (t,), with PAST_AXIS, that best holds each triangle (t, 3, 3): where the samples at its middle and near
    its corners lie on it, are that face's own and are seen squarely."""
    middle = corners.mean(1, keepdims=True)
    probes = np.concatenate([middle, (middle + corners) / 2], 1)
    normal = face_normals(corners)[0]
    size = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max(1)[:, None]
    best, code = np.full(len(corners), np.inf), np.zeros(len(corners), np.int64)
    for face, past in [*((face, False) for face in Face), (Face.SIDE, True)]:
        row, column, depth, facing = _seen_from(baked, face, past, probes, normal)
        for image in (image for image in baked.images if image.face is face):
            found = image.depth[row, column]
            off = np.minimum(np.abs(np.minimum(found, 1e9 * size) - depth) * np.abs(facing) / size, 1)
            there = np.isfinite(found) & (np.einsum("tpi,ti->tp", image.normal[row, column], normal) > 0)
            cost = np.where(there, off, 1) + _ELSEWHERE * (image.owner[row, column] != face)
            total = (cost + _ASKEW * (1 - np.abs(facing))).sum(1)
            better = total < best
            best[better], code[better] = total[better], (face << FACE_SHIFT) + image.layer + PAST_AXIS * past
    return code


def _seen_from(
    baked: BakedObject, face: Face, past: bool, point: Array, normal: Array
) -> tuple[Ints, Ints, Array, Array]:
    """Row, column and depth (t, p) at which a face, or the side past the axis, has points (t, p, 3); and the cosines
    (t, p) at which it sees normals (t, 3) there."""
    cylinder, (height, width) = baked.cylinder, baked.images[0].depth.shape
    turned = (point * (-1, 1, -1) if past else point).reshape(-1, 3)
    u, v = image_position(cylinder, face, turned)
    origin, direction = surface_rays(cylinder, face, u, v)
    shape = point.shape[:2]
    depth = np.einsum("ni,ni->n", point.reshape(-1, 3) - origin, direction).reshape(shape)
    facing = -np.einsum("tpi,ti->tp", direction.reshape(point.shape), normal)
    row, column = ((at * count).astype(int).clip(0, count - 1) for at, count in ((v, height), (u, width)))
    return row.reshape(shape), column.reshape(shape), depth, facing
