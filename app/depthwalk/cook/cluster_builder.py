"""Divide a mesh into a hierarchy of clusters, from which each view selects those that are just fine enough.

Neighbouring clusters of triangles are put into groups; each group is simplified to half of its triangles, with its
border unchanged, and divided into clusters again; these are grouped differently, and so on, until one cluster is left
(Ponchio and Cignoni 2005, "Batched Multi Triangulation"; Karis, Stubbe and Wihlidal 2021, "A Deep Dive into Nanite").
The clusters before and after the simplification of a group have the same border. Either may therefore be drawn beside
any neighbour without cracks, as long as all clusters of a group are exchanged together.
"""

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cluster_error import Probes
from depthwalk.cook.group_collapse import collapse_groups
from depthwalk.cook.mesh_clusters import SIZE, MeshClusters
from depthwalk.cook.quadrics import clustered_surface
from depthwalk.cook.seamed_mesh import Places, Vertices
from depthwalk.geometry.indexed_triangles import vertex_directions
from depthwalk.geometry.soa import StructOfArrays
from depthwalk.geometry.spatial_order import kd_tree_order
from depthwalk.geometry.triangles import face_normals, row_ids
from depthwalk.ingest.mesh import Mesh
from depthwalk.ingest.solid import is_solid
from depthwalk.types import Array, Ints, Mask

_GROUP = 32  # most clusters of a group
_FEWEST = 16  # triangles up to which a single cluster is not simplified
_NORMAL_PLACE = 0.02  # distance, relative to the mesh's size, that a difference of 1 between normals counts as
_PROGRESS = 0.85  # part of a group's triangles: if more are left, its clusters are grouped differently next time
_STALLED = 2  # levels in a row without a simplified group, after which building ends


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
    corners = mesh.positions[mesh.faces]
    a, b, c = corners.transpose(1, 0, 2)
    proper = np.logical_and.reduce([(one != other).any(1) for one, other in ((a, b), (b, c), (c, a))])
    return _Builder(mesh, proper).build() if proper.any() else _nothing()


@dataclass(kw_only=True)
class _Clusters(StructOfArrays):
    """Hold n clusters.

    number: (n,) among all clusters; count: (n,) triangles of each; part, made_by, centre, radius, axis, sine: as in
    `MeshClusters`, but in the builder's frame; error, lod_centre, lod_radius: those of the groups that made them, or
    for the mesh itself 0 and the bounding spheres.
    """

    number: Ints
    count: Ints
    part: Ints
    made_by: Ints
    centre: Array
    radius: Array
    axis: Array
    sine: Array
    error: Array
    lod_centre: Array
    lod_radius: Array

    def __len__(self) -> int:
        return len(self.number)


@dataclass(kw_only=True)
class _Groups(StructOfArrays):
    """Hold g groups: their distance from the mesh once they are simplified, and their spheres."""

    error: Array
    centre: Array
    radius: Array

    def __len__(self) -> int:
        return len(self.error)


class _Builder:
    """Build the clusters of a mesh level by level, in a frame in which the mesh has size 1."""

    def __init__(self, mesh: Mesh, proper: Mask) -> None:
        """Take the triangles of `mesh` that are `proper`: their three corners differ."""
        low, high = (bound.astype(np.float64) for bound in mesh.bounds)
        self._low, self._size = low, max(float((high - low).max()), 1e-30)
        place, first = row_ids(mesh.positions + np.float32(0))  # −0 becomes 0
        point = (mesh.positions[first].astype(np.float64) - low) / self._size
        part = np.repeat(np.arange(len(mesh.parts)), [part.face_count for part in mesh.parts])
        faces, part = mesh.faces[proper].astype(np.int64), part[proper]
        # One vertex for each part that uses it, so that borders between materials are preserved like seams.
        corner_ids, corners = row_ids(np.stack([faces.ravel(), np.repeat(part, 3)], -1))
        source = faces.ravel()[corners]
        self._leaves = corner_ids.reshape(-1, 3)
        self._mesh, self._source = mesh, source
        look = np.hstack([mesh.normals[source], mesh.colours[source] / 255, mesh.uv[source]]).astype(np.float64)
        self._vertices = Vertices(place=place[source], part=np.repeat(part, 3)[corners], look=look)
        surface = clustered_surface(point, self._vertices.place[self._leaves])
        normal = vertex_directions(point, self._vertices.place[self._leaves])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        self._places = Places(point=point, normal=normal, quadric=surface.quadric, weight=surface.weight)
        self._random = np.random.default_rng(0)
        self._triangles: list[Ints] = []
        self._clusters: list[_Clusters] = []
        self._groups: list[_Groups] = []
        self._members: list[tuple[Ints, Ints]] = []  # numbers of clusters, and the groups that simplify them
        self._level_first = [0]

    def build(self) -> MeshClusters:
        """Return the clusters of all levels."""
        pool, triangles = self._divided(self._leaves, np.full(len(self._leaves), -1), None)
        probes = Probes(
            self._places.point, self._vertices.place[triangles], np.repeat(pool.number, pool.count), len(pool) // _GROUP
        )
        stalled = 0
        while stalled < _STALLED and (len(pool) > 1 or pool.count[0] > _FEWEST):
            before = len(self._groups)
            pool, triangles = self._next_level(pool, triangles, probes)
            stalled = stalled + 1 if len(self._groups) == before else 0
        return self._result()

    def _next_level(self, pool: _Clusters, triangles: Ints, probes: Probes) -> tuple[_Clusters, Ints]:
        """Simplify clusters, with their `triangles`, in groups; return the remaining clusters and triangles."""
        member = self._neighbours(pool)
        group = np.repeat(member, pool.count)
        before = np.bincount(group)
        coarse, of = self._simplified(triangles, group, before)
        simplified = np.bincount(of, minlength=len(before)) > 0
        if not simplified.any():
            return pool, triangles
        number = np.where(simplified, np.cumsum(simplified) - 1, -1)  # among the groups of this level
        member, group, of = number[member], number[group], number[of]
        first_group, old = self._level_first[-1], pool.take(member >= 0)
        groups = _enclosing(old, member[member >= 0])
        new, coarse = self._divided(coarse, of, groups)
        new_group = new.made_by - first_group
        group_of = np.full(int(pool.number.max()) + 1, -1)
        group_of[pool.number] = member
        corners = self._corners(coarse)
        error = probes.measure(
            group_of, len(groups), corners, np.repeat(new_group, new.count), np.repeat(new.number, new.count)
        )
        groups.error = np.maximum(groups.error, error)
        new.error = groups.error[new_group]
        self._groups.append(groups)
        self._members.append((old.number, first_group + member[member >= 0]))
        self._level_first.append(first_group + len(groups))
        kept = pool.take(member < 0)
        return _Clusters.joined([kept, new]), np.concatenate([triangles[group < 0], coarse])

    def _neighbours(self, pool: _Clusters) -> Ints:
        """Put neighbouring clusters into groups, different ones than before; return the group of each."""
        count = len(pool)
        turn, _ = np.linalg.qr(self._random.normal(size=(3, 3)))
        places = np.hstack([pool.centre @ turn, _NORMAL_PLACE * pool.axis])
        size = -(-count // -(-count // _GROUP))
        group = np.empty(count, np.int64)
        group[kd_tree_order(places, size)] = np.arange(count) // size
        return group

    def _divided(self, triangles: Ints, group: Ints, groups: "_Groups | None") -> tuple[_Clusters, Ints]:
        """Divide simplified groups, or the mesh itself, into new clusters; return them with their sorted triangles.

        triangles: (t, 3); group: (t,) rows of `groups`.
        """
        part = self._vertices.part[triangles[:, 0]]
        corners = self._corners(triangles)
        normal, _ = face_normals(corners)
        places = np.hstack([corners.mean(1), _NORMAL_PLACE * normal])
        order = np.lexsort((part, group))
        begins = np.flatnonzero(np.diff(group[order], prepend=-2) | np.diff(part[order], prepend=-1))
        counts, pieces = [], []
        for first, last in zip(begins, np.append(begins[1:], len(order)), strict=True):
            rows = order[first:last]
            size = -(-len(rows) // -(-len(rows) // SIZE))
            pieces.append(rows[kd_tree_order(places[rows], size)])
            counts += [size] * (len(rows) // size) + [len(rows) % size] * bool(len(rows) % size)
        rows, count = np.concatenate(pieces), np.array(counts)
        first = np.cumsum(count) - count
        sphere = _spheres(corners[rows], first)
        cone = _cones(normal[rows], first)
        made_by = group[rows][first]
        clusters = _Clusters(
            number=sum(map(len, self._clusters)) + np.arange(len(count)),
            count=count,
            part=part[rows][first],
            made_by=made_by if groups is None else made_by + self._level_first[-1],
            centre=sphere[0],
            radius=sphere[1],
            axis=cone[0],
            sine=cone[1],
            error=np.zeros(len(count)),  # errors of groups are measured later
            lod_centre=sphere[0] if groups is None else groups.centre[made_by],
            lod_radius=sphere[1] if groups is None else groups.radius[made_by],
        )
        self._clusters.append(clusters)
        self._triangles.append(triangles[rows])
        return clusters, triangles[rows]

    def _simplified(self, triangles: Ints, group: Ints, before: Ints) -> tuple[Ints, Ints]:
        """Return the triangles (n, 3) of groups that could be simplified, with new vertices where these moved.

        triangles: (t, 3); group: (t,) of each; before: (g,) triangles of each group. Returned with the groups (n,).
        """
        places, vertices = copy.deepcopy(self._places), copy.deepcopy(self._vertices)
        coarse, of, moved = collapse_groups(places, vertices, triangles, group, before // 2)
        good = (np.bincount(of, minlength=len(before)) <= _PROGRESS * before)[of]
        coarse, of = coarse[good], of[good]
        # Vertices that moved are added as new ones, since finer clusters still use the old ones.
        used = np.unique(coarse)
        used = used[moved[vertices.place[used]]]
        at = np.unique(vertices.place[used])
        new_place, new_vertex = np.arange(len(places.point)), np.arange(len(vertices.place))
        new_place[at] = len(new_place) + np.arange(len(at))
        new_vertex[used] = len(new_vertex) + np.arange(len(used))
        added = vertices.take(used)
        added.place = new_place[added.place]
        self._places.quadric[~moved], self._places.weight[~moved] = places.quadric[~moved], places.weight[~moved]
        self._places = Places.joined([self._places, places.take(at)])
        self._vertices = Vertices.joined([self._vertices, added])
        return new_vertex[coarse], of

    def _corners(self, triangles: Ints) -> Array:
        return self._places.point[self._vertices.place[triangles]]

    def _result(self) -> MeshClusters:
        """Return the finished clusters, in the frame and with the vertices of the mesh."""
        clusters, groups = _Clusters.joined(self._clusters), _Groups.joined([_no_groups(), *self._groups])
        group = np.full(len(clusters), -1)
        for number, of in self._members:
            group[number] = of
        return MeshClusters(
            **self._looks(),
            faces=np.concatenate(self._triangles).astype(np.uint32),
            solid=is_solid(self._mesh),
            first=np.append(0, np.cumsum(clusters.count)),
            part=clusters.part,
            centre=self._low + self._size * clusters.centre,
            radius=self._size * clusters.radius,
            axis=clusters.axis,
            sine=clusters.sine,
            made_by=clusters.made_by,
            group=group,
            level_first=np.array(self._level_first),
            error=self._size * groups.error,
            group_centre=self._low + self._size * groups.centre,
            group_radius=self._size * groups.radius,
        )

    def _looks(self) -> dict[str, NDArray[Any]]:
        """Return positions, normals, colours and texture coordinates of the vertices."""
        mesh, own = self._mesh, len(self._source)
        normal, colour, uv = np.split(self._vertices.look, [3, 6], axis=1)
        normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        position = self._low + self._size * self._places.point[self._vertices.place]
        looks = {
            "positions": position.astype(np.float32),
            "normals": normal.astype(np.float32),
            "colours": np.round(255 * colour).astype(np.uint8),
            "uv": uv.astype(np.float32),
        }
        for name, values in looks.items():
            values[:own] = getattr(mesh, name)[self._source]  # exact copies, not rounded on the way
        return looks


def _nothing() -> MeshClusters:
    """Return the clusters of a mesh without triangles: none."""
    numbers, points, values = np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0)
    return MeshClusters(
        positions=np.zeros((0, 3), np.float32),
        normals=np.zeros((0, 3), np.float32),
        colours=np.zeros((0, 3), np.uint8),
        uv=np.zeros((0, 2), np.float32),
        faces=np.zeros((0, 3), np.uint32),
        solid=False,
        first=np.zeros(1, np.int64),
        part=numbers,
        centre=points,
        radius=values,
        axis=points,
        sine=values,
        made_by=numbers,
        group=numbers,
        level_first=np.zeros(1, np.int64),
        error=values,
        group_centre=points,
        group_radius=values,
    )


def _no_groups() -> _Groups:
    return _Groups(error=np.zeros(0), centre=np.zeros((0, 3)), radius=np.zeros(0))


def _enclosing(clusters: _Clusters, group: Ints) -> _Groups:
    """Return groups with bounding spheres and errors of their clusters, given the `group` (n,) of each cluster."""
    order = np.argsort(group, kind="stable")
    first = np.flatnonzero(np.diff(group[order], prepend=-1))
    centre, radius = clusters.lod_centre[order], clusters.lod_radius[order, None]
    low, high = np.minimum.reduceat(centre - radius, first), np.maximum.reduceat(centre + radius, first)
    middle = (low + high) / 2
    reach = np.linalg.norm(centre - middle[group[order]], axis=1) + radius[:, 0]
    return _Groups(
        error=np.maximum.reduceat(clusters.error[order], first),
        centre=middle,
        radius=np.maximum.reduceat(reach, first) * (1 + 1e-12),
    )


def _spheres(corners: Array, first: Ints) -> tuple[Array, Array]:
    """Return centres (n, 3) and radii (n,) of spheres around runs of triangles (t, 3, 3) that begin at `first` (n,)."""
    low, high = np.minimum.reduceat(corners.min(1), first), np.maximum.reduceat(corners.max(1), first)
    centre = (low + high) / 2
    of = np.repeat(np.arange(len(first)), np.diff(first, append=len(corners)))
    reach = np.square(corners - centre[of][:, None]).sum(-1).max(1)
    return centre, np.sqrt(np.maximum.reduceat(reach, first)) * (1 + 1e-12)


def _cones(normal: Array, first: Ints) -> tuple[Array, Array]:
    """Return axes (n, 3) and sines (n,) of the cones around runs of normals (t, 3), see `MeshClusters`."""
    axis = np.add.reduceat(normal, first)
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = np.divide(axis, length, out=np.zeros_like(axis), where=length > 0)
    of = np.repeat(np.arange(len(first)), np.diff(first, append=len(normal)))
    cosine = np.minimum.reduceat(np.einsum("ij,ij->i", normal, axis[of]), first)
    return axis, np.where(cosine > 0, np.sqrt(np.maximum(1 - cosine**2, 0)), 1.0)
