"""Divide a mesh into a hierarchy of clusters, from which each view selects those that are just fine enough.

Neighbouring clusters of triangles are put into groups; each group is simplified to half of its triangles, with its
border unchanged, and divided into clusters again; these are grouped differently, and so on, until one cluster is left
(Ponchio and Cignoni 2005, "Batched Multi Triangulation"; Karis, Stubbe and Wihlidal 2021, "A Deep Dive into Nanite").
The clusters before and after the simplification of a group have the same border. Either may therefore be drawn beside
any neighbour without cracks, as long as all clusters of a group are exchanged together.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook import kernels
from depthwalk.cook.cluster_division import NORMAL_PLACE, divided
from depthwalk.cook.cluster_error import Probes
from depthwalk.cook.cluster_output import Output, no_clusters
from depthwalk.cook.cluster_table import Clusters, Groups, cluster_bounds, enclosing
from depthwalk.cook.group_simplification import COLOURS, NORMALS, Batch, Surface, shared_places, simplify
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.geometry.distinct import sorted_distinct
from depthwalk.geometry.spatial_order import kd_tree_order, within_runs
from depthwalk.geometry.triangles import row_ids
from depthwalk.ingest.mesh import Mesh
from depthwalk.parallel import Map, thread_map
from depthwalk.types import Ints, Mask

_GROUP = 32  # most clusters of a group
_FEWEST = 16  # triangles up to which a single cluster is not simplified
_STALLED = 2  # levels in a row without a simplified group, after which building ends
_BATCH = 1 << 16  # triangles that are simplified at a time


def build_clusters(mesh: Mesh) -> MeshClusters:
    """Build the hierarchy of clusters of a mesh.

    Parameters
    ----------
    mesh
        The mesh; it may have no faces, open edges, seams and several parts.

    Returns
    -------
    MeshClusters
        The clusters.
    """
    place, first = row_ids(mesh.positions + np.float32(0))  # −0 becomes 0
    corners = place.astype(np.int32)[mesh.faces]
    a, b, c = corners.T
    proper = (a != b) & (b != c) & (c != a)
    if not proper.any():
        return no_clusters()
    kernels.load_for(len(mesh.faces))
    with thread_map() as parallel:
        return _Builder(mesh, proper, place, first).build(parallel)


class _Builder:
    """Build the clusters of a mesh level by level, in a frame in which the mesh has size 1."""

    def __init__(self, mesh: Mesh, proper: Mask, place: Ints, first: Ints) -> None:
        """Take the triangles of `mesh` that are `proper`: their three corners differ.

        place: (v,) of each vertex of the mesh; first: (p,) a vertex at each place.
        """
        low, high = (bound.astype(np.float64) for bound in mesh.bounds)
        size = max(float((high - low).max()), 1e-30)
        part = np.repeat(np.arange(len(mesh.parts)), [part.face_count for part in mesh.parts])[proper]
        # One vertex for each part that uses it, so that borders between materials are preserved like seams.
        source, vertex_part, triangles = _vertices_by_part(mesh.faces[proper], part, len(mesh.positions))
        self._surface = Surface(
            point=((mesh.positions[first].astype(np.float64) - low) / size).astype(np.float32),
            place=place[source].astype(np.int32),
            part=vertex_part,
            look=np.hstack([mesh.normals[source], mesh.colours[source] / np.float32(255), mesh.uv[source]]),
            number=np.arange(len(source), dtype=np.uint32),
            triangles=triangles,
        )
        self._output = Output(mesh, source, low, size)
        self._random = np.random.default_rng(0)

    def build(self, parallel: Map) -> MeshClusters:
        """Return the clusters of all levels."""
        pool = self._leaves()
        triangles, of = self._surface.corners(), np.repeat(pool.number, pool.count)
        colours = self._surface.look[:, COLOURS]
        varied = colours[self._surface.triangles] if (colours != colours[0]).any() else np.zeros((0, 3, 3))
        normals = self._surface.look[self._surface.triangles, NORMALS]
        probes = Probes(self._surface.point, triangles, normals, varied, of, len(pool) // _GROUP)
        stalled = 0
        while stalled < _STALLED and (len(pool) > 1 or pool.count[0] > _FEWEST):
            before = self._output.groups
            pool = self._next_level(pool, probes, parallel)
            stalled = stalled + 1 if self._output.groups == before else 0
        return self._output.result()

    def _leaves(self) -> Clusters:
        """Divide the mesh itself into clusters, and sort its triangles by them."""
        surface = self._surface
        part = surface.part[surface.triangles[:, 0]]
        order, count = divided(surface.point, surface.corners(), part, np.zeros(len(part), np.int32))
        surface.triangles[:] = surface.triangles[order]
        bounds = cluster_bounds(surface.point, surface.corners(), count)
        clusters = Clusters(
            number=np.arange(len(count)),
            count=count,
            part=part[order][np.cumsum(count) - count].astype(np.int64),
            made_by=np.full(len(count), -1),
            error=np.zeros(len(count)),
            lod_centre=bounds.centre,
            lod_radius=bounds.radius,
            **bounds._asdict(),
        )
        self._output.add_clusters(clusters, surface.number[surface.triangles])
        return clusters

    def _next_level(self, pool: Clusters, probes: Probes, parallel: Map) -> Clusters:
        """Simplify clusters in groups, and sort the surface's triangles by the clusters that remain; return those."""
        member = self._neighbours(pool)
        probes.thin_out(int(member.max()) + 1)
        batches = self._simplified(pool, member, probes, parallel)
        simplified = np.concatenate([batch.simplified for batch in batches])
        if not simplified.any():
            return pool
        number = np.where(simplified, np.cumsum(simplified) - 1, -1)  # among the groups of this level
        member = number[member]
        old = pool.take(member >= 0)
        groups = enclosing(old, member[member >= 0])
        groups.error = np.maximum(groups.error, np.concatenate([batch.error for batch in batches])[simplified])
        new = self._new_clusters(batches, number, groups)
        kept = np.repeat(member < 0, pool.count)
        self._output.add_groups(groups, old.number, member[member >= 0])
        self._replace_surface(kept, batches, new)
        return Clusters.joined([pool.take(member < 0), new])

    def _neighbours(self, pool: Clusters) -> Ints:
        """Put neighbouring clusters into groups, different ones than before; return the group of each."""
        count = len(pool)
        turn, _ = np.linalg.qr(self._random.normal(size=(3, 3)))
        places = np.hstack([pool.centre @ turn, NORMAL_PLACE * pool.axis])
        size = -(-count // -(-count // _GROUP))
        group = np.empty(count, np.int64)
        group[kd_tree_order(places, size)] = np.arange(count) // size
        return group

    def _simplified(self, pool: Clusters, member: Ints, probes: Probes, parallel: Map) -> list[Batch]:
        """Return all groups, simplified in batches, and move the probes to their clusters.

        member: (n,) the group of each cluster of the pool.
        """
        surface = self._surface
        locked = shared_places(surface, np.repeat(member.astype(np.int32), pool.count))
        first = np.cumsum(pool.count) - pool.count
        group_of = np.full(int(pool.number.max()) + 1, -1)
        group_of[pool.number] = member
        probe_group = group_of[probes.cluster]
        probe_order = np.argsort(probe_group, kind="stable")
        cluster_order = np.argsort(member, kind="stable")
        ends = _batch_ends(np.bincount(member, pool.count).astype(np.int64))

        def simplified(batch: tuple[int, int]) -> Batch:
            clusters = cluster_order[slice(*np.searchsorted(member[cluster_order], batch))]
            count = pool.count[clusters]
            rows = np.repeat(first[clusters], count)
            rows += within_runs(count)
            points = probe_order[slice(*np.searchsorted(probe_group[probe_order], batch))]
            return simplify(
                surface,
                rows,
                np.repeat(member[clusters] - batch[0], count),
                locked,
                probes.point[points],
                probes.normal[points],
                probes.colour[points] if len(probes.colour) else probes.colour,
                probe_group[points] - batch[0],
            )

        done = list(parallel(simplified, pairwise(ends)))
        moved, number = [], self._output.clusters
        for batch in done:
            moved.append(np.where(batch.probe >= 0, number + batch.probe, -1))
            number += len(batch.size)
        cluster = np.concatenate(moved)
        probes.cluster[probe_order] = np.where(cluster >= 0, cluster, probes.cluster[probe_order])
        return done

    def _new_clusters(self, batches: list[Batch], number: Ints, groups: Groups) -> Clusters:
        """Return the clusters of simplified groups. number: (g,) of each group, also of those that are not."""
        first = np.cumsum([0, *(len(batch.simplified) for batch in batches)])
        group = number[np.concatenate([begin + batch.group for begin, batch in zip(first, batches, strict=False)])]
        bounds = {
            name: np.concatenate([getattr(batch.bounds, name) for batch in batches])
            for name in ("centre", "radius", "axis", "sine")
        }
        return Clusters(
            number=self._output.clusters + np.arange(len(group)),
            count=np.concatenate([batch.size for batch in batches]),
            part=np.concatenate([batch.part for batch in batches]),
            made_by=self._output.groups + group,
            error=groups.error[group],
            lod_centre=groups.centre[group],
            lod_radius=groups.radius[group],
            **bounds,
        )

    def _replace_surface(self, kept: Mask, batches: list[Batch], new: Clusters) -> None:
        """Replace the surface by its `kept` triangles (t,) and the simplified ones, and output the new clusters."""
        old = self._surface
        vertices, places = len(old.place), len(old.point)
        first = vertices + np.cumsum([0, *(len(batch.vertex_place) for batch in batches)])
        first_place = places + np.cumsum([0, *(len(batch.point) for batch in batches)])
        coarse = [
            np.where(batch.triangles < vertices, batch.triangles, batch.triangles - vertices + begin).astype(np.int32)
            for begin, batch in zip(first, batches, strict=False)
        ]
        place = [batch.vertex_place + np.int32(begin) for begin, batch in zip(first_place, batches, strict=False)]
        number = self._output.add_vertices([batch.point[batch.vertex_place] for batch in batches], batches)
        whole = Surface(
            point=np.concatenate([old.point, *(batch.point for batch in batches)]),
            place=np.concatenate([old.place, *place]),
            part=np.concatenate([old.part, *(batch.vertex_part for batch in batches)]),
            look=np.concatenate([old.look, *(batch.vertex_look for batch in batches)]),
            number=np.concatenate([old.number, number]),
            triangles=np.concatenate([old.triangles[kept], *coarse]),
        )
        simplified = whole.triangles[int(kept.sum()) :]
        self._output.add_clusters(new, whole.number[simplified])
        self._surface = _compact(whole)


def _vertices_by_part(
    faces: NDArray[np.int32], part: Ints, count: int
) -> tuple[Ints, NDArray[np.int32], NDArray[np.int32]]:
    """Return a vertex for each that a part uses: its row (v,) in the mesh, its part (v,), and triangles of those.

    faces: (t, 3) of `count` vertices; part: (t,) ascending.
    """
    sources, parts, triangles, total = [], [], [], 0
    new = np.empty(count, np.int32)
    begins = np.flatnonzero(np.diff(part, prepend=-1))
    for begin, end in zip(begins, [*begins[1:], len(part)], strict=True):
        used = sorted_distinct(faces[begin:end])
        new[used] = total + np.arange(len(used))
        triangles.append(new[faces[begin:end]])
        sources.append(used)
        parts.append(np.full(len(used), part[begin], np.int32))
        total += len(used)
    return np.concatenate(sources), np.concatenate(parts), np.concatenate(triangles)


def _batch_ends(count: Ints) -> list[int]:
    """Return the first group of each batch of groups with `count` (g,) triangles, and the number of groups."""
    batch = np.cumsum(count) // _BATCH
    return [*np.flatnonzero(np.diff(batch, prepend=-1)).tolist(), len(count)]


def _compact(surface: Surface) -> Surface:
    """Return a surface without the vertices and places that no triangle uses."""
    used, triangles = _left(surface.triangles, len(surface.place))
    at, place = _left(surface.place[used], len(surface.point))
    return Surface(
        point=surface.point[at],
        place=place,
        part=surface.part[used],
        look=surface.look[used],
        number=surface.number[used],
        triangles=triangles,
    )


def _left(rows: NDArray[np.int32], count: int) -> tuple[Ints, NDArray[np.int32]]:
    """Return which of `count` numbers occur, ascending, and each as a row of those."""
    found = np.zeros(count, bool)
    found[rows] = True
    new = np.cumsum(found, dtype=np.int32) - np.int32(1)
    return np.flatnonzero(found), new[rows]
