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
    u, v: (n,) float32, barycentric weights of the face's second and third corner; flipped: (n,) bool, the surface
    was hit from behind."""

    distance: NDArray[np.float32]
    face: NDArray[np.int32]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    flipped: NDArray[np.bool_]


class RayCaster:
    """A mesh ready to be hit by rays."""

    def __init__(self, mesh: Mesh) -> None:
        low, high = mesh.bounds
        self._epsilon = float(np.linalg.norm(high - low)) * 2e-6  # a ray restarts this far behind its last hit
        self._scene = EmbreeScene()
        TriangleMesh(self._scene, np.ascontiguousarray(mesh.positions), np.ascontiguousarray(mesh.faces))

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
            face, u, v, facing = (result[k][alive] for k in ("primID", "u", "v", "Ng"))
            back = np.einsum("ij,ij->i", facing, direction[active]) > 0
            taken = ~back | (cast == 0)
            for layer in range(layers):
                here = taken & (found[active] == layer)
                rays = active[here]
                hits[layer].distance[rays] = distance[here]
                hits[layer].face[rays] = face[here]
                hits[layer].u[rays], hits[layer].v[rays] = u[here], v[here]
                hits[layer].flipped[rays] = back[here]
            found[active] += taken
            travelled[active] = distance + self._epsilon
            active = active[found[active] < layers]
        return hits


def _no_hits(count: int) -> Hits:
    zeros = np.zeros(count, np.float32)
    return Hits(
        np.full(count, np.inf, np.float32), np.full(count, -1, np.int32), zeros, zeros.copy(), np.zeros(count, bool)
    )


def _join(parts: list[Hits]) -> Hits:
    fields = ("distance", "face", "u", "v", "flipped")
    return Hits(*(np.concatenate([getattr(part, name) for part in parts]) for name in fields))
