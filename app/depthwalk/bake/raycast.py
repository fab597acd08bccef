"""Depth peeling with embreex: the front-facing hits along each ray, in order."""

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from depthwalk.ingest.mesh import Mesh

_BATCH = 1 << 18  # rays per call: bounds the memory of the hit records (about 10 MB)


@dataclass(frozen=True)
class Hits:
    """The k-th hit of n rays. distance: (n,) float32, +inf where there is none; face: (n,) int32, −1 likewise;
    u, v: (n,) float32, barycentric weights of the face's second and third corner; normal: (n, 3) float32, the face's
    own, unit, turned toward the ray's origin; flipped: (n,) bool, the surface was hit from behind."""

    distance: NDArray[np.float32]
    face: NDArray[np.int32]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    normal: NDArray[np.float32]
    flipped: NDArray[np.bool_]


@dataclass(frozen=True)
class FirstHits:
    """What n rays meet first. distance: (n,) float32, +inf for nothing; normal: (n, 3) float32, the face's own, unit,
    turned toward the ray's origin; flipped: (n,) bool, it was hit from behind."""

    distance: NDArray[np.float32]
    normal: NDArray[np.float32]
    flipped: NDArray[np.bool_]


class RayCaster:
    """A mesh ready to be hit by rays."""

    def __init__(self, mesh: Mesh) -> None:
        low, high = mesh.bounds
        self._epsilon = float(np.linalg.norm(high - low)) * 2e-6  # a ray restarts this far behind its last hit
        self._scene = EmbreeScene()
        TriangleMesh(self._scene, np.ascontiguousarray(mesh.positions), np.ascontiguousarray(mesh.faces))

    def first(self, origin: NDArray[np.floating], direction: NDArray[np.floating]) -> FirstHits:
        """What rays (n, 3), (n, 3) meet first, from either side."""
        rays = [np.ascontiguousarray(part, np.float32) for part in (origin, direction)]
        result = self._scene.run(*rays, query="INTERSECT", output=True)
        distance = np.where(result["primID"] >= 0, result["tfar"], np.float32(np.inf))
        normal, flipped = facing_normals(result["Ng"], rays[1])
        return FirstHits(distance, normal, flipped)

    def peel(
        self, origin: NDArray[np.float32], direction: NDArray[np.float32], layers: int, reach: float
    ) -> list[Hits]:
        """The first `layers` surfaces along rays (n, 3), (n, 3) that face their origin, within `reach` metres.

        The very first surface counts from either side: an open mesh (a scan with holes, a leaf) has no inside.
        """
        batches = range(0, max(len(origin), 1), _BATCH)
        parts = [self._peel(origin[k : k + _BATCH], direction[k : k + _BATCH], layers, reach) for k in batches]
        return [_join([part[layer] for part in parts]) for layer in range(layers)]

    def _peel(
        self, origin: NDArray[np.float32], direction: NDArray[np.float32], layers: int, reach: float
    ) -> list[Hits]:
        count = len(origin)
        hits = [_no_hits(count) for _ in range(layers)]
        active = np.arange(count)
        travelled = np.zeros(count, np.float32)
        found = np.zeros(count, np.int32)
        # Every front face has a back face behind it; 2 · layers casts find all layers of a closed mesh, and twice
        # as many get past doubled or coplanar faces.
        for cast in range(4 * layers):
            if not len(active):
                break
            start = origin[active] + travelled[active, None] * direction[active]
            result = self._scene.run(start, direction[active], query="INTERSECT", output=True)
            distance = travelled[active] + result["tfar"]
            alive = (result["primID"] >= 0) & (distance < reach)
            active, distance = active[alive], distance[alive]
            face, u, v = (result[k][alive] for k in ("primID", "u", "v"))
            normal, back = facing_normals(result["Ng"][alive], direction[active])
            taken = ~back | (cast == 0)
            for layer in range(layers):
                here = taken & (found[active] == layer)
                rays = active[here]
                hits[layer].distance[rays] = distance[here]
                hits[layer].face[rays] = face[here]
                hits[layer].u[rays], hits[layer].v[rays] = u[here], v[here]
                hits[layer].normal[rays], hits[layer].flipped[rays] = normal[here], back[here]
            found[active] += taken
            travelled[active] = distance + self._epsilon
            active = active[found[active] < layers]
        return hits


def facing_normals(
    normal: NDArray[np.float32], direction: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Normals (n, 3) made unit and turned against ray directions (n, 3), and which (n,) had to be turned."""
    flipped = np.einsum("ij,ij->i", normal, direction) > 0
    length = np.maximum(np.linalg.norm(normal, axis=1), np.float32(1e-30))
    return normal / np.where(flipped, -length, length)[:, None], flipped


def _no_hits(count: int) -> Hits:
    zeros = np.zeros(count, np.float32)
    normal = np.zeros((count, 3), np.float32)
    nowhere = np.full(count, np.inf, np.float32)
    return Hits(nowhere, np.full(count, -1, np.int32), zeros, zeros.copy(), normal, np.zeros(count, bool))


def _join(parts: list[Hits]) -> Hits:
    fields = ("distance", "face", "u", "v", "normal", "flipped")
    return Hits(*(np.concatenate([getattr(part, name) for part in parts]) for name in fields))
