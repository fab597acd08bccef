"""Make triangles with materials of the files that this package reads."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.geometry.triangulation import triangulated
from depthwalk.ingest.interchange.model import Model, Placed
from depthwalk.ingest.material_library import MaterialLibrary
from depthwalk.ingest.materials import plain_material
from depthwalk.ingest.mesh import Material
from depthwalk.ingest.soup import Soup, check_mesh_memory, check_triangle_count, joined_soups, unit_normals
from depthwalk.ingest.sources import Sources

_T = TypeVar("_T", bound=np.generic)


@np.errstate(all="ignore")  # places that are not finite are found where triangles are made
def parse(data: bytes, path: Path, *, geometry: bool = True) -> Model:
    """Parse a file of one of `formats.INTERCHANGE_SUFFIXES`.

    Parameters
    ----------
    data
        The contents of the file.
    path
        The file, for messages and for the format.
    geometry
        Whether to decode meshes; otherwise only the materials are.

    Returns
    -------
    Model
        What it contains.

    Raises
    ------
    InputError
        `path: defect`; for damaged data also ValueError, TypeError, LookupError and others.
    """
    return _parser(path.suffix.lower())(data, path, geometry)


def _parser(suffix: str) -> Callable[[bytes, Path, bool], Model]:
    """Import the reader of a format, and return it."""
    if suffix == ".fbx":
        from depthwalk.ingest.interchange.fbx import parse_fbx

        return parse_fbx
    if suffix == ".dae":
        from depthwalk.ingest.interchange.collada import parse_collada

        return parse_collada
    if suffix == ".3mf":
        from depthwalk.ingest.interchange.three_mf import parse_three_mf

        return parse_three_mf
    from depthwalk.ingest.interchange.three_ds import parse_three_ds

    return parse_three_ds


@np.errstate(all="ignore")
def read_interchange(data: bytes, path: Path, sources: Sources) -> Soup:
    """Read all triangles of a file, with the transforms of its nodes applied.

    Parameters
    ----------
    data
        The contents of the file.
    path
        The file, for messages and for the format.
    sources
        Reads the pictures that it names, from its own folder only.

    Returns
    -------
    Soup
        The triangles, y upward; in metres if the format has a unit.

    Raises
    ------
    InputError
        `path: defect`, and what `parse` raises.
    """
    model = parse(data, path)
    triangles = sum(each.polygons.triangle_count for each in model.placed)
    check_triangle_count(triangles, path)
    check_mesh_memory(sum(len(each.polygons.vertex) for each in model.placed), triangles, path)
    palette = _Palette(MaterialLibrary(model.materials, [path.parent], path, sources, model.embedded))
    pieces = [_piece(each, palette, path) for each in model.placed if each.polygons.triangle_count]
    return joined_soups(pieces, palette.materials)


class _Palette:
    """Collect materials in the order of their first use, and convert each once."""

    def __init__(self, library: MaterialLibrary) -> None:
        self.materials: list[Material] = []
        self._library = library
        self._numbers: dict[str | bool, int] = {}

    def number(self, name: str | None, coloured: bool) -> int:
        """Return the number of the material `name`, or of that of surfaces without one, which are `coloured` or not."""
        material = self._library.material(name)
        key = coloured if material is None or name is None else name
        if key not in self._numbers:
            self._numbers[key] = len(self.materials)
            self.materials.append(material or plain_material(coloured))
        return self._numbers[key]


def _piece(placed: Placed, palette: _Palette, path: Path) -> Soup:
    """Return the triangles of one mesh, in the frame of the file, with a vertex for each corner."""
    polygons, linear = placed.polygons, placed.matrix[:3, :3]
    vertex, count = polygons.vertex, len(polygons.vertex)
    if len(outside := np.flatnonzero((vertex < 0) | (vertex >= len(polygons.positions)))):
        last = len(polygons.positions) - 1
        raise InputError(f"{path}: a polygon refers to vertex {vertex[outside[0]]} of 0 to {last}")
    positions = polygons.positions[vertex]
    faces, polygon = triangulated(positions, polygons.sizes)
    positions = positions @ linear.T + placed.matrix[:3, 3]
    turn = float(np.linalg.det(linear))
    if turn < 0:
        faces = faces[:, ::-1]  # mirroring turns the faces inside out
    normals = np.full((count, 3), np.nan)
    if polygons.normals is not None and turn and np.isfinite(turn):
        normals = unit_normals(polygons.normals @ np.linalg.inv(linear))
    is_used = np.bincount(polygons.material[polygon], minlength=len(polygons.names)) > 0
    coloured = polygons.colours is not None
    numbers = np.array(
        [palette.number(n, coloured) if used else 0 for n, used in zip(polygons.names, is_used, strict=True)], np.int64
    )
    return Soup(
        positions=positions,
        normals=normals,
        colours=_or(polygons.colours, np.full((count, 3), 255, np.uint8)),
        uv=_or(polygons.uv, np.full((count, 2), np.nan)),
        faces=faces,
        material=numbers[polygons.material[polygon]],
        materials=(),
    )


def _or(given: NDArray[_T] | None, default: NDArray[_T]) -> NDArray[_T]:
    return default if given is None else given
