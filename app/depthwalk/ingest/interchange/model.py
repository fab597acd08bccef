"""Define what all readers of this package return: polygons, placed, and materials by name."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.geometry.vectors import normal_matrices
from depthwalk.ingest.mtl import MtlMaterial
from depthwalk.ingest.soup import check_mesh_memory
from depthwalk.limits import MAX_COPIED_TRIANGLES, MAX_MESH_TRIANGLES
from depthwalk.types import Ints

_MOST_NODES = 100_000  # that are visited, each in some 20 µs, beyond those that the bytes of a file can hold
_POSING_COST = 100  # nodes that are visited in the time in which a mesh of a few triangles is posed

Y_FROM_Z = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""Turns (x, y, z) into (x, z, −y), for files whose z axis points upward."""


@dataclass(frozen=True, kw_only=True)
class Polygons:
    """Hold the polygons of a mesh, in its own frame.

    Attributes
    ----------
    positions : (V, 3) float64
        Vertices.
    vertex : (C,) int64
        The vertex at each corner of the polygons, one polygon after the other; unchecked.
    sizes : (P,) int64
        Corners of each polygon. Those with fewer than three are not drawn.
    normals : (C, 3) float64 or None
        Normals at the corners, of any length.
    uv : (C, 2) float64 or None
        Texture coordinates at the corners, v upward.
    colours : (C, 3) uint8 or None
        Colours at the corners, sRGB.
    material : (P,) int64
        Index of each polygon's material in `names`.
    names : tuple of (str or None)
        Materials by name; None for polygons without one. At least one.
    """

    positions: NDArray[np.float64]
    vertex: Ints
    sizes: Ints
    normals: NDArray[np.float64] | None = None
    uv: NDArray[np.float64] | None = None
    colours: NDArray[np.uint8] | None = None
    material: Ints
    names: tuple[str | None, ...]

    @property
    def triangle_count(self) -> int:
        """Return how many triangles the polygons are cut into."""
        return int(np.maximum(self.sizes - 2, 0).sum())


@dataclass(frozen=True, kw_only=True)
class Placed:
    """Hold a use of polygons in the scene, and its file_from_mesh matrix (4, 4)."""

    polygons: Polygons
    matrix: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Model:
    """Hold what a file contains, y upward; in metres if the format has a unit.

    Attributes
    ----------
    placed
        All uses of meshes; none where only the materials were asked for.
    materials
        The materials by name, with the pictures that they name. `image` and `mask` are alike where the alpha of the
        picture cuts out.
    embedded
        Pictures in the file by the names that materials use.
    unread
        What it holds beside that, such as "2 animations".
    """

    placed: list[Placed] = field(default_factory=list)
    materials: Mapping[str, MtlMaterial]
    embedded: Mapping[str, bytes] = field(default_factory=dict)
    unread: tuple[str, ...] = ()


def unread_parts(*, animations: int = 0, cameras: int = 0, lamps: int = 0, shapes: int = 0) -> tuple[str, ...]:
    """Return texts for `Model.unread` from how many there are; `shapes` are shape keys."""
    counts = {"animation": animations, "camera": cameras, "lamp": lamps, "shape key": shapes}
    return tuple(f"{count} {name}{'s' * (count > 1)}" for name, count in counts.items() if count)


class PlacingBudget:
    """Count the triangles of a file while its meshes are placed, so that copies of copies are refused early."""

    def __init__(self, data: bytes, path: Path) -> None:
        """Allow what a file of these bytes can hold, and some copies."""
        self._path = path
        # No format here stores a triangle in less than three bytes, except what is compressed: counted when decoded.
        self._most = min(MAX_COPIED_TRIANGLES + len(data) // 3, MAX_MESH_TRIANGLES)
        self._most_nodes = _MOST_NODES + len(data) // 10
        self._triangles = self._corners = self._nodes = 0

    def decoded(self, count: int) -> None:
        """Allow further triangles, of `count` bytes that were compressed."""
        self._most = min(self._most + count // 3, MAX_MESH_TRIANGLES)

    def place(self, polygons: Polygons) -> None:
        """Count a use of polygons. Raises InputError if there are too many, or too many to hold."""
        self._triangles += polygons.triangle_count
        self._corners += len(polygons.vertex)
        if self._triangles > self._most:
            raise InputError(
                f"{self._path}: its nodes make {self._triangles} triangles of the same data, at most {self._most} "
                "are allowed"
            )
        check_mesh_memory(self._corners, self._triangles, self._path)

    def step(self) -> None:
        """Count a node that is visited. Raises InputError if nodes that place nodes make millions."""
        self._nodes += 1
        if self._nodes > self._most_nodes:
            raise InputError(f"{self._path}: its nodes place each other more than {self._most_nodes} times")

    def pose(self) -> None:
        """Count a mesh that joints pose, like the nodes visited meanwhile. Raises InputError if it is too many."""
        self._nodes += _POSING_COST
        if self._nodes > self._most_nodes:
            raise InputError(
                f"{self._path}: its nodes pose more than {self._most_nodes // _POSING_COST} meshes by joints"
            )


def posed(
    polygons: Polygons,
    vertices: Ints,
    matrices: NDArray[np.float64],
    weights: NDArray[np.float64],
    rest: NDArray[np.float64],
) -> Polygons:
    """Return polygons as joints hold them, by linear blend skinning (Lewis et al. 2000, §2).

    Parameters
    ----------
    polygons
        The polygons where they are bound.
    vertices
        (n,) rows of their vertices, one for each pair of a vertex and a joint.
    matrices
        (n, 3, 4) what the joint makes of the vertex.
    weights
        (n,) the part that the joint has.
    rest
        (4, 4) what is made of vertices that no joint holds.

    Returns
    -------
    Polygons
        With the positions, and the normals if there are any, in the frame to which the matrices lead.

    Raises
    ------
    ValueError
        For vertices that are missing.
    """
    count = len(polygons.positions)
    if len(vertices) and not 0 <= vertices.min() <= vertices.max() < count:
        raise ValueError("a joint of vertices that are missing")
    total = np.bincount(vertices, weights, minlength=count)
    columns = (weights[:, None] * matrices.reshape(len(vertices), 12)).T
    sums = np.stack([np.bincount(vertices, column, minlength=count) for column in columns], axis=1)
    held = total > 1e-9
    blended = np.tile(rest[:3], (count, 1, 1))
    blended[held] = (sums[held] / total[held, None]).reshape(-1, 3, 4)
    linear = blended[:, :, :3]
    moved = np.einsum("vij,vj->vi", linear, polygons.positions) + blended[:, :, 3]
    normals = polygons.normals
    if normals is not None:
        known = np.clip(polygons.vertex, 0, count - 1)  # they are not checked yet
        normals = np.einsum("cij,cj->ci", normal_matrices(linear)[known], normals)
    return replace(polygons, positions=moved, normals=normals)
