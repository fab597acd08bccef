"""Mesh files → one flat list of triangles, through trimesh, with everything it lets pass checked."""

import io
import logging
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.resolvers import FilePathResolver
from trimesh.visual.color import to_rgba
from trimesh.visual.texture import TextureVisuals

from depthwalk.colour import srgb8_from_linear
from depthwalk.errors import InputError
from depthwalk.ingest import gltf, obj
from depthwalk.ingest.image import IMAGE_SUFFIXES, open_image
from depthwalk.ingest.materials import WHITE, convert_material
from depthwalk.ingest.mesh import Material
from depthwalk.ingest.sources import (
    Sources,
    as_utf8,
    check_suffix,
    find,
    material_libraries,
    read_libraries,
    texture_name,
)
from depthwalk.limits import MAX_MESH_TRIANGLES

logging.getLogger("trimesh").setLevel(logging.ERROR)  # it warns with tracebacks of what is checked here


@dataclass(frozen=True)
class Soup:
    """Triangles as the file has them, in its own frame and units.

    positions: (V, 3) float64; normals: (V, 3) float64, NaN where the file has none; colours: (V, 3) uint8, sRGB;
    uv: (V, 2) float64, v upward, NaN where the file has none; faces: (F, 3) int64; material: (F,) int64, an index
    into `materials`.
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float64]
    colours: NDArray[np.uint8]
    uv: NDArray[np.float64]
    faces: NDArray[np.int64]
    material: NDArray[np.int64]
    materials: tuple[Material, ...]


def read_soup(path: Path, sources: Sources | None = None) -> Soup:
    """All triangles of a file, its scene graph flattened. sources: where its files, and those it names, are read from.
    Raises InputError, `path: defect`."""
    check_suffix(path)
    suffix = path.suffix.lower()
    sources = sources or Sources()
    data = sources.read(path)
    if not data:
        raise InputError(f"{path}: empty file")
    folder = _Folder(path, data, sources)
    try:
        scene = _read_scene(path, data, folder)
        placed = _placed(scene, path)
        soup = _joined(placed, path, linear_colours=suffix in (".glb", ".gltf"))
    except InputError:
        raise
    except Exception as error:  # trimesh documents none of what its parsers raise on damaged data
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:100]
        kind = suffix[1:].upper()
        raise InputError(f"{path}: damaged, truncated or an unsupported kind of {kind} ({reason})") from error
    if folder.defects:
        raise folder.defects[0]
    return soup


class _Folder(FilePathResolver):
    """Serves the files that a mesh names, from its own folder only; trimesh swallows what this raises."""

    def __init__(self, path: Path, data: bytes, sources: Sources) -> None:
        super().__init__(str(path))
        self.mesh = path
        self.sources = sources
        self.libraries = material_libraries(data, path.parent, sources) if path.suffix.lower() == ".obj" else []
        self.folders = [path.parent, *(library.parent for library in self.libraries)]
        self.defects: list[InputError] = []

    def get(self, name: str) -> bytes:
        if name == obj.LIBRARY:
            return read_libraries(self.libraries, self.sources)
        path = find(texture_name(name), self.folders, self.sources, self.mesh)
        if path is None:
            raise FileNotFoundError(name)
        data = self.sources.read(path)
        if path.suffix.lower() in IMAGE_SUFFIXES:  # else a glTF buffer
            self._check_image(data, path)
        return data

    def _check_image(self, data: bytes, path: Path) -> None:
        try:
            open_image(data, str(path)).close()
        except InputError as error:
            self.defects.append(error)
            raise


def _read_scene(path: Path, data: bytes, folder: _Folder) -> trimesh.Scene:
    suffix = path.suffix.lower()
    if suffix == ".obj":
        data = obj.prepare_obj(as_utf8(data), path)
    elif suffix == ".stl":
        data = _checked_stl(data, path)
    elif suffix == ".ply":
        head = data[: data.find(b"end_header")]
        if (readable := as_utf8(head)) is not head:  # else not: a copy takes as much memory as the file
            data = readable + data[len(head) :]
    elif suffix in (".glb", ".gltf"):
        header = gltf.read_header(data, path)
        gltf.check_header(header, path)
        for uri in gltf.external_uris(header, "buffers"):
            if find(uri, folder.folders, folder.sources) is None:
                raise InputError(f"{path}: buffer {uri!r} is missing or outside the folder")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.filterwarnings("error", message="string or file could not be read")  # numbers cut short
        return trimesh.load_scene(io.BytesIO(data), file_type=suffix[1:], resolver=folder, process=False)


def _checked_stl(data: bytes, path: Path) -> bytes:
    """The file, in UTF-8 where it is text; trimesh takes for text whatever has not the length of a binary one."""
    if len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):  # a header, 50 bytes a triangle
        return data
    if b"facet" not in data.lower():
        raise InputError(f"{path}: neither a whole binary STL file nor one of text")
    return as_utf8(data)


def _placed(scene: trimesh.Scene, path: Path) -> list[tuple[trimesh.Trimesh, NDArray[np.float64]]]:
    """Every use of a triangle mesh in the scene graph, with its scene_from_mesh matrix (4, 4)."""
    placed = []
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        mesh = scene.geometry[name]
        if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
            placed.append((mesh, matrix))
    for mesh in {id(mesh): mesh for mesh, _ in placed}.values():
        _check(mesh, path)
    count = sum(len(mesh.faces) for mesh, _ in placed)
    if count == 0:
        raise InputError(f"{path}: no faces")
    if count > MAX_MESH_TRIANGLES:
        raise InputError(f"{path}: too large: {count} triangles, the limit is {MAX_MESH_TRIANGLES}")
    return placed


def _check(mesh: trimesh.Trimesh, path: Path) -> None:
    faces, vertices = mesh.faces, mesh.vertices
    for name, element in mesh.metadata.get("_ply_raw", {}).items():
        _check_ply_element(name, element, path)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
        raise InputError(f"{path}: vertices need three coordinates and faces at least three corners")
    outside = (faces < 0) | (faces >= len(vertices))
    if outside.any():
        row, column = np.argwhere(outside)[0]
        raise InputError(f"{path}: face {row} refers to vertex {faces[row, column]} of 0 to {len(vertices) - 1}")
    if broken := np.count_nonzero(~np.isfinite(vertices).all(axis=1)):
        raise InputError(f"{path}: {broken} of {len(vertices)} vertices have NaN or infinite coordinates")


def _check_ply_element(name: str, element: dict[str, Any], path: Path) -> None:
    """trimesh pads nothing and reports nothing where an ASCII file ends early."""
    data = element.get("data")
    columns = data.values() if isinstance(data, dict) else [] if data is None else [data]
    found = min(map(len, columns), default=0)
    if found < element["length"]:
        raise InputError(f"{path}: truncated: {found} of {element['length']} PLY {name} elements")


@dataclass
class _Palette:
    """Materials in the order of their first use, each converted once."""

    path: Path
    materials: list[Material] = field(default_factory=list)
    numbers: dict[object, int] = field(default_factory=dict)

    def number(self, mesh: trimesh.Trimesh, coloured: bool) -> int:
        source = getattr(mesh.visual, "material", None)
        material = None
        key: object = id(source)
        if key not in self.numbers:
            material = convert_material(source, str(self.path))
            if material is None:
                key = coloured
        if key not in self.numbers:
            self.numbers[key] = len(self.materials)
            self.materials.append(material or (Material(base_colour=WHITE) if coloured else Material()))
        return self.numbers[key]


def _joined(placed: list[tuple[trimesh.Trimesh, NDArray[np.float64]]], path: Path, *, linear_colours: bool) -> Soup:
    palette = _Palette(path)
    pieces = []
    first = 0
    for mesh, matrix in placed:
        piece = _piece(mesh, matrix, palette, linear_colours)
        pieces.append((*piece[:4], piece[4] + first, np.full(len(piece[4]), piece[5])))
        first += len(piece[0])
    positions, normals, colours, uv, faces, material = (np.concatenate(column) for column in zip(*pieces, strict=True))
    return Soup(positions, normals, colours, uv, faces, material, tuple(palette.materials))


def _piece(mesh: trimesh.Trimesh, matrix: NDArray[np.float64], palette: _Palette, linear_colours: bool) -> tuple:
    """positions, normals, colours, uv, faces and material number of one placed mesh, as in Soup."""
    positions, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    visual: Any = mesh.visual
    normals, uv = _file_normals(mesh), _file_uv(mesh)
    colours = _file_colours(mesh, linear_colours)
    if visual.kind == "face" and colours is None:
        flat = faces.ravel()
        colours = np.repeat(np.asarray(visual.face_colors)[:, :3], 3, axis=0)
        positions, normals, uv, faces = positions[flat], normals[flat], uv[flat], np.arange(faces.size).reshape(-1, 3)
    number = palette.number(mesh, colours is not None)
    if colours is None:
        colours = np.full((len(positions), 3), 255, np.uint8)
    linear = matrix[:3, :3]
    if (turn := np.linalg.det(linear)) < 0:
        faces = faces[:, ::-1]  # a mirror turns the faces inside out
    normals = normals @ np.linalg.inv(linear) if turn else np.full_like(normals, np.nan)
    return positions @ linear.T + matrix[:3, 3], normals, colours, uv, faces, number


def _file_normals(mesh: trimesh.Trimesh) -> NDArray[np.float64]:
    """(V, 3) as the file has them, NaN where absent, zero or not finite."""
    # The property would compute absent ones; only the cache tells which were given.
    if "vertex_normals" not in mesh._cache.cache:
        return np.full((len(mesh.vertices), 3), np.nan)
    normals = np.array(mesh.vertex_normals, np.float64)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(np.isfinite(lengths) & (lengths > 1e-6), normals / lengths, np.nan)


def _file_uv(mesh: trimesh.Trimesh) -> NDArray[np.float64]:
    count = len(mesh.vertices)
    uv = getattr(mesh.visual, "uv", None)
    vertex = mesh.metadata.get("_ply_raw", {}).get("vertex", {}).get("data", {})
    for u, v in (("s", "t"), ("u", "v"), ("texture_u", "texture_v")):  # trimesh reads a PLY's uv of faces only
        names = vertex.keys() if isinstance(vertex, dict) else vertex.dtype.names
        if uv is None and u in names and v in names and len(vertex[u]) == count:
            uv = np.column_stack([vertex[u], vertex[v]])
    if uv is None or np.shape(uv) != (count, 2):
        return np.full((count, 2), np.nan)
    return np.asarray(uv, np.float64)


def _file_colours(mesh: trimesh.Trimesh, linear: bool) -> NDArray[np.uint8] | None:
    """(V, 3) uint8, sRGB, or None. glTF's colours are linear, everybody else's sRGB."""
    visual: Any = mesh.visual
    if isinstance(visual, TextureVisuals):
        values = visual.vertex_attributes.get("color", mesh.vertex_attributes.get("color"))
    else:
        values = visual.vertex_colors if visual.kind == "vertex" else None
    if values is None or np.shape(values) not in ((len(mesh.vertices), 3), (len(mesh.vertices), 4)):
        return None
    values = np.asarray(values)
    if not linear:
        return to_rgba(np.array(values))[:, :3].astype(np.uint8)
    unit = values[:, :3] / (255.0 if values.dtype == np.uint8 else 1.0)
    return srgb8_from_linear(unit)
