"""Cast rays at a mesh with Embree, and find successive surfaces along each ray: depth peeling."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.cut_outs import cut_outs
from depthwalk.geometry.triangles import row_ids
from depthwalk.geometry.vectors import lengths
from depthwalk.ingest.mesh import Mesh
from depthwalk.parallel import Map, batches
from depthwalk.types import Array, Mask

_BATCH = 1 << 15  # rays per call: their data stays in the CPU's cache
_MOST_CUT_OUTS = 64  # cut-out points that a ray passes; there are some ten along a ray through a tree of cards


@dataclass(frozen=True, kw_only=True)
class Hits:
    """Hold up to L hits along each of n rays, nearest first.

    Attributes
    ----------
    distance
        (L, n) float32, metres along the ray, +inf without a hit.
    face
        (L, n) int32, the triangle that was hit, −1 without a hit.
    u, v
        (L, n) float32, barycentric weights of the second and third corner of the triangle.
    normal
        (L, n, 3) float32, mesh's frame: unit normal of the triangle, turned toward the ray's origin.
    flipped
        (L, n) bool, True where the surface was hit from behind.
    """

    distance: NDArray[np.float32]
    face: NDArray[np.int32]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    normal: NDArray[np.float32]
    flipped: NDArray[np.bool_]

    def __len__(self) -> int:
        """Return the number of layers L."""
        return len(self.distance)


@dataclass(frozen=True, kw_only=True)
class FirstHits:
    """Hold the first hit of each of n rays.

    Attributes
    ----------
    distance
        (n,) float32, metres along the ray, +inf for rays that hit nothing.
    normal
        (n, 3) float32, mesh's frame: unit normal of the triangle, turned toward the ray's origin.
    flipped
        (n,) bool, True where the surface was hit from behind.
    """

    distance: NDArray[np.float32]
    normal: NDArray[np.float32]
    flipped: NDArray[np.bool_]


class RayCaster:
    """Cast rays at a mesh, with Embree.

    Attributes
    ----------
    epsilon
        How far behind a hit the next ray starts, metres.
    two_sided
        Whether surfaces are visible from behind too, as in an open mesh.
    front_only
        Whether `peel` passes through surfaces that it hits from behind before it has hit any other.
    """

    def __init__(self, mesh: Mesh, two_sided: bool | None = None, front_only: bool = False) -> None:
        """Build Embree's search tree of a mesh.

        Parameters
        ----------
        mesh
            The mesh; rays are in its frame, metres.
        two_sided
            Whether surfaces are visible from behind too; None: only those of an open mesh, or of one with cut-outs.
        front_only
            Whether `peel` passes through surfaces that it hits from behind before it has hit any other, such as the
            walls of a room that is seen from inside. Not together with `two_sided`.
        """
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        low, high = mesh.bounds
        self.epsilon = float(np.linalg.norm(high - low)) * 2e-6
        self._cut_outs = cut_outs(mesh)
        self.two_sided = (is_open(mesh) or self._cut_outs is not None) if two_sided is None else two_sided
        self.front_only = front_only
        self._scene = EmbreeScene()
        TriangleMesh(self._scene, np.ascontiguousarray(mesh.positions), np.ascontiguousarray(mesh.faces))
        self.escapes(np.zeros((0, 3)), np.zeros((0, 3)))  # builds Embree's tree, which two threads must not do at once

    def first(self, origin: NDArray[np.floating], direction: NDArray[np.floating]) -> FirstHits:
        """Return the first hit of each ray, from either side.

        Parameters
        ----------
        origin
            (n, 3) metres, in the mesh's frame.
        direction
            (n, 3) unit vectors, in the mesh's frame.

        Returns
        -------
        FirstHits
            n hits.
        """
        rays = _single(origin), _single(direction)
        result = self._scene.run(*rays, query="INTERSECT", output=True)
        distance = np.where(result["primID"] >= 0, result["tfar"], np.float32(np.inf))
        normal = result["Ng"]
        if self._cut_outs is not None:
            distance, normal = self._past_cut_outs(*rays, result)
        normal, flipped = facing_normals(normal, rays[1])
        return FirstHits(distance=distance, normal=normal, flipped=flipped)

    def _past_cut_outs(
        self, origin: NDArray[np.float32], direction: NDArray[np.float32], result: dict[str, Any]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return distances (n,), metres, and normals (n, 3) of the first hits where the surface is not cut out.

        result: the first hits anywhere; rays that hit a cut-out point are continued from there.
        """
        distance = np.where(result["primID"] >= 0, result["tfar"], np.float32(np.inf))
        normal = np.array(result["Ng"])
        rays, face, u, v = np.arange(len(origin)), result["primID"], result["u"], result["v"]
        for _ in range(_MOST_CUT_OUTS):
            cut = (face >= 0) & ~self._solid(face, u, v)
            rays = rays[cut]
            if not len(rays):
                break
            begin = distance[rays] + self.epsilon
            start, along = origin[rays] + begin[:, None] * direction[rays], direction[rays]
            result = self._scene.run(start, along, query="INTERSECT", output=True)
            face, u, v = result["primID"], result["u"], result["v"]
            distance[rays] = np.where(face >= 0, begin + result["tfar"], np.float32(np.inf))
            normal[rays] = result["Ng"]
        return distance, normal

    def _solid(self, face: NDArray[np.integer], u: Array, v: Array) -> Mask:
        """Return at which hits the surface is not cut out; rays that hit nothing, face −1, count as solid."""
        return np.ones(len(face), bool) if self._cut_outs is None else self._cut_outs.solid(face, u, v)

    def escapes(
        self, origin: NDArray[np.floating], direction: NDArray[np.floating], parallel_map: Map = map
    ) -> NDArray[np.bool_]:
        """Return which rays hit nothing.

        Parameters
        ----------
        origin
            (n, 3) metres, in the mesh's frame.
        direction
            (n, 3) vectors of any length, in the mesh's frame.
        parallel_map
            `map`, or what `thread_map` yields to work in several threads.

        Returns
        -------
        numpy.ndarray
            (n,) bool, True where a ray hits nothing.
        """

        def escapes(batch: slice) -> NDArray[np.bool_]:
            rays = _single(origin[batch]), _single(direction[batch])
            if self._cut_outs is not None:  # distances are measured, so directions must be unit vectors
                unit = rays[1] / np.maximum(lengths(rays[1]), np.float32(1e-30))[:, None]
                return np.isinf(self.first(rays[0], unit).distance)
            return np.asarray(self._scene.run(*rays, query="OCCLUDED") < 0)

        return np.concatenate(list(parallel_map(escapes, batches(len(origin), _BATCH))))

    def peel(
        self,
        origin: NDArray[np.float32],
        direction: NDArray[np.float32],
        layers: int,
        max_distance: float | NDArray[np.floating],
        parallel_map: Map = map,
    ) -> Hits:
        """Find the first surfaces along rays.

        The first surface counts from either side, unless `front_only` is set. Of the others, only those that face the
        ray's origin count; in an open mesh, all do.

        Parameters
        ----------
        origin, direction
            (n, 3) float32, mesh's frame: where the rays start, metres, and unit vectors along them.
        layers
            Most surfaces to find along each ray.
        max_distance
            Length of the rays, metres: (n,), or one number for all.
        parallel_map
            `map`, or what `thread_map` yields to work in several threads.

        Returns
        -------
        Hits
            L = `layers` hits along each ray, the nearest first.
        """
        limit = np.broadcast_to(np.asarray(max_distance, np.float32), len(origin))

        def peel(batch: slice) -> Hits:
            return self._peel(origin[batch], direction[batch], layers, limit[batch])

        return join_hits(list(parallel_map(peel, batches(len(origin), _BATCH))))

    def _peel(
        self, origin: NDArray[np.float32], direction: NDArray[np.float32], layers: int, limit: NDArray[np.float32]
    ) -> Hits:
        count = len(origin)
        hits = no_hits(layers, count)
        active = np.arange(count)
        travelled = np.zeros(count, np.float32)
        found = np.zeros(count, np.int32)
        # Every front face has a back face behind it: 2 · layers casts find all layers of a closed mesh, and twice that
        # gets past doubled or coplanar faces.
        for cast in range(4 * layers + (_MOST_CUT_OUTS if self._cut_outs is not None else 0)):
            if not len(active):
                break
            along, begin, end = direction.take(active, 0), travelled[active], limit[active]
            start = origin.take(active, 0) + begin[:, None] * along
            result = self._scene.run(start, along, end - begin + self.epsilon, query="INTERSECT", output=True)
            distance = begin + result["tfar"]
            met = np.flatnonzero((result["primID"] >= 0) & (distance < end))
            active, distance, along = active[met], distance[met], along.take(met, 0)
            normal, back = facing_normals(result["Ng"].take(met, 0), along)
            chosen = (cast or self.front_only) and not self.two_sided
            taken = np.flatnonzero(~back) if chosen else np.arange(len(back))
            if self._cut_outs is not None:
                hit = met[taken]
                taken = taken[self._cut_outs.solid(result["primID"][hit], result["u"][hit], result["v"][hit])]
            rays, met = active[taken], met[taken]
            at = found[rays], rays
            hits.distance[at], hits.face[at] = distance[taken], result["primID"][met]
            hits.u[at], hits.v[at] = result["u"][met], result["v"][met]
            hits.normal[at], hits.flipped[at] = normal.take(taken, 0), back[taken]
            found[rays] += 1
            travelled[active] = distance + self.epsilon
            active = active[found[active] < layers]
        return hits


def is_open(mesh: Mesh) -> bool:
    """Return whether `mesh` is a shell with a boundary, not the skin of a solid: some edge has only one face."""
    welded, _ = row_ids(mesh.positions)
    faces = welded[mesh.faces]
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    count = np.unique(edges[:, 0] * np.int64(len(mesh.positions)) + edges[:, 1], return_counts=True)[1]
    return bool((count == 1).any())


def facing_normals(
    normal: NDArray[np.float32], direction: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return normals at unit length, turned toward the origins of rays.

    Parameters
    ----------
    normal
        (n, 3) float32, of any length above 0.
    direction
        (n, 3) float32, directions of the rays.

    Returns
    -------
    tuple
        The unit normals (n, 3) float32, and (n,) bool, True for those that were turned around.
    """
    flipped = np.einsum("ij,ij->i", normal, direction) > 0
    length = np.maximum(lengths(normal), np.float32(1e-30))
    return np.asarray(normal / np.where(flipped, -length, length)[:, None], np.float32), flipped


def join_hits(parts: Sequence[Hits]) -> Hits:
    """Concatenate the hits of several groups of rays, each with the same number of layers."""
    if len(parts) == 1:
        return parts[0]
    names = [field.name for field in fields(Hits)]
    return Hits(**{name: np.concatenate([getattr(part, name) for part in parts], 1) for name in names})


def no_hits(layers: int, count: int) -> Hits:
    """Return `layers` layers of empty hits along `count` rays: distance +inf, face −1, the rest 0."""
    shape = (layers, count)
    return Hits(
        distance=np.full(shape, np.inf, np.float32),
        face=np.full(shape, -1, np.int32),
        u=np.zeros(shape, np.float32),
        v=np.zeros(shape, np.float32),
        normal=np.zeros((*shape, 3), np.float32),
        flipped=np.zeros(shape, bool),
    )


def _single(vectors: NDArray[np.floating]) -> NDArray[np.float32]:
    return np.ascontiguousarray(vectors, np.float32)
