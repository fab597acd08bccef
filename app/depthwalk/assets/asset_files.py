"""Read the files of assets as a scene describes them, and derive the keys of what is made of them.

A key is a hash of the bytes that were read and of everything else that the result depends on. So a result is found
again only while it is still right, and files that are replaced need no bookkeeping.
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
from depthwalk.ingest.loader import check_height, load_mesh
from depthwalk.ingest.mesh import Mesh
from depthwalk.ingest.mesh_head import read_head
from depthwalk.ingest.sources import Sources, hash_files
from depthwalk.scene.scene import DepthImageAsset, MeshAsset
from depthwalk.scene.schema import DpciParams, MesoParams

if TYPE_CHECKING:
    from depthwalk.ingest.image import PlanarImage
    from depthwalk.ingest.range_image import RangeImage

_TEXTURED = "+textured"
_MAX_READINGS = 3  # of a range image that changes while it is read


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
    return load_mesh(spec.mesh, texture=spec.texture, up=spec.up, height=spec.height, sources=sources)


def mesh_source(spec: MeshAsset, sources: Sources | None = None) -> str:
    """Return a text that tells the sources of mesh assets apart.

    Parameters
    ----------
    spec
        The asset.
    sources
        Reads files and keeps their bytes; None reads them from the disk.

    Returns
    -------
    str
        The SHA-256 in hex that `hash_files` makes of the asset's files, and a mark where they name a texture.

    Raises
    ------
    InputError
        For files that cannot be read.
    """
    sources = sources or Sources()
    head = read_head(spec.mesh, spec.texture, sources)
    digest = hash_files(head.files, sources)
    # What was made before alpha was heeded, or before what lets light through was left out, is made anew.
    for mark, has in ("+cut-outs", head.has_cut_outs), ("+translucency", head.is_translucent):
        if has:
            digest = hashlib.sha256(f"{digest}{mark}".encode()).hexdigest()
    return digest + (_TEXTURED if head.is_textured else "")


def read_hashed(spec: MeshAsset) -> tuple[Mesh, str]:
    """Read the mesh of an asset, and hash the same bytes, so that the hash is right though a file may be replaced.

    Returns the mesh, asset frame, metres, and the `mesh_source` of its files. Raises InputError as `read_mesh`.
    """
    sources = Sources()
    mesh = read_mesh(spec, sources)
    return mesh, mesh_source(spec, sources)


def read_translucent(spec: MeshAsset) -> Mesh | None:
    """Read the mesh of an asset if any of it may let light through or glow, which the head of its files tells.

    Returns the mesh, asset frame, metres; None where all of it is opaque and dark. Raises InputError as `read_mesh`.
    """
    sources = Sources()
    head = read_head(spec.mesh, sources=sources)
    mesh = read_mesh(spec, sources) if head.is_translucent or head.has_glow else None
    return mesh if mesh is not None and mesh.is_translucent else None


def read_body(spec: MeshAsset, sources: Sources | None = None) -> Mesh:
    """Read the mesh of an asset that is to be baked, as `read_mesh` does.

    Raises InputError for a mesh without height, too, which depth images could not show.
    """
    mesh = read_mesh(spec, sources)
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

    NPY and OpenEXR files are read by their names, not from bytes that could be hashed as well. So the files are hashed
    before and after, and read again where the hashes differ.

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
        For files that cannot be used, and for files that change whenever they are read.
    """
    for _ in range(_MAX_READINGS):
        key, image = range_key(spec), read_range_image(spec)
        if range_key(spec) == key:
            return image, key
    raise InputError(f"{spec.depth}: it, or a picture that belongs to it, changes while it is read")


@contextmanager
def complaints_about(file: Path) -> Iterator[None]:
    """Put the name of `file` before the InputErrors of a `with` block that knows only the file's contents."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


def model_params(dpci: DpciParams) -> ModelParams:
    """Return the parameters of a bake that the key `dpci` of a scene file asks for."""
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
        What `mesh_source` returns for the bytes that the mesh is read from; None asks it about what its files hold now.

    Returns
    -------
    str
        64 hex digits.

    Raises
    ------
    InputError
        For files that cannot be read.
    """
    # Defaults are left out: files that were baked before there was a choice keep their keys.
    default = ModelParams()
    chosen = {name: getattr(params, name) for name in ("method", "parts", "axis")}
    chosen = {name: value for name, value in chosen.items() if value != getattr(default, name)}
    source = source or mesh_source(spec)
    if source.endswith(_TEXTURED) and params.keeps_coordinates:  # of other meshes nothing is baked but what ever was
        chosen["coordinates"] = params.coordinates
    return _key(spec, source, resolution=params.resolution, layers=params.layers, **chosen)


def levels_key(spec: MeshAsset, source: str) -> str:
    """Return the key, 64 hex digits, of the simplified levels of a mesh asset; `source` is as of `mesh_key`."""
    return _key(spec, source, ratios=RATIOS, fewest=FEWEST, looks=LOOKS)


def clusters_key(spec: MeshAsset, source: str) -> str:
    """Return the key, 64 hex digits, of the clusters of a mesh asset; `source` is as of `mesh_key`."""
    return _key(spec, source, clusters=CLUSTERS_VERSION)


def views_key(spec: MeshAsset, source: str, params: CaptureParams | None = None) -> str:
    """Return the key of views of a mesh asset captured by `params`; `source` is as of `mesh_key`.

    Its first 32 hex digits tell meshes apart, the other 32 parameters. Without `params` it is the first 32: what the
    keys of all views of the mesh begin with, so that they can be found by whoever does not know the parameters.
    """
    of_mesh = _key(spec, source, views=CAPTURE_VERSION)[:32]
    return of_mesh if params is None else of_mesh + _key(spec, source, **asdict(params))[:32]


def _key(spec: MeshAsset, source: str, **params: object) -> str:
    """Return the key of what is made of a mesh asset, whose `mesh_source` is `source`, with `params`."""
    return bake_key(source.removesuffix(_TEXTURED), up=spec.up, height=spec.height, **params)


def range_key(spec: DepthImageAsset) -> str:
    """Return the key, 64 hex digits, of the depth images that the range image or panorama of `spec` is baked to.

    It is a hash of what the files of the range image hold now and of everything else that the result depends on.

    Raises InputError for files that cannot be read.
    """
    source = _hash_of(spec.depth, spec.colour)
    if spec.panorama is not None:
        return bake_key(source, unit=spec.unit, panorama=spec.panorama.model_dump(), method=spec.method)
    assert spec.intrinsics is not None
    normal = None if spec.normal is None else _hash_of(spec.normal)
    return bake_key(source, normal=normal, unit=spec.unit, intrinsics=spec.intrinsics.model_dump())


def _hash_of(*files: Path | None) -> str:
    """Return a hash of what `files` hold now, leaving out those that are None or named twice."""
    return hash_files(dict.fromkeys(file for file in files if file is not None), Sources())
