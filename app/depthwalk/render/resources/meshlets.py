"""Meshlets: patches of a mesh's triangles, of which those that nobody can see are not drawn.

Each has a bounding sphere, and a cone about the normals of its triangles: Shirman and Abi-Ezzi 1993, "The cone of
normals technique for fast processing of curved patches".
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.geometry.triangles import face_normals
from depthwalk.ingest.mesh import Mesh, Part
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.types import Array

SIZE = 64  # triangles: fewer are culled better, and take longer to test
_FEWEST = 128  # meshlets: a smaller mesh is drawn as soon as it is tested
_TURN = 0.15  # normals that differ by 1 are as far apart as triangles this part of the mesh's size away


@dataclass(frozen=True)
class Meshlets:
    """Of m patches: vertices (v,), the mesh's, as patches first use them: drivers remember only those of late; faces
    (m, SIZE, 3) uint32, rows of `vertices`, the last of a part filled up with empty ones; part (m,), rising, the mesh's
    part they belong to; centre (m, 3), radius (m,): bounding spheres, asset frame, metres; axis (m, 3), unit, and sine
    (m,): cones that hold the normals, 1 where none does."""

    vertices: NDArray[np.intp]
    faces: NDArray[np.uint32]
    part: NDArray[np.int64]
    centre: Array
    radius: Array
    axis: Array
    sine: Array

    def of_parts(self, parts: Sequence[Part]) -> NDArray[np.uint32]:
        """All triangles (t, 3), without the empty ones: those of `parts` where these have theirs."""
        runs = (self.faces[self.part == number].reshape(-1, 3)[: each.face_count] for number, each in enumerate(parts))
        return np.concatenate(list(runs))

    def seen(self, view: View, placed: NDArray[np.void], solid: bool) -> NDArray[np.intp]:
        """Rows (k,) of the meshlets that may be seen, part by part, nearest first.

        placed: a PLACED_RECORD; solid: whether back faces do not count.
        """
        rotation, scale = placed["rotation"].astype(np.float64)[None], float(placed["scale"])
        middle = placed["origin"] + scale * rotate(rotation, self.centre)
        rows, _ = Bounds(view.position + middle, scale * self.radius).visible(view)
        if solid:
            to_centre = rotate(conjugate(rotation), middle[rows] / scale)
            along = np.einsum("ij,ij->i", to_centre, self.axis[rows])
            away = self.sine[rows] * np.linalg.norm(to_centre, axis=1) + self.radius[rows]
            rows = rows[along < away]
        return rows[np.argsort(self.part[rows], kind="stable")]


def build_meshlets(mesh: Mesh) -> Meshlets | None:
    """Those of `mesh`, or None where it is so small that it is better drawn whole."""
    if len(mesh.faces) < _FEWEST * SIZE:
        return None
    corners = mesh.positions[mesh.faces].astype(np.float64)
    normals, _ = face_normals(corners)
    size = np.ptp(corners.reshape(-1, 3), axis=0).max()
    places = np.hstack([corners.mean(1), _TURN * size * normals])
    patches, part = [], []
    for number, each in enumerate(mesh.parts):
        found = _patches(places, np.arange(each.first_face, each.first_face + each.face_count))
        patches += found
        part += [number] * len(found)
    return _meshlets(mesh.faces, corners, normals, patches, np.array(part))


def _patches(places: Array, rows: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """`rows` (n,) of `places` in patches of SIZE, the last of fewer: halved again and again where they differ most."""
    if len(rows) <= SIZE:
        return [rows]
    of_rows = places[rows]
    along = of_rows[:, np.ptp(of_rows, axis=0).argmax()]
    half = SIZE * (-(-len(rows) // SIZE) // 2)
    rows = rows[np.argpartition(along, half)]
    return _patches(places, rows[:half]) + _patches(places, rows[half:])


def _meshlets(
    faces: NDArray[np.int32], corners: Array, normals: Array, patches: list[NDArray[np.intp]], part: NDArray[np.int64]
) -> Meshlets:
    """corners: (t, 3, 3), normals: (t, 3), of all triangles `faces` (t, 3)."""
    count = np.array([len(each) for each in patches])
    rows = np.array([np.resize(each, SIZE) for each in patches])  # (m, SIZE), the first again where there are fewer
    low, high = corners[rows].min((1, 2)), corners[rows].max((1, 2))
    centre = (low + high) / 2
    radius = np.linalg.norm(corners[rows] - centre[:, None, None], axis=-1).max((1, 2))
    axis = normals[rows].sum(1)
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = np.divide(axis, length, out=np.zeros_like(axis), where=length > 0)
    cosine = np.einsum("mtj,mj->mt", normals[rows], axis).min(1)
    sine = np.where(cosine > 0, np.sqrt(np.maximum(1 - cosine**2, 0)), 1.0)
    vertices, used = _by_first_use(faces[rows].ravel())
    drawn = np.where((np.arange(SIZE) < count[:, None])[..., None], used.reshape(*rows.shape, 3), 0).astype(np.uint32)
    return Meshlets(vertices, drawn, part, centre, radius, axis, sine)


def _by_first_use(indices: NDArray[np.int32]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """What occurs (v,) among `indices` (n,), in the order of its first occurrence; and which of it (n,) each is."""
    known, first, where = np.unique(indices, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return known[order].astype(np.intp), np.argsort(order)[where]
