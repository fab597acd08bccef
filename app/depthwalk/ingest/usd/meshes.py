"""Turn meshes of USD into primitives of glTF: triangles, a vertex for each combination of what its corners have."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import UsdGeom, UsdShade

from depthwalk.geometry.distinct import distinct_numbers
from depthwalk.geometry.triangulation import triangulated
from depthwalk.ingest.usd.glb import GlbBuilder, Header
from depthwalk.ingest.usd.materials import Look, Materials
from depthwalk.ingest.usd.problems import Unread, UsdError
from depthwalk.limits import MAX_MESH_TRIANGLES
from depthwalk.types import Ints

_Array = NDArray[Any]


@dataclass(frozen=True, kw_only=True)
class Piece:
    """Hold a mesh of a model.

    Attributes
    ----------
    prim
        The `Mesh` prim.
    matrix : (4, 4) float64
        Model from mesh, for column vectors.
    material
        Material of faces that have none of their own; None without one.
    colour
        Primvar `displayColor` of an instance that shows the mesh, which the mesh itself may replace; None without one.
    """

    prim: Any
    matrix: NDArray[np.float64]
    material: Any = None
    colour: Any = None


class _Corners(NamedTuple):
    """The corners of all polygons of a mesh: vertex and face of each (C,), the corners of each face (P,), and holes."""

    vertex: Ints
    face: Ints
    sizes: Ints
    holes: Ints


class _Values(NamedTuple):
    """Values (n, width) and which of them each corner has (C,)."""

    values: _Array
    row: Ints


class MeshWriter:
    """Write the meshes of models."""

    def __init__(self, builder: GlbBuilder, materials: Materials, time: Any, unread: Unread) -> None:
        """Prepare to write into a file what the meshes are at a time."""
        self._builder, self._materials, self._time, self._unread = builder, materials, time, unread
        self._triangles = 0

    def add(self, name: str, pieces: Sequence[Piece]) -> tuple[int, int] | None:
        """Add a mesh of glTF with all these pieces; return its number and its triangles, None if it has none."""
        primitives: list[Header] = []
        before = self._triangles
        for piece in pieces:
            primitives += self._primitives(piece)
        if not primitives:
            return None
        mesh = self._builder.add("meshes", {"name": name, "primitives": primitives})
        return mesh, self._triangles - before

    def _primitives(self, piece: Piece) -> list[Header]:
        """Return the primitives of a piece, one for each of its materials."""
        prim = piece.prim
        mesh, where = UsdGeom.Mesh(prim), str(prim.GetPath())
        points = _array(mesh.GetPointsAttr().Get(self._time), 3)
        corners = self._corners(mesh, len(points), where)
        if not len(corners.vertex):
            return []
        self._note(mesh)
        faces, polygon = triangulated(points[corners.vertex].astype(np.float64), corners.sizes)
        self._triangles += len(faces)
        if self._triangles > MAX_MESH_TRIANGLES:
            raise UsdError(f"{where}: with it the scene has more than {MAX_MESH_TRIANGLES} triangles")
        turned = np.linalg.det(piece.matrix[:3, :3]) < 0
        if turned != (mesh.GetOrientationAttr().Get(self._time) == UsdGeom.Tokens.leftHanded):
            faces = faces[:, ::-1]
        columns = {"POSITION": _Values(_moved(points, piece.matrix), corners.vertex)}
        if (normals := self._normals(mesh, corners, len(points))) is not None:
            columns["NORMAL"] = _Values(_turned(normals.values, piece.matrix), normals.row)
        materials = self._bound(prim, corners, piece.material)
        found = []
        for number, material in enumerate(materials.listed):
            of_material = faces[materials.face[polygon] == number]
            if len(of_material):
                look = self._materials.look(material)
                own = columns | self._for_look(piece, look, corners, len(points))
                found.append(self._primitive(own, of_material, look, piece))
        return found

    def _corners(self, mesh: Any, points: int, where: str) -> _Corners:
        """Return the corners of a mesh without those of its holes. Raises UsdError for what does not fit together."""
        sizes = _integers(mesh.GetFaceVertexCountsAttr().Get(self._time))
        vertex = _integers(mesh.GetFaceVertexIndicesAttr().Get(self._time))
        if len(sizes) and int(sizes.min()) < 0:
            raise UsdError(f"{where}: faceVertexCounts has {sizes.min()}, which is no number of corners")
        if int(sizes.sum()) != len(vertex):
            raise UsdError(
                f"{where}: faceVertexCounts add up to {sizes.sum()} corners, faceVertexIndices lists {len(vertex)}"
            )
        outside = np.flatnonzero((vertex < 0) | (vertex >= points))
        if len(outside):
            raise UsdError(f"{where}: faceVertexIndices refers to point {vertex[outside[0]]} of 0 to {points - 1}")
        face = np.repeat(np.arange(len(sizes)), sizes)
        holes = _integers(mesh.GetHoleIndicesAttr().Get(self._time))
        holes = holes[(holes >= 0) & (holes < len(sizes))]
        return _Corners(vertex, face, sizes, holes)

    def _note(self, mesh: Any) -> None:
        """Count what of a mesh is not read."""
        if mesh.GetSubdivisionSchemeAttr().Get(self._time) != UsdGeom.Tokens.none:
            self._unread.count("subdivision surface but for its cage", "subdivision surfaces but for their cages")
        if mesh.GetPrim().HasAPI("SkelBindingAPI"):
            self._unread.count("skinned mesh but as it is stored", "skinned meshes but as they are stored")
        if mesh.GetPointsAttr().ValueMightBeTimeVarying():
            self._unread.count("mesh that changes its shape", "meshes that change their shape")

    def _normals(self, mesh: Any, corners: _Corners, points: int) -> _Values | None:
        """Return the normals of a mesh; None if it has none."""
        primvar = UsdGeom.PrimvarsAPI(mesh.GetPrim()).GetPrimvar("normals")
        if primvar and primvar.HasAuthoredValue():
            return self._primvar(primvar, 3, corners, points)
        attribute = mesh.GetNormalsAttr()
        if not attribute.HasAuthoredValue():
            return None
        values = _array(attribute.Get(self._time), 3)
        return self._spread(values, None, mesh.GetNormalsInterpolation(), corners, points)

    def _for_look(self, piece: Piece, look: Look, corners: _Corners, points: int) -> dict[str, _Values]:
        """Return the texture coordinates and the colours that a material reads, by the names of glTF."""
        found: dict[str, _Values] = {}
        primvars = UsdGeom.PrimvarsAPI(piece.prim)
        if look.coordinates:
            primvar = primvars.FindPrimvarWithInheritance(look.coordinates)
            if primvar and (uv := self._primvar(primvar, 2, corners, points)) is not None:
                matrix = look.transform
                values = uv.values @ matrix[:, :2].T + matrix[:, 2]
                found["TEXCOORD_0"] = _Values(values * [1, -1] + [0, 1], uv.row)  # v is downward in glTF
        if look.colours:
            primvar = primvars.FindPrimvarWithInheritance(look.colours)
            if not (primvar and primvar.HasValue()):
                primvar = piece.colour
            if primvar and (colours := self._primvar(primvar, 3, corners, points)) is not None:
                found["COLOR_0"] = _Values(np.clip(colours.values, 0.0, 1.0), colours.row)
        return found

    def _primvar(self, primvar: Any, width: int, corners: _Corners, points: int) -> _Values | None:
        """Return the values of a primvar at the corners of a mesh; None if it has none that fit."""
        indices = _integers(primvar.GetIndices(self._time)) if primvar.IsIndexed() else None
        values = _array(primvar.Get(self._time), width)
        return self._spread(values, indices, primvar.GetInterpolation(), corners, points)

    def _spread(
        self, values: _Array, indices: Ints | None, interpolation: str, corners: _Corners, points: int
    ) -> _Values | None:
        """Return values at the corners of a mesh, which have them by an interpolation; None if they do not fit."""
        rows, count = {
            "constant": (np.zeros(len(corners.vertex), np.int64), 1),
            "uniform": (corners.face, len(corners.sizes)),
            "faceVarying": (np.arange(len(corners.vertex)), len(corners.vertex)),
        }.get(interpolation, (corners.vertex, points))
        available = len(values) if indices is None else len(indices)
        fits = available >= count and len(values) > 0
        if fits and indices is not None:
            rows = indices[rows]
            fits = bool(((rows >= 0) & (rows < len(values))).all())
        if not fits:
            self._unread.count("primvar of another length than its mesh", "primvars of other lengths than their meshes")
            return None
        return _Values(values, rows)

    def _bound(self, prim: Any, corners: _Corners, otherwise: Any) -> "_Bound":
        """Return the materials of the faces of a mesh, −1 for holes."""
        api, count = UsdShade.MaterialBindingAPI(prim), len(corners.sizes)
        listed, face = [_material(api) or otherwise], np.zeros(count, np.int64)
        for subset in api.GetMaterialBindSubsets():
            faces = _integers(subset.GetIndicesAttr().Get(self._time))
            if len(faces) and (int(faces.min()) < 0 or int(faces.max()) >= count):
                raise UsdError(f"{subset.GetPrim().GetPath()}: indices refers to faces beyond the {count} of the mesh")
            face[faces] = len(listed)
            listed.append(_material(UsdShade.MaterialBindingAPI(subset.GetPrim())) or listed[0])
        face[corners.holes] = -1
        return _Bound(listed, face)

    def _primitive(self, columns: dict[str, _Values], faces: Ints, look: Look, piece: Piece) -> Header:
        """Write the vertices that some triangles use and return the primitive of these; faces: (F, 3) corners."""
        used, _, corner = distinct_numbers(faces.ravel())
        key = np.zeros(len(used), np.int64)
        for column in columns.values():
            rows = column.row[used]
            key = distinct_numbers(key)[2] * (int(rows.max(initial=0)) + 1) + rows
        _, first, number = distinct_numbers(key)
        rows = used[first]
        attributes = {
            name: self._builder.accessor(column.values[column.row[rows]].astype(np.float32))
            for name, column in columns.items()
        }
        primitive: Header = {
            "attributes": attributes,
            "indices": self._builder.accessor(number[corner].astype(np.uint32)),
        }
        if look.number is not None:
            primitive["material"] = look.number
        return primitive


class _Bound(NamedTuple):
    """Materials, None for none, and which of them each face has (P,)."""

    listed: list[Any]
    face: Ints


def _material(api: Any) -> Any:
    """Return the material that a prim is bound to; None without one."""
    material = api.ComputeBoundMaterial()[0]
    return material if material else None


def _array(values: Any, width: int) -> NDArray[np.float32]:
    """Return values of USD as an array (n, width); none if there are none, or of another width."""
    found = np.asarray(values if values is not None else (), np.float32)
    if found.ndim == 1 and found.size == width:
        found = found[None]
    return found if found.ndim == 2 and found.shape[1] == width else np.zeros((0, width), np.float32)


def _integers(values: Any) -> Ints:
    return np.asarray(values if values is not None else (), np.int64).ravel()


def _moved(points: _Array, matrix: NDArray[np.float64]) -> _Array:
    """Return points (V, 3) in the frame of the model."""
    if np.array_equal(matrix, np.eye(4)):
        return points
    return points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


def _turned(normals: _Array, matrix: NDArray[np.float64]) -> _Array:
    """Return unit normals (V, 3) in the frame of the model, NaN where there is none: it is made from the triangles."""
    linear, found = matrix[:3, :3], normals.astype(np.float64)
    with np.errstate(all="ignore"):
        if not np.array_equal(linear, np.eye(3)) and np.linalg.det(linear) != 0:
            found = found @ np.linalg.inv(linear)
        return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))
