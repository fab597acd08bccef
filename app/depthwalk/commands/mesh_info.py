"""Describe meshes and scans for `depthwalk info`.

Readers are imported by the rows that need them, as in `info`.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import counted, missing_file

if TYPE_CHECKING:
    from depthwalk.ingest.mesh import Material, Mesh
    from depthwalk.ingest.point_cloud import PointCloud

TO_SEE_EVERY = "--verbose lists them"
_LISTED = 20  # materials or assets that are described each


def mesh_rows(path: Path, every: bool) -> Iterator[tuple[str, str]]:
    """Describe a mesh or a scan: names and texts; every: whether of every material, or else of the largest.

    Raises InputError if the file cannot be read.
    """
    from depthwalk.ingest.loader import mesh_of
    from depthwalk.ingest.point_cloud import PointCloud
    from depthwalk.ingest.reader import read_geometry
    from depthwalk.ingest.sources import Sources

    if not path.is_file():
        raise missing_file(path)
    sources = Sources()
    geometry = read_geometry(path, sources)
    if isinstance(geometry, PointCloud):
        yield from _cloud_rows(geometry, path)
    else:
        yield from _triangle_rows(mesh_of(geometry, path), path, every)
    if ignored := _unread(sources.read(path), path):
        yield "not read", ", ".join(ignored)


def _cloud_rows(cloud: "PointCloud", path: Path) -> Iterator[tuple[str, str]]:
    """Yield rows about a scan. The surface through its points is not made, which may take minutes."""
    from depthwalk.ingest.point_cloud import shown_points

    rows = shown_points(cloud, path)
    left_out = len(cloud.positions) - len(rows)
    with_normals = int(np.isfinite(cloud.normals[rows, 0]).sum())
    yield "kind", cloud.splats or "scan of points, of which the surface through them is drawn"
    yield "bytes", str(path.stat().st_size)
    yield (
        "points",
        f"{len(rows)}" + (f", without {left_out} that are not finite or at the place of another" if left_out else ""),
    )
    yield "colours", "none" if cloud.colours is None else "one for each point"
    if with_normals == len(rows):
        yield "normals", "one for each point"
    else:
        given = f"of {with_normals} points; the others are" if with_normals else "none; they are"
        yield "normals", f"{given} found from the points"
    yield from _size_rows(np.ptp(cloud.positions[rows], axis=0), path)


def _size_rows(extent: NDArray[np.floating], path: Path) -> Iterator[tuple[str, str]]:
    """Yield the lengths (3,) of a model's edges along the axes, metres, and a hint if these may be no metres."""
    from depthwalk.ingest.units import unit_hint

    yield "size", " × ".join(f"{length:g}" for length in extent.tolist()) + " m"
    if hint := unit_hint(path, extent, "--height of `bake`, `height` in a scene file"):
        yield "unit", hint


def _triangle_rows(mesh: "Mesh", path: Path, every: bool) -> Iterator[tuple[str, str]]:
    from depthwalk.ingest.texture_beside import texture_hint

    low, high = mesh.bounds
    yield "kind", "mesh"
    yield "bytes", str(path.stat().st_size)
    yield "triangles", str(len(mesh.faces) + len(mesh.translucent_faces))
    yield "vertices", str(len(mesh.positions))
    if tinted := bool((mesh.colours < 255).any()):
        yield "colours", "one for each vertex"
    yield from _size_rows(high - low, path)
    if hint := texture_hint(path, "--texture "):
        yield "texture", f"{hint}, or `texture` in a scene file"
    yield from _material_rows(mesh, tinted, every)


def largest(sizes: Sequence[int], every: bool) -> list[int]:
    """Return the numbers, in ascending order, of the largest of some `sizes`, or of `every` one, to be listed."""
    by_size = sorted(range(len(sizes)), key=lambda number: -sizes[number])
    return sorted(by_size if every else by_size[:_LISTED])


def _material_rows(mesh: "Mesh", tinted: bool, every: bool) -> Iterator[tuple[str, str]]:
    parts = (*mesh.parts, *mesh.translucent_parts)
    faces = [part.face_count for part in parts]
    shown = largest(faces, every)
    for part in (parts[number] for number in shown):
        yield f"material {part.material}", _material_text(mesh.materials[part.material], part.face_count, tinted)
    if others := len(parts) - len(shown):
        rest = counted(sum(faces) - sum(faces[number] for number in shown), "triangle")
        yield "other materials", f"{others}, {rest}; {TO_SEE_EVERY}"


def _material_text(material: "Material", faces: int, tinted: bool) -> str:
    """Describe a material with so many triangles; tinted: the mesh has colours of its own, so that no other is told."""
    from depthwalk.colour import srgb8_from_linear

    texture, relief = material.texture, material.normal_map
    colour = "no texture" if tinted else "colour #" + bytes(srgb8_from_linear(material.base_colour)).hex()
    image = colour if texture is None else f"texture {texture.shape[1]} × {texture.shape[0]}"
    bumps = "" if relief is None else f", normal map {relief.shape[1]} × {relief.shape[0]}"
    through = "" if material.opacity is None else f", see-through (alpha {material.opacity:.2g})"
    glow = ", glows" if material.glows else ""
    light = ", unlit" if material.unlit else ""
    if (reflection := material.reflection) is not None:
        light = f", roughness {reflection.roughness:.2g}, metalness {reflection.metalness:.2g}"
    if (told := material.reflection_map) is not None:
        light += f" on average, map {told.shape[1]} × {told.shape[0]}"
    return f"{counted(faces, 'triangle')}, {image}{bumps}{through}{glow}{light}"


def _unread(data: bytes, path: Path) -> Sequence[str]:
    """Return what a mesh file of these bytes that can be read holds beside its mesh, a text for each kind."""
    from depthwalk.ingest.formats import GLTF_SUFFIXES, INTERCHANGE_SUFFIXES, USD_SUFFIXES

    if path.suffix.lower() in GLTF_SUFFIXES:
        from depthwalk.ingest.gltf import read_header
        from depthwalk.ingest.gltf_unread import unread

        return unread(read_header(data, path), is_translated=path.suffix.lower() in USD_SUFFIXES)
    if path.suffix.lower() in INTERCHANGE_SUFFIXES:
        from depthwalk.ingest.interchange.reader import parse

        return parse(data, path, geometry=False).unread
    return ()
