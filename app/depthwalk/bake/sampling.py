"""Predict, before any image is made, how well depth images would sample a surface, from points spread over it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.baker import peeled_layers
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import BOX_FACES, Cylinder, Face
from depthwalk.bake.ownership import footprints
from depthwalk.bake.params import BakeParams
from depthwalk.bake.placement import Placement
from depthwalk.bake.raycast import Hits, RayCaster
from depthwalk.geometry.soa import StructOfArrays
from depthwalk.geometry.triangles import sample_triangles, spread_directions
from depthwalk.ingest.mesh import Mesh
from depthwalk.limits import MAX_DPCI_LAYERS
from depthwalk.types import Array

_DIRECTIONS = 64  # in which to test whether a point can be seen
_WORST = 256.0  # texels²: footprint assigned to what no image holds
_SAME = 1e-3  # radii: how far a hit may be from a probe and still count as hitting it


@dataclass(frozen=True, kw_only=True)
class Probes(StructOfArrays):
    """Hold n points spread evenly over a surface.

    Attributes
    ----------
    point
        (n, 3) metres, asset frame.
    normal
        (n, 3) unit normals, asset frame.
    weight
        (n,) 0 to 1: the part of the directions above the surface from which the point is visible, weighted by the
        cosine to the normal.
    """

    point: Array
    normal: Array
    weight: Array

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.point)

    def principal_axes(self) -> NDArray[np.float64]:
        """Return the principal axes (3, 3) of the points: unit rows, from the axis of least spread to that of most."""
        return np.linalg.eigh(np.cov(self.point.T))[1].T


def probe(mesh: Mesh, caster: RayCaster, count: int) -> Probes:
    """Spread points over a mesh, the same points each time.

    If the rays of `caster` hit both sides, as with an open mesh, normals point to the side from which more is visible.

    Parameters
    ----------
    mesh
        The mesh, asset frame.
    caster
        The same mesh, ready for ray casting.
    count
        Number of points.

    Returns
    -------
    Probes
        The points, with their normals and weights.
    """
    point, normal = sample_surface(mesh, count)
    weight = _openness(caster, point, normal)
    if caster.two_sided:
        behind = _openness(caster, point, -normal)
        normal = np.where((behind > weight)[:, None], -normal, normal)
        weight = np.maximum(weight, behind)
    return Probes(point=point, normal=normal, weight=weight)


def sampled_footprints(
    caster: RayCaster,
    probes: Probes,
    placement: Placement,
    cylinder: Cylinder,
    params: BakeParams,
    part: NDArray[np.bool_] | None = None,
) -> NDArray[np.float64]:
    """Measure how finely the images of a cylinder would sample a surface, without baking them.

    Parameters
    ----------
    caster
        The whole mesh, which may hide parts of the surface, asset frame.
    probes
        Points of the surface, asset frame.
    placement
        The frame of the cylinder in the asset's.
    cylinder
        The volume that the images would enclose, in the frame of `placement`, metres.
    params
        How the images would be baked.
    part
        (F,) bool: the only faces of the mesh that would be baked; None: all of them.

    Returns
    -------
    numpy.ndarray
        (n,) metres: the smallest footprint with which a face would hold each probe; +inf if no face would.
    """
    count = peeled_layers(params, caster)
    (footprint,) = footprints_by_layers(caster, probes, placement, cylinder, params, [count], part)
    return footprint


def footprints_by_layers(
    caster: RayCaster,
    probes: Probes,
    placement: Placement,
    cylinder: Cylinder,
    params: BakeParams,
    layers: Sequence[int],
    part: NDArray[np.bool_] | None = None,
) -> list[NDArray[np.float64]]:
    """Measure the same as `sampled_footprints` for several numbers of surfaces along each ray, with the same rays.

    Parameters
    ----------
    caster, probes, placement, cylinder, params, part
        See `sampled_footprints`; `params.layers` is ignored.
    layers
        How many surfaces along each ray become layers, as `peeled_layers` returns it.

    Returns
    -------
    list
        For each of `layers`, (n,) metres.
    """
    point, normal = placement.into_object(probes.point), placement.turned_into_object(probes.normal)
    faces = [face for face in Face if face not in BOX_FACES or not params.by_six_views]  # six views have no box faces
    side = params.resolution
    grids = [FaceGrid(cylinder=cylinder, face=face, height=side, width=side) for face in faces]
    seen_from = [grid.project(point) for grid in grids]
    size = np.stack([footprints(grid, seen, normal) for grid, seen in zip(grids, seen_from, strict=True)])
    number, which = np.isfinite(size).nonzero()
    origin = np.stack([seen.origin for seen in seen_from])[number, which]
    direction = np.stack([seen.direction for seen in seen_from])[number, which]
    depth = np.linalg.norm(point[which] - origin, axis=1)
    hits = caster.peel(
        placement.into_asset(origin),
        placement.rotation.apply(direction).astype(np.float32),
        max(layers) if part is None else MAX_DPCI_LAYERS,
        max(grid.max_depth for grid in grids),
    )
    same = np.abs(hits.distance - depth) < _SAME * cylinder.radius
    found = []
    for count in layers:
        held = (same & _within(hits, count, part)).any(0)
        seen = size.copy()
        seen[number[~held], which[~held]] = np.inf
        found.append(seen.min(0))
    return found


def squared_texels(footprint: Array, texel: float) -> NDArray[np.float64]:
    """Return squared footprints, clamped so that a few very coarse samples do not outweigh all others.

    Parameters
    ----------
    footprint
        (n,) metres; +inf where a probe is not held.
    texel
        Side of a texel, metres.

    Returns
    -------
    numpy.ndarray
        (n,) texels².
    """
    return np.asarray(np.minimum((footprint / texel) ** 2, _WORST))


def sample_surface(mesh: Mesh, count: int) -> tuple[Array, Array]:
    """Return `count` points (count, 3) spread evenly over `mesh`, metres, and its unit normals (count, 3) at them.

    The same arguments give the same points.
    """
    return sample_triangles(mesh.positions[mesh.faces].astype(np.float64), count)


def _within(hits: Hits, layers: int, part: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    """Return which hits (L, n) are among the first `layers` of their ray, counting only faces of `part` (F,)."""
    counts = hits.face >= 0 if part is None else (hits.face >= 0) & part[hits.face]
    return counts & (np.cumsum(counts, axis=0) <= layers)


def _openness(caster: RayCaster, point: Array, normal: Array) -> NDArray[np.float64]:
    """Return the part (n,), cosine-weighted, of the directions above points (n, 3) in which nothing hides them."""
    toward = spread_directions(_DIRECTIONS)
    start = np.repeat(point + 10 * caster.epsilon * normal, len(toward), axis=0)
    free = caster.escapes(start, np.tile(toward, (len(point), 1))).reshape(len(point), -1)
    cosine = np.maximum(normal @ toward.T, 0)
    return np.asarray((free * cosine).sum(1) / cosine.sum(1))
