"""Simplify a mesh to coarser levels, to be drawn from afar: a polygon renderer's alternative to depth images.

Quadric decimation moves only positions. So texture coordinates are taken from the nearest vertex of the original and
materials from its nearest face; at a texture's seams, coarse levels smear it. Normals and colours are fitted to those
of the original (`level_looks`).
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.level_looks import LOOKS_WRONG, OF_SAMPLES, chart_places, fitted_looks, sample_looks
from depthwalk.bake.params import FEWEST, RATIOS
from depthwalk.bake.sampling import sample_surface
from depthwalk.geometry.triangles import face_normals, row_ids, sample_triangles
from depthwalk.ingest.mesh import Mesh, MeshLevel, Part
from depthwalk.types import Array, Ints

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

# Values of fast-simplification's `agg`. A low one keeps the shape twice as well, but may stop above the requested
# number of triangles: then the next one continues.
_HASTE = (3, 5, 7)
_WORTH = 0.9  # of the finer level's triangles: a mesh with more than that is not worth a level
_PROBES, _DISCS = 20_000, 200_000  # points on the mesh, and on a level, for measuring the distance between them
_INWARD = 0.1  # of the way from a corner to its face's centre, which is on the corner's own side of a seam


def mesh_levels(mesh: Mesh) -> tuple[MeshLevel, ...]:
    """Simplify a mesh in steps to a quarter of the triangles each, by quadric edge collapse (Garland, Heckbert 1997).

    Parameters
    ----------
    mesh
        The mesh, asset frame, metres.

    Returns
    -------
    tuple
        `mesh` itself with error 0, then a level for each of `RATIOS`, the finest first; fewer if there is little to
        simplify. Errors, see `MeshLevel`, never decrease from level to level.
    """
    import fast_simplification

    if not len(mesh.faces):  # the whole mesh is translucent
        return (MeshLevel(mesh, 0.0),)
    welded, first = row_ids(mesh.positions)
    points, faces = mesh.positions[first].astype(np.float64), welded[mesh.faces].astype(np.int32)
    probes, appearance = sample_surface(mesh, _PROBES)[0], _SurfaceAppearance(mesh)
    levels = [MeshLevel(mesh, 0.0)]
    for ratio in RATIOS:
        wanted = max(len(mesh.faces) // ratio, FEWEST)
        for haste in _HASTE:
            if wanted < len(faces):  # from level to level: better than from the mesh each time, and faster
                points, faces = fast_simplification.simplify(points, faces, target_count=wanted, agg=haste)
        if not 0 < len(faces) < _WORTH * len(levels[-1].mesh.faces):
            break
        level, off = appearance.transferred_to(points, faces)
        area = face_normals(points[faces])[1].sum()
        looks = LOOKS_WRONG * off * float(np.sqrt(2 * area / len(faces)))
        levels.append(MeshLevel(level, max(_distance(probes, points[faces]), looks, levels[-1].error)))
    return tuple(levels)


def _distance(points: Array, corners: Array) -> float:
    """Return the largest distance of points (n, 3) from triangles (m, 3, 3), metres.

    Overlapping discs replace the triangles. Distances beside the nearest disc are accurate to within its radius, and
    those above it are exact.
    """
    from scipy.spatial import cKDTree

    middle, normal = sample_triangles(corners, _DISCS)
    away, nearest = cKDTree(middle, **OF_SAMPLES).query(points)
    above = np.einsum("ij,ij->i", points - middle[nearest], normal[nearest])
    beside = np.sqrt(np.maximum(away**2 - above**2, 0))
    radius = 2 * np.sqrt(face_normals(corners)[1].sum() / _DISCS)
    return float(np.hypot(above, np.maximum(beside - radius, 0)).max())


class _SurfaceAppearance:
    """Store the appearance of a mesh's surface, to transfer it to other surfaces near it.

    A chart is a connected piece of the surface; seams of textures and creases end one, or run within it.
    """

    def __init__(self, mesh: Mesh) -> None:
        from scipy.spatial import cKDTree

        self._mesh = mesh
        middle, corners = _inward(mesh.positions[mesh.faces].astype(np.float64))
        self._faces = cKDTree(middle)
        self._chart = _charts(mesh)
        self._apart = 10 * float(np.ptp(mesh.positions, axis=0).max())  # metres between charts along a fourth axis
        self._vertices = self._tree(mesh.positions)
        anchor = mesh.positions.astype(np.float64)
        anchor[mesh.faces] = corners  # from any of a vertex's faces: all lie on its side of the seam
        self._anchors = self._tree(anchor)
        places, _ = row_ids(np.column_stack([mesh.positions, self._chart]))
        self._on_seam = np.bincount(places)[places] > 1
        self._samples = sample_looks(mesh, self._chart, self._apart)
        self._material = np.repeat([part.material for part in mesh.parts], [part.face_count for part in mesh.parts])

    def transferred_to(self, points: Array, faces: NDArray[np.integer]) -> tuple[Mesh, float]:
        """Return points (v, 3) and faces (f, 3) as a mesh, and the residual of its looks, see `fitted_looks`.

        All corners of a face take their appearance from one chart.
        """
        mesh = self._mesh
        middle, corners = _inward(points[faces])
        face = self._faces.query(middle)[1]
        offset = self._apart * np.repeat(self._chart[mesh.faces[face, 0]], 3)
        source = self._vertices.query(np.column_stack([points[faces.ravel()], offset]))[1]
        seam = np.flatnonzero(self._on_seam[source])
        source[seam] = self._anchors.query(np.column_stack([corners.reshape(-1, 3)[seam], offset[seam]]))[1]
        pairs, vertex = np.unique(np.stack([faces.ravel(), source], -1), axis=0, return_inverse=True)
        material = self._material[face]
        count = np.bincount(material)
        start = np.cumsum(count) - count
        level = Mesh(
            positions=points[pairs[:, 0]].astype(np.float32),
            normals=mesh.normals[pairs[:, 1]],
            colours=mesh.colours[pairs[:, 1]],
            uv=mesh.uv[pairs[:, 1]],
            faces=vertex.reshape(-1, 3)[np.argsort(material, kind="stable")].astype(np.int32),
            parts=tuple(Part(int(start[m]), int(count[m]), int(m)) for m in np.flatnonzero(count)),
            materials=mesh.materials,
        )
        return fitted_looks(level, self._samples, self._chart[pairs[:, 1]], self._apart)

    def _tree(self, points: Array) -> "cKDTree":
        from scipy.spatial import cKDTree

        return cKDTree(chart_places(points, self._chart, self._apart))


def _inward(corners: Array) -> tuple[Array, Array]:
    """Return centres (n, 3) of triangles (n, 3, 3), and their corners moved a little towards them."""
    middle = corners.mean(axis=1)
    return middle, corners + _INWARD * (middle[:, None] - corners)


def _charts(mesh: Mesh) -> Ints:
    """Return the number (V,) of the connected piece of surface that each vertex belongs to; seams separate pieces."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = len(mesh.positions)
    start, end = mesh.faces[:, [0, 1]].ravel(), mesh.faces[:, [1, 2]].ravel()
    links = coo_array((np.ones(len(start), bool), (start, end)), (count, count))
    return np.asarray(connected_components(links, directed=False)[1], np.int64)
