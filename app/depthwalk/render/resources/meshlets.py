"""Divide meshes into meshlets, patches of triangles, and cull those that cannot be seen.

A meshlet has a bounding sphere, for frustum culling, and a cone that holds the normals of its triangles, for culling
meshlets that face away (Shirman and Abi-Ezzi 1993, "The Cone of Normals Technique for Fast Processing of Curved
Patches").
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.distinct import distinct_numbers
from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.geometry.spatial_order import stable_order
from depthwalk.geometry.triangles import face_normals
from depthwalk.ingest.mesh import Mesh, Part
from depthwalk.render import kernels
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.types import Array

SIZE = 64  # triangles of a meshlet: smaller ones are culled better, but there are more to test
_FEWEST = 128  # meshlets: a mesh with fewer is drawn as fast as it is tested
_NORMAL_WEIGHT = 0.15  # part of the mesh's size that normals which differ by 1 count as


@dataclass(frozen=True, kw_only=True)
class Meshlets:
    """Hold the m meshlets of a mesh.

    Attributes
    ----------
    vertices
        (v,) rows of the mesh's vertices, in the order in which meshlets first use them, for the GPU's vertex cache.
    faces
        (m, SIZE, 3) uint32 rows of `vertices`. The last meshlet of a part is padded with empty triangles.
    part
        (m,) the part of the mesh that each meshlet belongs to, rising.
    centre
        (m, 3) centres of the bounding spheres, metres, in the asset's frame.
    radius
        (m,) radii of the bounding spheres, metres.
    axis
        (m, 3) axes of the cones that hold the normals, unit vectors, in the asset's frame.
    sine
        (m,) sine of half the cone's angle; 1 where no cone of less than 90° holds the normals.
    """

    vertices: NDArray[np.intp]
    faces: NDArray[np.uint32]
    part: NDArray[np.int64]
    centre: Array
    radius: Array
    axis: Array
    sine: Array

    def of_parts(self, parts: Sequence[Part]) -> NDArray[np.uint32]:
        """Return the triangles of all meshlets, in the order of the mesh's parts, without the empty ones.

        Parameters
        ----------
        parts
            The parts of the mesh.

        Returns
        -------
        NDArray[np.uint32]
            (t, 3) rows of `vertices`.
        """
        runs = (self.faces[self.part == number].reshape(-1, 3)[: part.face_count] for number, part in enumerate(parts))
        return np.concatenate(list(runs))

    def seen(self, view: View, placed: NDArray[np.void], solid: bool) -> NDArray[np.intp]:
        """Find the meshlets of an object that may be seen.

        Parameters
        ----------
        view
            The view of the picture.
        placed
            A single PLACED_RECORD, of shape (): where the object that is drawn stands relative to the viewer of `view`,
            metres, world axes, its rotation and its scale.
        solid
            Whether back faces cannot be seen, so that meshlets which face away are left out.

        Returns
        -------
        NDArray[np.intp]
            (k,) rows of the meshlets, part by part, within each part the nearest first.
        """
        if (loops := kernels.loaded()) is not None:
            found, forward = loops.meshlets(
                centre=self.centre,
                radius=self.radius,
                axis=self.axis,
                sine=self.sine,
                origin=placed["origin"].astype(np.float64),
                rotation=placed["rotation"].astype(np.float64),
                scale=float(placed["scale"]),
                axes=view.axes,
                tangent=np.array(view.half_extent),
                shear=np.array(view.shear),
                solid=solid,
            )
            return np.asarray(found[np.lexsort((forward, self.part[found]))])
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
    """Divide the triangles of a mesh into meshlets.

    Parameters
    ----------
    mesh
        The mesh.

    Returns
    -------
    Meshlets | None
        The meshlets; None where the mesh is so small that it is drawn as fast whole.
    """
    if len(mesh.faces) < _FEWEST * SIZE:
        return None
    rows = np.ascontiguousarray(mesh.faces.T)
    axes = np.stack([axis.take(rows) for axis in mesh.positions.T.astype(np.float64, "C")])  # (3, 3, t): fast to reduce
    corners = axes.transpose(2, 1, 0)
    normals, _ = face_normals(corners)
    size = max(np.ptp(axis) for axis in axes)
    a, b, c = axes.transpose(1, 0, 2)
    places = np.concatenate([(a + b + c) / 3, _NORMAL_WEIGHT * size * normals.T])
    patches, part_of_patch = [], []
    for number, part in enumerate(mesh.parts):
        first, end = part.first_face, part.first_face + part.face_count
        found = _patches(places[:, first:end], np.arange(first, end))
        patches += found
        part_of_patch += [number] * len(found)
    return _meshlets(mesh.faces, corners, normals, patches, np.array(part_of_patch))


def _patches(places: Array, rows: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Divide triangles with `places` (6, n) and the numbers `rows` (n,) into patches of SIZE, the last of fewer.

    They are split recursively, along the coordinate in which they differ most.
    """
    if len(rows) <= SIZE:
        return [rows]
    along = places[(np.maximum.reduce(places, 1) - np.minimum.reduce(places, 1)).argmax()]
    half = SIZE * (-(-len(rows) // SIZE) // 2)
    order = along.argpartition(half)
    rows = rows.take(order)
    if len(rows) <= 2 * SIZE:  # halves are whole patches, whose places are not needed
        return [rows[:half], rows[half:]]
    places = places.take(order, 1)  # not `places[:, order]`, whose transposed layout is slow to reduce
    return _patches(places[:, :half], rows[:half]) + _patches(places[:, half:], rows[half:])


def _meshlets(
    faces: NDArray[np.int32], corners: Array, normals: Array, patches: list[NDArray[np.intp]], part: NDArray[np.int64]
) -> Meshlets:
    """Build meshlets from patches.

    Parameters
    ----------
    faces, corners, normals
        (t, 3) vertices, (t, 3, 3) positions, metres, and (t, 3) unit normals of all triangles of the mesh.
    patches
        The triangles of each meshlet, rows of these.
    part
        (m,) the part that each belongs to.
    """
    count = np.array([len(patch) for patch in patches])
    place = (np.cumsum(count) - count)[:, None] + np.arange(SIZE) % count[:, None]
    rows = np.concatenate(patches)[place]  # (m, SIZE), repeated where there are fewer
    # One array per coordinate, (m, 3 SIZE) and (m, SIZE), which NumPy reduces five times as fast.
    points = [np.ascontiguousarray(x).take(rows, 0).reshape(len(rows), -1) for x in corners.transpose(2, 0, 1)]
    centre = np.stack([(x.min(1) + x.max(1)) / 2 for x in points], -1)
    squares = sum(np.square(x - middle[:, None]) for x, middle in zip(points, centre.T, strict=True))
    radius = np.sqrt(squares.max(1))
    turned = [np.ascontiguousarray(x).take(rows) for x in normals.T]
    axis = np.stack([x.sum(1) for x in turned], -1)
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = np.divide(axis, length, out=np.zeros_like(axis), where=length > 0)
    cosine = sum(x * along[:, None] for x, along in zip(turned, axis.T, strict=True)).min(1)
    sine = np.where(cosine > 0, np.sqrt(np.maximum(1 - cosine**2, 0)), 1.0)
    vertices, used = _by_first_use(faces[rows].ravel())
    drawn = np.where((np.arange(SIZE) < count[:, None])[..., None], used.reshape(*rows.shape, 3), 0).astype(np.uint32)
    return Meshlets(vertices=vertices, faces=drawn, part=part, centre=centre, radius=radius, axis=axis, sine=sine)


def _by_first_use(indices: NDArray[np.int32]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the distinct `indices` (v,) in the order in which they first occur, and which of them (n,) each one is."""
    known, first, where = distinct_numbers(indices)
    order = stable_order(first)
    rank = np.empty(len(order), np.intp)
    rank[order] = np.arange(len(order))
    return known[order], rank[where]
