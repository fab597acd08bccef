"""How well depth images would sample a surface, judged before any is made, by points that are spread over it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.baker import BakeParams, peeled_layers
from depthwalk.bake.images import FLANKS, Cylinder, Face, face_reach, image_position, surface_rays
from depthwalk.bake.ownership import footprints
from depthwalk.bake.placement import Placement
from depthwalk.bake.raycast import Hits, RayCaster
from depthwalk.ingest.mesh import Mesh
from depthwalk.limits import MAX_DPCI_LAYERS
from depthwalk.scene.arrays import Takes
from depthwalk.types import Array

_DIRECTIONS = 64  # in which it is tried whether a point can be seen
_WORST = 256.0  # texels²: what no image holds counts as so large a footprint
_SAME = 1e-3  # radii: how far a hit may be from a probe that lies there


@dataclass(frozen=True)
class Probes(Takes):
    """n points spread evenly over a surface.

    point: (n, 3) metres; normal: (n, 3), unit; weight: (n,) part, by the cosine, of the directions above the surface
    from which the point is seen.
    """

    point: Array
    normal: Array
    weight: Array

    def __len__(self) -> int:
        return len(self.point)

    def principal_axes(self) -> NDArray[np.float64]:
        """Unit directions (3, 3), rows, along which the points spread least to most."""
        return np.linalg.eigh(np.cov(self.point.T))[1].T


def probe(mesh: Mesh, caster: RayCaster, count: int) -> Probes:
    """`count` points of `mesh`, always the same; of an open one the side counts that is seen more."""
    point, normal = sample_surface(mesh, count)
    weight = _openness(caster, point, normal)
    if caster.two_sided:
        behind = _openness(caster, point, -normal)
        normal = np.where((behind > weight)[:, None], -normal, normal)
        weight = np.maximum(weight, behind)
    return Probes(point, normal, weight)


def sampled_footprints(
    caster: RayCaster,
    probes: Probes,
    placement: Placement,
    cylinder: Cylinder,
    params: BakeParams,
    part: NDArray[np.bool_] | None = None,
) -> NDArray[np.float64]:
    """The least footprint (n,), metres, with which a face of `cylinder` would hold each probe; +inf where none would.

    Images are baked by `params`, of the mesh's faces `part` (f,) alone if given. Probes and what
    `caster` casts at are in the asset's frame, the cylinder at `placement` in it.
    """
    point, normal = placement.into_object(probes.point), placement.turned_into_object(probes.normal)
    faces = [face for face in Face if face not in FLANKS or params.method != "six-view"]  # which makes no flanks
    shape = (params.resolution, params.resolution)
    size = np.stack([footprints(cylinder, face, shape, point, normal) for face in faces])
    number, which = np.isfinite(size).nonzero()
    rays = [surface_rays(cylinder, face, *image_position(cylinder, face, point)) for face in faces]
    origin, direction = (np.stack(each)[number, which] for each in zip(*rays, strict=True))
    depth = np.linalg.norm(point[which] - origin, axis=1)
    wanted = peeled_layers(params, caster)
    hits = caster.peel(
        placement.into_asset(origin),
        placement.rotation.apply(direction).astype(np.float32),
        wanted if part is None else MAX_DPCI_LAYERS,
        max(face_reach(cylinder, face) for face in faces),
    )
    same = np.abs(hits.distance - depth) < _SAME * cylinder.radius
    held = (same & _within(hits, wanted, part)).any(0)
    size[number[~held], which[~held]] = np.inf
    return size.min(0)


def squared_texels(footprint: Array, texel: float) -> NDArray[np.float64]:
    """Footprints (n,) squared, in texels² and bounded. texel: metres."""
    return np.minimum((footprint / texel) ** 2, _WORST)


def sample_surface(mesh: Mesh, count: int) -> tuple[Array, Array]:
    """Points (count, 3) spread evenly over the surface, always the same, and its unit normals (count, 3) there."""
    return sample_triangles(mesh.positions[mesh.faces].astype(np.float64), count)


def sample_triangles(corners: Array, count: int) -> tuple[Array, Array]:
    """Points (count, 3) spread evenly over triangles (n, 3, 3), and the unit normals (count, 3) there."""
    normals, areas = face_normals(corners)
    random = np.random.default_rng(0)
    ends = np.cumsum(areas)
    face = np.searchsorted(ends, (np.arange(count) + random.random(count)) / count * ends[-1]).clip(0, len(ends) - 1)
    u, v = random.random((2, count))
    over = u + v > 1
    u, v = np.where(over, 1 - u, u)[:, None], np.where(over, 1 - v, v)[:, None]
    a, b, c = corners[face].transpose(1, 0, 2)
    return a + u * (b - a) + v * (c - a), normals[face]


def face_normals(corners: Array) -> tuple[Array, Array]:
    """Unit normals (n, 3) and areas (n,) of triangles (n, 3, 3)."""
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(cross, axis=1)
    return cross / np.maximum(doubled, 1e-300)[:, None], doubled / 2


def spread_directions(count: int) -> NDArray[np.float64]:
    """Unit vectors (count, 3) spread evenly over the sphere, from +Y down to −Y: a Fibonacci lattice."""
    number = np.arange(count)
    y = 1 - (2 * number + 1) / count
    turn, level = np.pi * (1 + 5**0.5) * number, np.sqrt(1 - y**2)
    return np.stack([level * np.cos(turn), y, level * np.sin(turn)], -1)


def _within(hits: Hits, layers: int, part: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    """Which hits (L, n) are among the first `layers` of their ray, of those on faces of `part` (f,)."""
    counts = hits.face >= 0 if part is None else (hits.face >= 0) & part[hits.face]
    return counts & (np.cumsum(counts, axis=0) <= layers)


def _openness(caster: RayCaster, point: Array, normal: Array) -> NDArray[np.float64]:
    """Part (n,), by the cosine, of the directions above points (n, 3) in which nothing hides them from afar."""
    toward = spread_directions(_DIRECTIONS)
    start = np.repeat(point + 10 * caster.epsilon * normal, len(toward), axis=0)
    free = caster.escapes(start, np.tile(toward, (len(point), 1))).reshape(len(point), -1)
    cosine = np.maximum(normal @ toward.T, 0)
    return (free * cosine).sum(1) / cosine.sum(1)
