"""Read the files of assets as a scene describes them, and derive the keys of what is made from them.

A key is a hash of the bytes that were read and of everything else that the result depends on. So a result is found only
while it is still valid, and replaced files need no bookkeeping.
"""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from depthwalk.bake.cache import bake_key
from depthwalk.bake.captured_views import CAPTURE_VERSION, CaptureParams
from depthwalk.bake.meso import Meso
from depthwalk.bake.params import FEWEST, LOOKS, RATIOS, ModelParams
from depthwalk.cook.mesh_clusters import CLUSTERS_VERSION
from depthwalk.errors import InputError
from depthwalk.ingest.formats import LAS_SUFFIXES
from depthwalk.ingest.loader import check_height, load_mesh
from depthwalk.ingest.mesh import Mesh
from depthwalk.ingest.mesh_head import read_head
from depthwalk.ingest.ply import has_faces
from depthwalk.ingest.sources import Sources, hash_files
from depthwalk.scene.scene import DepthImageAsset, MeshAsset, told_at
from depthwalk.scene.schema import DpciParams, MesoParams

if TYPE_CHECKING:
    from depthwalk.ingest.image import PlanarImage
    from depthwalk.ingest.range_image import RangeImage

_TEXTURED = "+textured"
PREVIEWED = 24e6  # bytes of a file, from which on a coarse mesh is read first: a million triangles in most formats
PREVIEWED_POINTS = 2e6  # the same of a PLY or LAS file of points, whose surface takes some seconds to find
_PLY_HEADER = 1 << 14  # bytes
_MAX_READINGS = 3  # of a range image that changes while it is being read


def read_mesh(spec: MeshAsset, sources: Sources | None = None) -> Mesh:
    """Read the mesh of an asset.

    Parameters
    ----------
    spec
        The asset.
    sources
        Reads files and keeps their bytes, to be hashed later; None reads them from the disk.

    Returns
    -------
    Mesh
        The mesh, asset frame, metres.

    Raises
    ------
    InputError
        For files that cannot be used.
    """
    with told_at(spec):
        return load_mesh(spec.mesh, texture=spec.texture, up=spec.up, height=spec.height, sources=sources)


def is_large(spec: MeshAsset) -> bool:
    """Return whether the file of a mesh asset is so large that a coarse mesh of it is read first."""
    if not spec.mesh.is_file():
        return False
    size = spec.mesh.stat().st_size
    return size >= PREVIEWED or (size >= PREVIEWED_POINTS and _holds_points(spec.mesh))


def _holds_points(path: Path) -> bool:
    """Return whether a file is a LAS file, or a PLY file of points, as far as its header tells."""
    if path.suffix.lower() != ".ply":
        return path.suffix.lower() in LAS_SUFFIXES
    try:
        with path.open("rb") as file:
            header, end, _ = file.read(_PLY_HEADER).partition(b"end_header")
    except OSError:  # reported when the mesh is read
        return False
    return bool(end) and not has_faces(header)


def read_preview(spec: MeshAsset) -> Mesh | None:
    """Return a coarse mesh of an asset whose file is large; None for smaller files, which are read as quickly whole.

    Raises InputError like `read_mesh`.
    """
    if not is_large(spec):
        return None
    with told_at(spec):
        return load_mesh(spec.mesh, texture=spec.texture, up=spec.up, height=spec.height, coarse=True)


def mesh_source(spec: MeshAsset, sources: Sources | None = None) -> str:
    """Return a text that identifies the sources of a mesh asset.

    Parameters
    ----------
    spec
        The asset.
    sources
        Reads files and keeps their bytes; None reads them from the disk.

    Returns
    -------
    str
        The SHA-256 in hex of the asset's files, see `hash_files`, with a mark if they name a texture.

    Raises
    ------
    InputError
        For files that cannot be read.
    """
    sources = sources or Sources()
    with told_at(spec):
        head = read_head(spec.mesh, spec.texture, sources)
        digest = hash_files(head.files, sources)
    # The marks invalidate results from before alpha was heeded, translucent parts left out, skins posed, colours by
    # other names read, splats thinned, normal maps read, unlit materials shown as they are, roughness maps looked up,
    # reflections kept and KTX 2 pictures, which are read if a library is there.
    marks = {
        "+cut-outs": head.has_cut_outs,
        "+translucency": head.is_translucent,
        "+other-geometry": head.has_other_geometry,
        "+diffuse-colours": head.has_diffuse_colours,
        "+splats": head.has_splats,
        "+normal-maps": head.has_normal_maps,
        "+unlit": head.is_unlit,
        "+roughness-texels": head.has_roughness_maps,
        "+reflections": head.has_reflections and not head.is_unlit,
        "+ktx2": head.has_ktx2,
    }
    for mark, has in marks.items():
        if has:
            digest = hashlib.sha256(f"{digest}{mark}".encode()).hexdigest()
    return digest + (_TEXTURED if head.is_textured else "")


def read_hashed(spec: MeshAsset) -> tuple[Mesh, str]:
    """Read the mesh of an asset, and hash the same bytes, so that the hash is right even if a file is replaced.

    Returns the mesh, asset frame, metres, and the `mesh_source` of its files. Raises InputError like `read_mesh`.
    """
    sources = Sources()
    mesh = read_mesh(spec, sources)
    return mesh, mesh_source(spec, sources)


def read_translucent(spec: MeshAsset) -> Mesh | None:
    """Read the mesh of an asset if, according to the head of its files, any of it may be translucent or glow.

    Returns the mesh, asset frame, metres; None if all of it is opaque and dark. Raises InputError like `read_mesh`.
    """
    sources = Sources()
    with told_at(spec):
        head = read_head(spec.mesh, sources=sources)
    mesh = read_mesh(spec, sources) if head.is_translucent or head.has_glow else None
    return mesh if mesh is not None and mesh.is_translucent else None


def read_body(spec: MeshAsset, sources: Sources | None = None) -> Mesh:
    """Read the mesh of an asset that is to be baked, as `read_mesh` does.

    Also raises InputError for a mesh without height, which depth images could not show.
    """
    mesh = read_mesh(spec, sources)
    with told_at(spec):
        check_height(mesh, spec.mesh)
    return mesh


def read_meso(meso: MesoParams) -> Meso:
    """Read the meso-structure, a small repeated relief, that the key `meso` of a scene file adds to an asset.

    Raises InputError for files that cannot be used.
    """
    from depthwalk.bake.meso_file import load_meso  # here, as below: few scenes have any

    return load_meso(meso.depth, height=meso.height, tile=meso.tile, normal=meso.normal)


def read_relief(spec: DepthImageAsset) -> "PlanarImage":
    """Read the planar depth image of the asset `spec`, which has a `size`.

    Raises InputError for files that cannot be used.
    """
    from depthwalk.ingest.range_image import load_depth_image

    assert spec.size is not None  # the scene file has exactly one of size and intrinsics
    return load_depth_image(
        spec.depth, size=spec.size, depth_range=spec.range, unit=spec.unit, colour=spec.colour, normal=spec.normal
    )


def read_range_image(spec: DepthImageAsset) -> "RangeImage":
    """Read the range image of the asset `spec`, which has `intrinsics` or is a `panorama`.

    Raises InputError for files that cannot be used.
    """
    from depthwalk.ingest.range_image import Intrinsics, load_panorama, load_range_image

    if spec.panorama is not None:
        return load_panorama(spec.depth, horizon=spec.panorama.horizon, unit=spec.unit, colour=spec.colour)
    assert spec.intrinsics is not None  # the scene file has exactly one of these and `size`
    lens = Intrinsics(**spec.intrinsics.model_dump())
    return load_range_image(spec.depth, lens=lens, unit=spec.unit, colour=spec.colour, normal=spec.normal)


def read_keyed(spec: DepthImageAsset) -> "tuple[RangeImage, str]":
    """Read the range image of an asset that has `intrinsics` or is a `panorama`, and hash its files.

    NPY and OpenEXR files are read by name, not from bytes that could be hashed as well. So the files are hashed before
    and after, and read again if the hashes differ.

    Parameters
    ----------
    spec
        The asset.

    Returns
    -------
    tuple
        The range image, and the key of the depth image that is baked from it.

    Raises
    ------
    InputError
        For files that cannot be used, and for files that change every time they are read.
    """
    for _ in range(_MAX_READINGS):
        key, image = range_key(spec), read_range_image(spec)
        if range_key(spec) == key:
            return image, key
    raise InputError(f"{spec.depth}: the file, or a picture that belongs to it, keeps changing while it is read")


@contextmanager
def complaints_about(file: Path) -> Iterator[None]:
    """Prefix InputErrors of a `with` block that knows only the file's contents with the name of `file`."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


def model_params(dpci: DpciParams) -> ModelParams:
    """Return the bake parameters that the key `dpci` of a scene file asks for."""
    return ModelParams(
        resolution=dpci.resolution,
        layers=dpci.layers,
        method=dpci.method,
        parts=dpci.parts,
        axis=dpci.axis,
        coordinates=dpci.coordinates,
    )


def mesh_key(spec: MeshAsset, params: ModelParams, source: str | None = None) -> str:
    """Return the key of a mesh asset's depth images, a hash of everything that they depend on.

    Parameters
    ----------
    spec
        The asset.
    params
        How it is baked.
    source
        The result of `mesh_source` for the bytes that the mesh is read from; None computes it for the present files.

    Returns
    -------
    str
        64 hex digits.

    Raises
    ------
    InputError
        For files that cannot be read.
    """
    # Defaults are left out, so that files baked before an option existed keep their keys.
    default = ModelParams()
    chosen = {name: getattr(params, name) for name in ("method", "parts", "axis")}
    chosen = {name: value for name, value in chosen.items() if value != getattr(default, name)}
    source = source or mesh_source(spec)
    if source.endswith(_TEXTURED) and params.keeps_coordinates:  # results of other meshes do not depend on it
        chosen["coordinates"] = params.coordinates
    return _key(spec, source, resolution=params.resolution, layers=params.layers, **chosen)


def levels_key(spec: MeshAsset, source: str) -> str:
    """Return the key, 64 hex digits, of the simplified levels of a mesh asset; `source` as in `mesh_key`."""
    return _key(spec, source, ratios=RATIOS, fewest=FEWEST, looks=LOOKS)


def clusters_key(spec: MeshAsset, source: str) -> str:
    """Return the key, 64 hex digits, of the clusters of a mesh asset; `source` as in `mesh_key`."""
    return _key(spec, source, clusters=CLUSTERS_VERSION)


def views_key(spec: MeshAsset, source: str, params: CaptureParams | None = None) -> str:
    """Return the key of views of a mesh asset captured with `params`; `source` as in `mesh_key`.

    Its first 32 hex digits identify the mesh, the other 32 the parameters. Without `params` only the first 32 are
    returned, with which the keys of all views of the mesh begin, so that views can be found for unknown parameters.
    """
    of_mesh = _key(spec, source, views=CAPTURE_VERSION)[:32]
    return of_mesh if params is None else of_mesh + _key(spec, source, **asdict(params))[:32]


def _key(spec: MeshAsset, source: str, **params: object) -> str:
    """Return the key of what is made with `params` from a mesh asset whose `mesh_source` is `source`."""
    return bake_key(source.removesuffix(_TEXTURED), up=spec.up, height=spec.height, **params)


def range_key(spec: DepthImageAsset) -> str:
    """Return the key, 64 hex digits, of the depth images that the range image or panorama of `spec` is baked to.

    It is a hash of the present contents of the range image's files and of everything else that the result depends on.

    Raises InputError for files that cannot be read.
    """
    source = _hash_of(spec.depth, spec.colour)
    if spec.panorama is not None:
        return bake_key(source, unit=spec.unit, panorama=spec.panorama.model_dump(), method=spec.method)
    assert spec.intrinsics is not None
    normal = None if spec.normal is None else _hash_of(spec.normal)
    return bake_key(source, normal=normal, unit=spec.unit, intrinsics=spec.intrinsics.model_dump())


def _hash_of(*files: Path | None) -> str:
    """Return a hash of the present contents of `files`, skipping None and duplicates."""
    return hash_files(dict.fromkeys(file for file in files if file is not None), Sources())
