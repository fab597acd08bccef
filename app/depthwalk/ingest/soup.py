"""Define the triangles of a mesh file as stored, before they are turned, scaled and given normals."""

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.colour import srgb8_from_linear
from depthwalk.errors import InputError
from depthwalk.ingest.formats import GLTF_SUFFIXES
from depthwalk.ingest.mesh import Material
from depthwalk.limits import MAX_MESH_TRIANGLES
from depthwalk.types import Ints, Mask

log = logging.getLogger(__name__)

# Peak memory of `load_mesh` besides the file, measured with files of a million triangles of each format.
_VERTEX_BYTES, _TRIANGLE_BYTES = 300, 380


@dataclass(frozen=True, kw_only=True)
class Soup:
    """Hold the triangles of a file in its own frame and units.

    Attributes
    ----------
    positions : (V, 3) float64
        Vertices, all finite where a face refers to them.
    normals : (V, 3) float64
        Unit normals; a whole row is NaN if the file has none.
    colours : (V, 3) uint8
        sRGB; white if the file has none.
    uv : (V, 2) float64
        Texture coordinates, v upward; NaN if the file has none.
    faces : (F, 3) int64
        Indices of vertices, counter-clockwise seen from outside.
    material : (F,) int64
        Index of each face's material in `materials`.
    materials : tuple of Material
        The materials, in the order of their first use.
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float64]
    colours: NDArray[np.uint8]
    uv: NDArray[np.float64]
    faces: NDArray[np.int64]
    material: NDArray[np.int64]
    materials: tuple[Material, ...]

    def subset(self, vertices: Ints, faces: Ints, kept: Ints | Mask) -> "Soup":
        """Return the soup of some vertices and faces.

        Parameters
        ----------
        vertices
            (v,) the vertices, by their present numbers.
        faces
            (f, 3) the corners of the faces, rows of `vertices`.
        kept
            (f,) numbers of the present faces that these are, or a mask (F,) of them.

        Returns
        -------
        Soup
            The vertices and faces, with all materials.
        """
        return replace(
            self,
            positions=self.positions[vertices],
            normals=self.normals[vertices],
            colours=self.colours[vertices],
            uv=self.uv[vertices],
            faces=faces,
            material=self.material[kept],
        )


def check_geometry(positions: NDArray[Any], faces: NDArray[Any], path: Path) -> None:
    """Raise InputError unless `faces` (F, 3) refer to `positions` (V, 3); `path` for messages."""
    if positions.ndim != 2 or positions.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
        raise InputError(f"{path}: vertices need three coordinates and faces at least three corners")
    if faces.size and (faces.min() < 0 or faces.max() >= len(positions)):
        row, column = np.argwhere((faces < 0) | (faces >= len(positions)))[0]
        raise InputError(f"{path}: face {row} refers to vertex {faces[row, column]} of 0 to {len(positions) - 1}")


def finite_faces(soup: Soup, path: Path) -> Soup:
    """Leave out the faces of a file that have a corner with NaN or infinite coordinates, with a warning.

    Raises InputError if no face is left.
    """
    is_finite = np.asarray(np.isfinite(soup.positions).all(axis=1))
    if is_finite.all():
        return soup
    kept = np.asarray(is_finite[soup.faces].all(axis=1))
    left_out, total = len(kept) - np.count_nonzero(kept), len(kept)
    if left_out == total:
        raise InputError(f"{path}: all of its {total} triangles have NaN or infinite coordinates")
    if left_out:
        log.warning("%s: %d of %d triangles have NaN or infinite coordinates; left out", path, left_out, total)
    positions = np.where(is_finite[:, None], soup.positions, 0.0)
    return replace(soup, positions=positions, faces=soup.faces[kept], material=soup.material[kept])


def absent(count: int, width: int) -> NDArray[np.float64]:
    """Return NaN (count, width) for normals or texture coordinates that a file does not have; takes no memory."""
    return np.broadcast_to(np.nan, (count, width))


def white(count: int) -> NDArray[np.uint8]:
    """Return the colours (count, 3) of vertices that have none in the file; takes no memory."""
    return np.broadcast_to(np.uint8(255), (count, 3))


def placed_soup(
    positions: NDArray[np.float64],
    faces: NDArray[np.int64],
    *,
    normals: NDArray[np.float64] | None,
    uv: NDArray[np.float64] | None,
    colours: NDArray[np.uint8] | None,
    material: int,
    matrix: NDArray[np.float64],
) -> Soup:
    """Return a mesh of one material, placed in a scene, without the list of materials.

    Parameters
    ----------
    positions, faces, normals, uv, colours
        As `Soup` has them, in the frame of the mesh; None for what the file does not have.
    material
        The number of its material.
    matrix
        (4, 4) scene_from_mesh.
    """
    linear, count = matrix[:3, :3], len(positions)
    if (turn := np.linalg.det(linear)) < 0:
        faces = faces[:, ::-1]  # mirroring turns the faces inside out
    return Soup(
        positions=positions @ linear.T + matrix[:3, 3],
        normals=unit_normals(normals @ np.linalg.inv(linear)) if turn and normals is not None else absent(count, 3),
        colours=white(count) if colours is None else colours,
        uv=absent(count, 2) if uv is None else uv,
        faces=faces,
        material=np.full(len(faces), material),
        materials=(),
    )


def joined_soups(pieces: Sequence[Soup], materials: Iterable[Material]) -> Soup:
    """Return the triangles of all `pieces`, at least one, whose numbers of materials count in `materials`."""
    if len(pieces) == 1:
        return replace(pieces[0], materials=tuple(materials))
    ends = np.cumsum([len(piece.positions) for piece in pieces])
    return Soup(
        positions=np.concatenate([piece.positions for piece in pieces]),
        normals=np.concatenate([piece.normals for piece in pieces]),
        colours=np.concatenate([piece.colours for piece in pieces]),
        uv=np.concatenate([piece.uv for piece in pieces]),
        faces=np.concatenate(
            [piece.faces + (end - len(piece.positions)) for piece, end in zip(pieces, ends, strict=True)]
        ),
        material=np.concatenate([piece.material for piece in pieces]),
        materials=tuple(materials),
    )


def unit_normals(normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scale `normals` (V, 3) to unit length; rows that are zero or of infinite length become NaN."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        return np.where(np.isfinite(lengths) & (lengths > 1e-6), normals / lengths, np.nan)


def srgb8_from_file(linear: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the 8-bit sRGB values (…) of the linear values (…) of a file, of which NaN counts as 0."""
    return srgb8_from_linear(np.nan_to_num(linear, nan=0.0, posinf=1.0, neginf=0.0))


def check_mesh_memory(vertices: int, triangles: int, path: Path) -> None:
    """Raise InputError if the mesh of the file `path`, with this many vertices and triangles, takes too much memory."""
    check_memory(path, mesh_bytes(vertices, triangles), f"a mesh of {vertices} vertices and {triangles} triangles")


def mesh_bytes(vertices: int, triangles: int) -> int:
    """Return the bytes needed to load a mesh of this many vertices and triangles, besides its file."""
    return _VERTEX_BYTES * vertices + _TRIANGLE_BYTES * triangles


def check_triangle_count(count: int, path: Path) -> None:
    """Raise InputError if `count`, the number of triangles in the file `path`, is 0 or above the limit."""
    if count == 0:
        suffix = path.suffix.lower()
        hint = (
            "its scene shows neither triangles nor points" if suffix in GLTF_SUFFIXES else "lines alone are not drawn"
        )
        raise InputError(f"{path}: no faces" + (f"; {hint}" if suffix != ".stl" else ""))
    if count > MAX_MESH_TRIANGLES:
        raise InputError(f"{path}: too large: {count} triangles, the limit is {MAX_MESH_TRIANGLES}")
