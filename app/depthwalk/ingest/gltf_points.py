"""Read the points of glTF files that show no triangles, and tell of those beside triangles, which are not drawn.

trimesh drops the normals of points, their indices and the colour of their material, so its reader is not used.
"""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import counted
from depthwalk.ingest.gltf import POINTS, TRIANGLES, object_under, objects_under
from depthwalk.ingest.gltf_accessors import Accessors
from depthwalk.ingest.gltf_compression import decompress_checked
from depthwalk.ingest.gltf_geometry import express
from depthwalk.ingest.gltf_pose import world_matrices
from depthwalk.ingest.gltf_sizes import read_buffer
from depthwalk.ingest.point_cloud import PointCloud, joined_clouds
from depthwalk.ingest.soup import srgb8_from_file, unit_normals
from depthwalk.ingest.sources import Sources

log = logging.getLogger(__name__)

Header = dict[str, Any]
_Primitive = dict[str, Any]


def read_gltf_points(header: Header, data: bytes, path: Path, sources: Sources) -> PointCloud | None:
    """Read the points that the scene of a glTF file shows, placed by its nodes, if it shows no triangles.

    Parameters
    ----------
    header
        The JSON header of a file that holds points; changed in place.
    data
        The contents of the file.
    path
        The file, for messages, and to find its buffers beside it.
    sources
        Reads files and keeps their bytes.

    Returns
    -------
    PointCloud or None
        The points, in the frame of the scene, metres, with the normals and the colours of the file: COLOR_0, or white,
        times the colour of the material. None if the scene shows triangles, or no points.

    Raises
    ------
    InputError
        `path: defect`.
    ValueError, TypeError, LookupError, AttributeError
        For damaged data.
    """
    accessors = Accessors(header, data, lambda uri: read_buffer(uri, path, sources))
    decompress_checked(header, accessors, len(data), path, sources)
    express(header, accessors)
    shown = list(_shown(header))
    if any(_mode(primitive) >= TRIANGLES for primitive, _ in shown):
        return None
    clouds = [_cloud(primitive, matrix, header, accessors) for primitive, matrix in shown if _mode(primitive) == POINTS]
    return joined_clouds(clouds) if clouds else None


def holds_points(header: Header) -> bool:
    """Return whether there are points in a glTF file, by its JSON header, of which parts may be malformed."""
    return any(_mode(primitive) == POINTS for primitive in _primitives(header))


def undrawn_beside(header: Header) -> list[str]:
    """Return what a glTF file holds that is neither triangles nor a scan, such as "12 points" and "3 sets of lines".

    Points count only where there are triangles, too: without any they are a scan, which is drawn.

    Parameters
    ----------
    header
        The JSON header; parts of it may be malformed, and count as none.
    """
    modes = [_mode(primitive) for primitive in _primitives(header)]
    lines, has_triangles = sum(POINTS < mode < TRIANGLES for mode in modes), any(mode >= TRIANGLES for mode in modes)
    points = sum(_point_count(each, header) for each in _primitives(header) if _mode(each) == POINTS)
    texts = [counted(points, "point")] if points and has_triangles else []
    return [*texts, *([f"{lines} sets of lines" if lines > 1 else "1 set of lines"] if lines else [])]


def warn_of_undrawn(header: Header, path: Path) -> None:
    """Log which points and lines of the file `path`, whose JSON header is given, are not drawn."""
    if texts := undrawn_beside(header):
        log.warning("%s: not drawn: %s, since the file has triangles", path, " and ".join(texts))


def _primitives(header: Header) -> Iterator[_Primitive]:
    for mesh in objects_under(header, "meshes"):
        yield from objects_under(mesh, "primitives")


def _mode(primitive: _Primitive) -> int:
    mode = primitive.get("mode", TRIANGLES)
    return mode if isinstance(mode, int) else TRIANGLES


def _point_count(primitive: _Primitive, header: Header) -> int:
    """Return how many points a primitive has; 0 if it is malformed."""
    try:
        number = primitive["indices"] if "indices" in primitive else primitive["attributes"]["POSITION"]
        return int(header["accessors"][number]["count"])
    except (LookupError, TypeError, ValueError):
        return 0


def _shown(header: Header) -> Iterator[tuple[_Primitive, NDArray[np.float64]]]:
    """Yield every use of a primitive in the scene, and its scene_from_mesh matrix (4, 4)."""
    nodes = header.get("nodes", [])
    roots = header["scenes"][header.get("scene", 0)].get("nodes", []) if nodes else []
    for number, matrix in sorted(world_matrices(nodes, roots).items()):
        if "mesh" in nodes[number]:
            for primitive in header["meshes"][nodes[number]["mesh"]]["primitives"]:
                yield primitive, matrix


def _cloud(primitive: _Primitive, matrix: NDArray[np.float64], header: Header, accessors: Accessors) -> PointCloud:
    """Return the points of a primitive, placed by the matrix (4, 4)."""
    attributes = primitive["attributes"]
    positions = accessors.read(attributes["POSITION"]).astype(np.float64)
    count = len(positions)
    normals = np.full((count, 3), np.nan)
    if "NORMAL" in attributes and np.linalg.det(matrix[:3, :3]):
        found = accessors.read(attributes["NORMAL"], count).astype(np.float64)
        normals = unit_normals(found @ np.linalg.inv(matrix[:3, :3]))
    colours = _colours(primitive, count, header, accessors)
    if "indices" in primitive:
        rows = np.unique(accessors.read(primitive["indices"])[:, 0].astype(np.int64))  # each point once
        positions, normals = positions[rows], normals[rows]
        colours = None if colours is None else colours[rows]
    with np.errstate(invalid="ignore", over="ignore"):  # points may be infinite; `cloud_soup` drops them
        placed = positions @ matrix[:3, :3].T + matrix[:3, 3]
    return PointCloud(placed, normals, colours)


def _colours(primitive: _Primitive, count: int, header: Header, accessors: Accessors) -> NDArray[np.uint8] | None:
    """Return the colours (count, 3) of the points of a primitive, sRGB; None without any."""
    material = header["materials"][primitive["material"]] if "material" in primitive else {}
    factor = np.array(object_under(material, "pbrMetallicRoughness").get("baseColorFactor", (1, 1, 1, 1))[:3], float)
    if "COLOR_0" not in primitive["attributes"]:
        return None if (factor == 1).all() else np.tile(srgb8_from_file(factor[None]), (count, 1))
    values = accessors.read(primitive["attributes"]["COLOR_0"], count)[:, :3]
    if values.dtype.kind == "u":  # not marked as normalised, which glTF asks for
        values = values / np.iinfo(values.dtype).max
    return srgb8_from_file(values * factor)
