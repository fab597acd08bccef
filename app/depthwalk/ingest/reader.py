"""Read mesh files of every format into one flat list of triangles."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.errors import InputError, reason
from depthwalk.geometry.distinct import distinct_numbers
from depthwalk.ingest.formats import GLTF_SUFFIXES, INTERCHANGE_SUFFIXES, LAS_SUFFIXES, USD_SUFFIXES, check_suffix
from depthwalk.ingest.materials import plain_material
from depthwalk.ingest.mesh import Material
from depthwalk.ingest.mtl import material_libraries
from depthwalk.ingest.obj import Indices, ObjMesh, parse_obj
from depthwalk.ingest.point_cloud import PointCloud, cloud_soup
from depthwalk.ingest.preview import coarse_soup, thinned
from depthwalk.ingest.soup import Soup, check_mesh_memory, check_triangle_count, finite_faces, unit_normals
from depthwalk.ingest.sources import Sources, as_utf8

_MOST_UNIT = 2.0  # of colours from 0 to 1, which may be somewhat above; others are from 0 to 255, as some write them
_RECORD_SUFFIXES = (".stl", ".ply")
_OFF_BYTES = 24  # memory for reading an OFF file per byte, measured with a million triangles
_TEXT_BYTES = 12  # memory for reading an OBJ file per byte, measured with a million triangles


def read_soup(path: Path, sources: Sources | None = None, *, coarse: bool = False) -> Soup:
    """Read all triangles of a file of `formats.MESH_SUFFIXES`, or of the surface through its points if it has none.

    Parameters
    ----------
    path
        The mesh file.
    sources
        Reads files and keeps their bytes; None reads them from the disk.
    coarse
        Whether to make a coarse mesh quickly, see `coarse_soup` and `thinned`.

    Returns
    -------
    Soup
        The triangles, in the frame and unit of the file.

    Raises
    ------
    InputError
        `path: defect` or, in OBJ files, `path:line: defect`.
    """
    read = read_geometry(path, sources)
    with _told_as_damaged(path):
        if isinstance(read, PointCloud):
            return cloud_soup(thinned(read) if coarse else read, path, warns=not coarse)
        return coarse_soup(read) if coarse else read


def read_geometry(path: Path, sources: Sources | None = None) -> Soup | PointCloud:
    """Read all triangles of a file, or its points if it has none, without the surface through them.

    Parameters
    ----------
    path
        The mesh file.
    sources
        Reads files and keeps their bytes; None reads them from the disk.

    Returns
    -------
    Soup or PointCloud
        The triangles or points, in the frame and unit of the file.

    Raises
    ------
    InputError
        As `read_soup` does.
    """
    check_suffix(path)
    sources = sources or Sources()
    data = sources.read(path)
    if not data:
        raise InputError(f"{path}: empty file")
    suffix, named = _suffix_of(data), path.suffix.lower()
    is_either = {suffix, named} <= set(LAS_SUFFIXES)  # laspy reads either by both names
    if suffix and suffix != named and not is_either and named not in USD_SUFFIXES:  # which are GLB files by now
        raise InputError(f"{path}: holds {suffix[1:].upper()} data; rename it to {path.stem}{suffix}")
    if path.suffix.lower() == ".ply" and b"ply" not in data[:80].split(b"\n", 1)[0].lower():  # as trimesh tells them
        raise InputError(f"{path}: not a PLY file")
    with _told_as_damaged(path), np.errstate(invalid="ignore"):  # infinite coordinates may become NaN
        read = _read_any(data, path, sources)
    return read if isinstance(read, PointCloud) else finite_faces(read, path)


@contextmanager
def _told_as_damaged(path: Path) -> Iterator[None]:
    """Report whatever else than an InputError is raised in a `with` block as one about the file `path`."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:  # trimesh does not document what its parsers raise on damaged data
        kind = path.suffix[1:].upper()
        raise InputError(f"{path}: damaged, truncated or an unsupported kind of {kind} ({reason(error)})") from error


def _read_any(data: bytes, path: Path, sources: Sources) -> Soup | PointCloud:
    """Read a file by the reader of its format, which is imported only then: a scene of depth images needs none."""
    suffix = path.suffix.lower()
    if suffix == ".obj":
        return _read_obj(data, path, sources)
    if suffix == ".off":
        from depthwalk.ingest.off import obj_from_off

        check_memory(path, _OFF_BYTES * len(data), f"{len(data)} bytes of OFF text")
        return _read_obj(obj_from_off(as_utf8(data), path), path, sources)
    if suffix in LAS_SUFFIXES:
        from depthwalk.ingest.las.decoder import read_las

        return read_las(data, path)
    if suffix in INTERCHANGE_SUFFIXES:
        from depthwalk.ingest.interchange.reader import read_interchange

        return read_interchange(data, path, sources)
    if suffix in GLTF_SUFFIXES and (read := _read_gltf(data, path, sources)) is not None:
        return read
    if suffix in _RECORD_SUFFIXES:
        from depthwalk.ingest.binary_records import read_binary_ply, read_binary_stl

        soup = read_binary_stl(data, path) if suffix == ".stl" else read_binary_ply(data, path)
        if soup is None and suffix == ".ply":
            from depthwalk.ingest.ply_polygons import with_triangles

            if (rewritten := with_triangles(data, path)) is not None:
                data, soup = rewritten, read_binary_ply(rewritten, path)
        if soup is not None:
            return soup
    from depthwalk.ingest.trimesh_reader import read_by_trimesh

    return read_by_trimesh(data, path, sources)


def _read_gltf(data: bytes, path: Path, sources: Sources) -> Soup | PointCloud | None:
    """Read a glTF file of points, or of triangles as most programs write them; None for any other."""
    from depthwalk.ingest.gltf import read_header
    from depthwalk.ingest.gltf_points import holds_points, read_gltf_points
    from depthwalk.ingest.gltf_triangles import read_gltf_triangles

    header = read_header(data, path)
    if holds_points(header):
        return read_gltf_points(header, data, path, sources)
    return read_gltf_triangles(header, data, path, sources)


def _suffix_of(data: bytes) -> str | None:
    """Return the suffix that a file of these bytes should have, where they begin as no other format would."""
    if data.startswith(b"glTF"):
        return ".glb"
    if data.startswith((b"ply\n", b"ply\r")):
        return ".ply"
    if data.startswith(b"LASF"):  # the highest bit of its point format tells LAZ
        return ".laz" if data[104:105] >= b"\x80" else ".las"
    triangles = int.from_bytes(data[80:84], "little")  # of a binary STL file, which begins with any 80 bytes
    if len(data) == 84 + 50 * triangles or (data.startswith(b"solid ") and b"facet" in data[:1000]):
        return ".stl"
    if data.startswith(b"MM") and int.from_bytes(data[2:6], "little") == len(data):
        return ".3ds"
    if data[:100].lstrip().startswith(b"<") and b"<COLLADA" in data[:1000]:
        return ".dae"
    signatures = (
        (b"\x89PNG", ".png"),
        (b"\xff\xd8\xff", ".jpg"),
        (b"Kaydara FBX", ".fbx"),
        (b"; FBX", ".fbx"),
        (b"BLENDER", ".blend"),
    )
    return next((suffix for start, suffix in signatures if data.startswith(start)), None)


def _read_obj(data: bytes, path: Path, sources: Sources) -> Soup | PointCloud:
    """Return the triangles of an OBJ file with the materials of its libraries, those of the last group first.

    Without triangles, return its points.
    """
    check_memory(path, _TEXT_BYTES * len(data), f"{len(data)} bytes of OBJ text")
    data = as_utf8(data)
    mesh = parse_obj(data, path)
    if not len(mesh.sizes):
        normals = np.full(mesh.vertices.shape, np.nan) if mesh.normals is None else unit_normals(mesh.normals)
        return PointCloud(mesh.vertices, normals, _colours(mesh))
    check_triangle_count(mesh.triangle_count, path)
    check_mesh_memory(len(mesh.corners), mesh.triangle_count, path)
    vertex, texture, normal = mesh.corners.T - 1
    has_uv, has_normals = (
        mesh.texture is not None and texture.max() >= 0,
        mesh.normals is not None and normal.min() >= 0,
    )
    row, faces = _split_vertices([vertex, *([texture] if has_uv else []), *([normal] if has_normals else [])])
    vertex, texture, normal = vertex[row], texture[row], normal[row]
    count = len(row)
    uv, normals = np.full((count, 2), np.nan), np.full((count, 3), np.nan)
    if mesh.texture is not None and has_uv:
        uv = np.where(texture[:, None] < 0, 0.0, mesh.texture[texture])  # 0 for corners without, if others have them
    if mesh.normals is not None and has_normals:
        normals = unit_normals(mesh.normals[normal])
    colours = _colours(mesh)
    colours = np.full((count, 3), 255, np.uint8) if colours is None else colours[vertex]

    triangles, group = _triangles(mesh)
    numbers, materials = _materials(mesh, data, path, sources)
    return Soup(
        positions=mesh.vertices[vertex] + 0.0,
        normals=normals,
        colours=colours,
        uv=uv,
        faces=faces[triangles],
        material=numbers[group],
        materials=materials,
    )


def _colours(mesh: ObjMesh) -> NDArray[np.uint8] | None:
    """Return the colours (v, 3) of vertices, sRGB; None if the file has none."""
    if mesh.colours is None:
        return None
    unit = np.nan_to_num(mesh.colours, nan=0.0, posinf=0.0, neginf=0.0)
    if unit.max(initial=0.0) > _MOST_UNIT:
        unit = unit / 255.0
    return (np.clip(unit, 0.0, 1.0) * 255.0).round().astype(np.uint8)


def _split_vertices(columns: list[Indices]) -> tuple[Indices, Indices]:
    """Assign numbers to the distinct combinations of indices (C,) at the corners of polygons.

    Returns
    -------
    (V,) a corner with each combination, and (C,) the number of each corner's combination.
    """
    key = columns[0]
    for column in columns[1:]:
        key = distinct_numbers(key)[2] * (column.max() + 2) + column + 1  # below 2⁶³: (3 · 10⁹)²
    _, first, number = distinct_numbers(key)
    return first, number


def _triangles(mesh: ObjMesh) -> tuple[Indices, Indices]:
    """Cut polygons into triangles: fans, but for concave ones.

    Groups are in reverse order. In a group with quadrangles only, their first halves come before their second ones.
    Depth images baked earlier depend on this order.

    Returns
    -------
    (F, 3) the corners of each triangle, and (F,) its group.
    """
    fans = mesh.sizes - 2
    polygon = np.repeat(np.arange(len(fans)), fans)
    step = np.arange(len(polygon)) - np.repeat(np.cumsum(fans) - fans, fans)
    start = (np.cumsum(mesh.sizes) - mesh.sizes)[polygon]
    triangles = np.stack([start, start + step + 1, start + step + 2], axis=1)
    if (mesh.sizes > 3).any():
        from depthwalk.geometry.triangulation import cut_concave  # which files of triangles do not need

        cut_concave(mesh.vertices[mesh.corners[:, 0] - 1], triangles, polygon, mesh.sizes)
    second_half = (mesh.sizes[polygon] == 4) & (step == 1)
    triangles[second_half] = np.roll(triangles[second_half], -1, axis=1)
    group = mesh.group[polygon]
    quads = np.bincount(mesh.group, mesh.sizes != 4) == 0
    if len(quads) == 1 and not quads[0]:
        return triangles, group
    order = np.lexsort([second_half & quads[group], -group])
    return triangles[order], group[order]


def _materials(mesh: ObjMesh, data: bytes, path: Path, sources: Sources) -> tuple[Indices, tuple[Material, ...]]:
    """Return the number of each group's material (G,), and the materials, last group first."""
    default = plain_material(mesh.colours is not None)
    found: list[Material | None] = [None] * len(mesh.material_names)
    if libraries := material_libraries(data, path, sources):
        from depthwalk.ingest.material_library import MaterialLibrary

        library = MaterialLibrary.read(libraries, path, sources)
        found = [library.material(name) for name in reversed(mesh.material_names)]
    materials: list[Material] = []
    numbers = np.zeros(len(found), np.int64)
    shared = -1
    for place, material in enumerate(found):
        if material is None and shared >= 0:
            numbers[-1 - place] = shared
            continue
        if material is None:
            shared = len(materials)
        numbers[-1 - place] = len(materials)
        materials.append(material or default)
    return numbers, tuple(materials)
