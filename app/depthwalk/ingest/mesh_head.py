"""Read the head of a mesh file, which names its other files and its materials, without decoding any geometry."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from depthwalk.errors import InputError, reason
from depthwalk.ingest import gltf
from depthwalk.ingest.formats import GLTF_SUFFIXES, INTERCHANGE_SUFFIXES
from depthwalk.ingest.gltf_geometry import is_other_geometry
from depthwalk.ingest.gltf_normal_maps import normal_map_counts
from depthwalk.ingest.mtl import MtlMaterial, material_libraries, read_materials
from depthwalk.ingest.ply import holds_splats, with_usual_colours
from depthwalk.ingest.sources import Sources, arguments, find_all, text, texture_name

_WITH_MATERIALS = (".obj", *GLTF_SUFFIXES, *INTERCHANGE_SUFFIXES)


@dataclass(frozen=True, kw_only=True)
class MeshHead:
    """Hold the information in the head of a mesh file, which includes materials that no triangle uses.

    Attributes
    ----------
    files
        Every file that determines the mesh's appearance: its own, those that it names, and a picture that replaces its
        textures. Names of files that do not exist, or lie outside the mesh's folder, are left out.
    is_textured
        Whether a picture replaces its textures, or it names or contains a texture.
    has_cut_outs
        Whether materials may cut out parts of the surface.
    is_translucent
        Whether materials may be translucent.
    is_all_translucent
        Whether there are materials, none of which is opaque.
    has_glow
        Whether materials may emit light.
    has_other_geometry
        Whether earlier versions read other geometry from it: an unposed skin, or other texture coordinates.
    has_diffuse_colours
        Whether it is a PLY file that names its colours as MeshLab and older scanners did, which earlier versions
        ignored.
    has_splats
        Whether it is a PLY file of Gaussian splats, of which earlier versions read the places of all, without colours.
    has_normal_maps
        Whether materials have normal maps that are read, or height maps.
    has_roughness_maps
        Whether materials have maps of roughness and metalness, of which earlier versions read nothing, then means.
    has_reflections
        Whether it is a glTF file with glossy or metallic materials, of which earlier versions kept the highlight alone.
    has_ktx2
        Whether it shows KTX 2 pictures, which are read if the library for it is installed.
    is_unlit
        Whether it is shown without light, which earlier versions added.
    """

    files: tuple[Path, ...]
    is_textured: bool = False
    has_cut_outs: bool = False
    is_translucent: bool = False
    is_all_translucent: bool = False
    has_glow: bool = False
    has_other_geometry: bool = False
    has_diffuse_colours: bool = False
    has_splats: bool = False
    has_normal_maps: bool = False
    has_roughness_maps: bool = False
    has_reflections: bool = False
    has_ktx2: bool = False
    is_unlit: bool = False


def read_head(path: Path, texture: Path | None = None, sources: Sources | None = None) -> MeshHead:
    """Read the head of a mesh file.

    An OBJ file names material libraries, and these name textures; a glTF or GLB file names buffers and images; a PLY
    file names its texture; the materials of FBX, COLLADA and 3D Studio files name theirs.

    Parameters
    ----------
    path
        The mesh file.
    texture
        A picture that replaces the file's own textures; None keeps them.
    sources
        Reads files and keeps their bytes; None reads them from the disk.

    Returns
    -------
    MeshHead
        The information; `texture` is the last of its files.

    Raises
    ------
    InputError
        If `path` is missing or its header is damaged.
    """
    sources = sources or Sources()
    data = sources.read(path)
    match path.suffix.lower():
        case ".obj":
            head = _obj_head(data, path, sources)
        case suffix if suffix in GLTF_SUFFIXES:
            head = _gltf_head(data, path, sources)
        case ".ply":
            head = _ply_head(data, path, sources)
        case suffix if suffix in INTERCHANGE_SUFFIXES:
            head = _interchange_head(data, path, sources)
        case _:
            head = MeshHead(files=(path,))
    if texture is not None:
        head = replace(head, files=(*head.files, texture), is_textured=True)
    return replace(head, files=tuple(dict.fromkeys(head.files)))


def is_all_translucent(path: Path) -> bool:
    """Return whether the head of a mesh file shows that nothing is opaque; False if it cannot be read."""
    try:
        return path.suffix.lower() in _WITH_MATERIALS and read_head(path).is_all_translucent
    except InputError:  # reported when the mesh is read
        return False


def _obj_head(data: bytes, path: Path, sources: Sources) -> MeshHead:
    """Return the information in an OBJ file and its material libraries."""
    libraries = material_libraries(data, path, sources)
    folders = list(dict.fromkeys([path.parent, *(library.parent for library in libraries)]))
    return _head_of(read_materials(libraries, sources).values(), {}, (path, *libraries), folders, sources)


def _interchange_head(data: bytes, path: Path, sources: Sources) -> MeshHead:
    """Return the information in the materials of an FBX, COLLADA, 3D Studio or 3MF file."""
    from depthwalk.ingest.interchange.reader import parse

    try:
        model = parse(data, path, geometry=False)
        return _head_of(model.materials.values(), model.embedded, (path,), [path.parent], sources)
    except InputError:
        raise
    except Exception as error:  # damaged data
        raise InputError(f"{path}: damaged or truncated ({reason(error)})") from error


def _head_of(
    materials: Collection[MtlMaterial],
    embedded: Mapping[str, bytes],
    files: tuple[Path, ...],
    folders: list[Path],
    sources: Sources,
) -> MeshHead:
    """Return the information in materials of a mesh, the first of `files`, whose pictures are there or in `folders`."""
    names = [texture_name(name) for material in materials for name in material.pictures if name not in embedded]
    through = [_is_translucent(material) for material in materials]
    return MeshHead(
        files=(*files, *find_all(names, folders, sources, files[0])),
        is_textured=any(material.image for material in materials),
        has_cut_outs=any(material.mask for material in materials),
        is_translucent=any(through),
        is_all_translucent=bool(through) and all(through),
        has_glow=any(material.glow or np.any(material.terms.get("ke", 0)) for material in materials),
        has_normal_maps=any(material.normals or material.bump for material in materials),
    )


def _is_translucent(material: MtlMaterial) -> bool:
    """Return whether a material of a library is not opaque."""
    clear = np.asarray(material.terms.get("tr", 0))
    return bool(np.any(np.less(material.terms.get("d", 1), 1)) or ((clear > 0) & (clear < 1)).any())


def _shows_ktx2(header: dict[str, Any]) -> bool:
    if gltf.BASISU not in header.get("extensionsUsed", []):
        return False
    from depthwalk.ingest.gltf_textures import shows_ktx2  # which few files need

    return shows_ktx2(header)


def _gltf_head(data: bytes, path: Path, sources: Sources) -> MeshHead:
    """Return the information in the JSON header of a glTF or GLB file."""
    header = gltf.read_header(data, path)
    try:
        buffers, images = gltf.external_uris(header, "buffers"), gltf.external_uris(header, "images")
        return MeshHead(
            # Without a buffer the file is rejected when it is read; for a missing image a warning is enough.
            files=(path, *find_all(buffers, [path.parent], sources), *find_all(images, [path.parent], sources, path)),
            is_textured=bool(header.get("images")),
            has_cut_outs=gltf.has_cut_outs(header),
            is_translucent=gltf.has_translucency(header),
            is_all_translucent=gltf.is_all_translucent(header),
            has_glow=gltf.has_glow(header),
            has_other_geometry=is_other_geometry(header),
            has_normal_maps=normal_map_counts(header)[0] > 0,
            has_roughness_maps=gltf.roughness_map_count(header) > 0,
            has_reflections=gltf.has_reflections(header),
            has_ktx2=_shows_ktx2(header),
            is_unlit=gltf.is_unlit(header),
        )
    except (AttributeError, TypeError):
        raise InputError(f"{path}: its glTF header is malformed") from None


def _ply_head(data: bytes, path: Path, sources: Sources) -> MeshHead:
    """Return the information in the header of a PLY file."""
    header = data[: data.find(b"end_header")]
    names = [text(name) for name in arguments(header, rb"comment[ \t]+TextureFile")]
    return MeshHead(
        files=(path, *find_all(names, [path.parent], sources)),
        is_textured=bool(names),
        has_diffuse_colours=with_usual_colours(header) is not header,
        has_splats=holds_splats(header),
    )
