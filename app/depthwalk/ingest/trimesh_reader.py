"""Read PLY, STL, glTF and GLB files of all kinds through trimesh, and check what trimesh does not.

Imported only for files that `binary_records` and `gltf_triangles` leave to it, since trimesh takes most of a second to
import.
"""

import io
import logging
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.resolvers import FilePathResolver
from trimesh.transformations import fix_rigid
from trimesh.visual.texture import TextureVisuals

from depthwalk.errors import InputError
from depthwalk.ingest import gltf
from depthwalk.ingest.formats import GLTF_SUFFIXES, USD_SUFFIXES
from depthwalk.ingest.gltf_accessors import Accessors
from depthwalk.ingest.gltf_expressed import expressed
from depthwalk.ingest.image import TextureDecoder, check_picture
from depthwalk.ingest.materials import convert_material, plain_material, without_light
from depthwalk.ingest.mesh import Material
from depthwalk.ingest.ply import check_packing, with_usual_colours
from depthwalk.ingest.point_cloud import PointCloud
from depthwalk.ingest.soup import (
    Soup,
    check_geometry,
    check_mesh_memory,
    check_triangle_count,
    joined_soups,
    placed_soup,
    unit_normals,
)
from depthwalk.ingest.sources import Sources, as_utf8, read_named
from depthwalk.ingest.trimesh_points import joined_points, ply_columns, srgb_colours

logging.getLogger("trimesh").setLevel(logging.ERROR)  # it warns, with tracebacks, about things that are checked here

_NEXT_SOLID = re.compile(rb"endsolid[^\n]*\n\s*solid[^\n]*(?=\n)", re.IGNORECASE)

_Placed = list[tuple[trimesh.Trimesh, NDArray[np.float64]]]  # meshes and their scene_from_mesh matrices (4, 4)
_PlacedPoints = list[tuple[trimesh.PointCloud, NDArray[np.float64]]]


def read_by_trimesh(data: bytes, path: Path, sources: Sources) -> Soup | PointCloud:
    """Read all triangles of a file, or its points if it has none, with the transforms of its scene graph applied.

    Parameters
    ----------
    data
        The contents of the file.
    path
        The file, for messages and for the format.
    sources
        Reads files and keeps their bytes.

    Returns
    -------
    Soup or PointCloud
        The triangles or points, in the frame and unit of the file.

    Raises
    ------
    InputError
        `path: defect`. trimesh itself raises nearly anything for damaged data.
    """
    folder = _Folder(path, sources)
    placed, points = _placed(_read_scene(path, data, folder), path)
    is_gltf = path.suffix.lower() in GLTF_SUFFIXES
    if points and not placed:
        return joined_points(points)
    triangles = sum(len(mesh.faces) for mesh, _ in placed)
    check_triangle_count(triangles, path)
    check_mesh_memory(sum(len(mesh.vertices) for mesh, _ in placed), triangles, path)
    soup = _joined(placed, path, linear_colours=is_gltf)
    if is_gltf and gltf.is_unlit(gltf.read_header(data, path)):
        soup = replace(soup, materials=tuple(map(without_light, soup.materials)))
    if folder.defects:
        raise folder.defects[0]
    return soup


class _Folder(FilePathResolver):
    """Serve the files that a mesh names to trimesh, from the mesh's own folder only.

    trimesh swallows exceptions from `get`; errors about damaged pictures are therefore also stored in `defects`.
    """

    def __init__(self, path: Path, sources: Sources) -> None:
        super().__init__(str(path))
        self.mesh = path
        self.sources = sources
        self.defects: list[InputError] = []
        self.made: dict[str, bytes] = {}  # contents of files that exist in memory only

    def get(self, name: str) -> bytes:
        """Return the contents of the file `name`. Raises FileNotFoundError, and InputError for a bad picture."""
        if name in self.made:
            return self.made[name]
        path, data = read_named(name, self.mesh, self.sources)
        try:
            check_picture(path, data)
        except InputError as error:
            self.defects.append(error)
            raise
        return data


def _read_scene(path: Path, data: bytes, folder: _Folder) -> trimesh.Scene:
    suffix = path.suffix.lower()
    if suffix == ".stl":
        data = _checked_stl(data, path)
    elif suffix == ".ply":
        head = data[: data.find(b"end_header")]
        check_packing(head, path)
        if (
            readable := with_usual_colours(as_utf8(head))
        ) is not head:  # only if needed: a copy takes as much memory as the file
            data = readable + data[len(head) :]
    elif suffix in GLTF_SUFFIXES:
        data = _expressed(data, path, folder)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.filterwarnings("error", message="string or file could not be read")  # numbers cut short
        kind = "glb" if suffix in USD_SUFFIXES else suffix[1:]  # as which `Sources` reads it
        return trimesh.load_scene(io.BytesIO(data), file_type=kind, resolver=folder, process=False)


def _expressed(data: bytes, path: Path, folder: _Folder) -> bytes:
    """Return a glTF file that `trimesh` reads right; `folder` serves its buffers, and one that is added."""
    header = gltf.read_header(data, path)
    accessors = Accessors(header, data, folder.get)
    changed = expressed(header, accessors, len(data), path, folder.sources)
    folder.made |= accessors.added
    return gltf.with_header(data, header, path) if changed else data


def _checked_stl(data: bytes, path: Path) -> bytes:
    """Return an STL file of text, converted to UTF-8 and to one solid.

    trimesh makes a mesh of each solid, which takes longer than reading a hundred triangles.
    """
    if b"facet" not in data.lower():
        raise InputError(f"{path}: neither a whole binary STL file nor one of text")
    return _NEXT_SOLID.sub(b"", as_utf8(data))


def _placed(scene: trimesh.Scene, path: Path) -> tuple[_Placed, _PlacedPoints]:
    """Return every use of a triangle mesh, and of a cloud of points, in the scene graph, checked."""
    placed: _Placed = []
    points: _PlacedPoints = []
    for name, matrix in _matrices(scene.graph):
        drawn = scene.geometry[name]
        if isinstance(drawn, trimesh.Trimesh) and len(drawn.faces):
            placed.append((drawn, matrix))
        elif isinstance(drawn, trimesh.PointCloud) and len(drawn.vertices):
            points.append((drawn, matrix))
    for mesh in {id(mesh): mesh for mesh, _ in placed}.values():
        _check(mesh, path)
    for cloud in {id(cloud): cloud for cloud, _ in points}.values():
        _check_ply_elements(cloud, path)
        if np.shape(cloud.vertices)[1:] != (3,):
            raise InputError(f"{path}: points need three coordinates")
    return placed, points


def _matrices(graph: Any) -> Iterator[tuple[str, NDArray[np.float64]]]:
    """Yield the name of each geometry in the scene graph and its matrix (4, 4), one pair for each placement.

    `graph.get` multiplies all matrices from the root down for each node, in time quadratic in the depth.
    """
    parents, steps = graph.transforms.parents, graph.transforms.edge_data
    known: dict[object, NDArray[np.float64]] = {graph.base_frame: np.eye(4)}
    for node in graph.nodes_geometry:
        above: dict[object, None] = {}
        at = node
        while at not in known:
            if at in above or at not in parents:
                raise ValueError("a node that hangs from no scene")
            above[at] = None
            at = parents[at]
        for child in reversed(above):
            step = steps[parents[child], child].get("matrix")
            known[child] = known[parents[child]] if step is None else known[parents[child]] @ step
        yield graph.transforms.node_data[node]["geometry"], fix_rigid(known[node], max_deviance=graph.repair_rigid)


def _check(mesh: trimesh.Trimesh, path: Path) -> None:
    _check_ply_elements(mesh, path)
    check_geometry(mesh.vertices, mesh.faces, path)


def _check_ply_elements(drawn: trimesh.Trimesh | trimesh.PointCloud, path: Path) -> None:
    """Raise InputError if an ASCII file ends early, which trimesh does not notice."""
    for name, element in drawn.metadata.get("_ply_raw", {}).items():
        data = element.get("data")
        columns = data.values() if isinstance(data, dict) else [] if data is None else [data]
        found = min(map(len, columns), default=0)
        if found < element["length"]:
            raise InputError(f"{path}: truncated: {found} of {element['length']} PLY {name} elements")


@dataclass
class _Palette:
    """Collect materials in the order of their first use, and convert each once."""

    path: Path
    materials: list[Material] = field(default_factory=list)
    numbers: dict[object, int] = field(default_factory=dict)
    textures: TextureDecoder = field(default_factory=TextureDecoder)

    def number(self, mesh: trimesh.Trimesh, coloured: bool) -> int:
        source = getattr(mesh.visual, "material", None)
        material = None
        key: object = id(source)
        if key not in self.numbers:
            material = convert_material(source, str(self.path), self.textures, _file_uv(mesh))
            if material is None:
                key = coloured
        if key not in self.numbers:
            self.numbers[key] = len(self.materials)
            self.materials.append(material or plain_material(coloured))
        return self.numbers[key]


def _joined(placed: _Placed, path: Path, *, linear_colours: bool) -> Soup:
    """Merge all meshes into one, in the frame of the scene."""
    palette = _Palette(path)
    pieces = [_piece(mesh, matrix, palette, linear_colours) for mesh, matrix in placed]
    return joined_soups(pieces, palette.materials)


def _piece(mesh: trimesh.Trimesh, matrix: NDArray[np.float64], palette: _Palette, linear_colours: bool) -> Soup:
    """Return one mesh, placed by the matrix (4, 4); the palette collects its materials."""
    positions, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    visual: Any = mesh.visual
    normals, uv = _file_normals(mesh), _file_uv(mesh)
    colours = _file_colours(mesh, linear_colours)
    if visual.kind == "face" and colours is None:
        flat = faces.ravel()
        colours = np.repeat(np.asarray(visual.face_colors)[:, :3], 3, axis=0)
        positions, normals, uv, faces = positions[flat], normals[flat], uv[flat], np.arange(faces.size).reshape(-1, 3)
    number = palette.number(mesh, colours is not None)
    return placed_soup(positions, faces, normals=normals, uv=uv, colours=colours, material=number, matrix=matrix)


def _file_normals(mesh: trimesh.Trimesh) -> NDArray[np.float64]:
    """Return the normals (V, 3) of the file, NaN where they are absent, zero or not finite."""
    # The property would compute absent ones; only the cache shows which were given.
    if "vertex_normals" not in mesh._cache.cache:
        return np.full((len(mesh.vertices), 3), np.nan)
    return unit_normals(np.array(mesh.vertex_normals, np.float64))


def _file_uv(mesh: trimesh.Trimesh) -> NDArray[np.float64]:
    """Return the texture coordinates (V, 2) of the file, NaN where it has none."""
    count = len(mesh.vertices)
    uv = getattr(mesh.visual, "uv", None)
    for names in (("s", "t"), ("u", "v"), ("texture_u", "texture_v")):  # trimesh reads a PLY's uv only per face
        if uv is None:
            uv = ply_columns(mesh, *names)
    if uv is None or np.shape(uv) != (count, 2):
        return np.full((count, 2), np.nan)
    return np.asarray(uv, np.float64)


def _file_colours(mesh: trimesh.Trimesh, linear: bool) -> NDArray[np.uint8] | None:
    """Return the vertex colours (V, 3), sRGB, of a mesh whose own are `linear` or not; None if it has none."""
    visual: Any = mesh.visual
    if isinstance(visual, TextureVisuals):
        values = visual.vertex_attributes.get("color", mesh.vertex_attributes.get("color"))
    else:
        values = visual.vertex_colors if visual.kind == "vertex" else None
    if values is None or np.shape(values) not in ((len(mesh.vertices), 3), (len(mesh.vertices), 4)):
        return None
    return srgb_colours(np.asarray(values), linear=linear)
