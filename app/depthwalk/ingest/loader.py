"""Load a mesh file as a `Mesh`: upright, scaled, standing on the origin, with normals, ready for the baker.

`check_mesh` does the same checks without the work that only drawing needs.
"""

import logging
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError, UnbakableError
from depthwalk.geometry.triangles import corner_axes, crossed_edges, row_ids
from depthwalk.ingest.image import decode_texture
from depthwalk.ingest.materials import WHITE
from depthwalk.ingest.mesh import Material, Mesh, Part
from depthwalk.ingest.normals import split_at_creases
from depthwalk.ingest.reader import read_soup
from depthwalk.ingest.soup import Soup
from depthwalk.ingest.sources import Sources
from depthwalk.limits import MAX_TRANSLUCENT_TRIANGLES

log = logging.getLogger(__name__)

_AS_POLYGONS = "draw it as polygons, without 'dpci' or by --representation mesh"
LEVEL = 1e-6  # height over extent below which a mesh counts as flat and horizontal
SMALLEST, LARGEST = 1e-15, 1e15  # extents whose squares float32 can hold
SMALLEST_BAKED, LARGEST_BAKED = 1e-6, 40_000.0  # m, extents whose diagonals and details float16 can hold


def load_mesh(
    path: Path,
    *,
    texture: Path | None = None,
    up: Literal["y", "z"] = "y",
    height: float | None = None,
    sources: Sources | None = None,
    coarse: bool = False,
) -> Mesh:
    """Read a mesh, or the surface through a scan, into its asset frame: Y up, the base's centre on the origin.

    Normals are taken from the file if it has valid ones; otherwise they are angle-weighted and split at creases of 60°.
    Faces without area and vertices without a face are dropped.

    Parameters
    ----------
    path
        The mesh file.
    texture
        A picture that replaces the file's own textures and base colours, but not its normal maps, for which the mesh
        must have texture coordinates; None keeps them.
    up
        The file's upward axis. Meshes with z upward are turned: (x, y, z) becomes (x, z, −y).
    height
        Height in metres to which the mesh is scaled uniformly; None takes the file's units as metres.
    sources
        Reads files and keeps their bytes; None reads them from the disk. Pass the object that `hash_files` used if the
        mesh must be made from the same bytes as the hash.
    coarse
        Whether to make a coarse mesh quickly, see `read_soup`.

    Returns
    -------
    Mesh
        The mesh, asset frame, metres.

    Raises
    ------
    InputError
        `path: defect`, if the file cannot be read or holds nothing that can be drawn.
    """
    path = Path(path)
    sources = sources or Sources()
    return mesh_of(
        _read(path, height, sources, coarse=coarse), path, texture=texture, up=up, height=height, sources=sources
    )


def mesh_of(
    soup: Soup,
    path: Path,
    *,
    texture: Path | None = None,
    up: Literal["y", "z"] = "y",
    height: float | None = None,
    sources: Sources | None = None,
) -> Mesh:
    """Make a mesh of triangles that `reader` has read, as `load_mesh` does.

    Parameters
    ----------
    soup
        The triangles of the file.
    path
        The file, for messages.
    texture, up, height, sources
        As `load_mesh` takes them.

    Returns
    -------
    Mesh
        The mesh, asset frame, metres.

    Raises
    ------
    InputError
        `path: defect`, if it holds nothing that can be drawn.
    """
    soup = _retextured(_compacted(soup, path), texture, path, sources or Sources())
    positions = _placed(soup.positions, path, up, height)
    normals = soup.normals[:, [0, 2, 1]] * [1, 1, -1] if up == "z" else soup.normals
    source, faces, normals = _vertices(replace(soup, positions=positions, normals=normals))

    materials = _drawable(soup, path)
    is_translucent = np.array([material.opacity is not None for material in materials], bool)[soup.material]
    opaque, parts = _by_material(soup.material, ~is_translucent)
    translucent, translucent_parts = _by_material(soup.material, is_translucent)
    return Mesh(
        positions=positions[source].astype(np.float32),
        normals=normals.astype(np.float32),
        colours=soup.colours[source],
        uv=_single(soup.uv[source]),
        faces=faces[opaque].astype(np.int32),
        parts=parts,
        materials=materials,
        translucent_faces=faces[translucent].astype(np.int32),
        translucent_parts=translucent_parts,
    )


def _by_material(material: NDArray[np.int64], which: NDArray[np.bool_]) -> tuple[NDArray[np.int64], tuple[Part, ...]]:
    """Return the numbers of the faces `which` (F,), ordered by their `material` (F,), and the runs that share one."""
    rows = np.flatnonzero(which)
    order = rows[np.argsort(material[rows], kind="stable")]
    counts = np.bincount(material[rows])
    starts = np.cumsum(counts) - counts
    return order, tuple(Part(int(starts[m]), int(counts[m]), int(m)) for m in np.flatnonzero(counts))


def _drawable(soup: Soup, path: Path) -> tuple[Material, ...]:
    """Return the materials; if too many triangles are translucent, all are made opaque, with a warning."""
    counts = np.bincount(soup.material, minlength=len(soup.materials))
    materials = soup.materials
    too_many = f"more than {MAX_TRANSLUCENT_TRIANGLES}"
    through = sum(int(count) for count, material in zip(counts, materials, strict=True) if material.opacity is not None)
    if through > MAX_TRANSLUCENT_TRIANGLES:
        log.warning("%s: %d triangles are see-through, %s; they are drawn opaque", path, through, too_many)
        materials = tuple(replace(material, opacity=None) for material in materials)
    return materials


def _single(uv: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return texture coordinates in single precision, with 0 for values that it cannot hold."""
    with np.errstate(over="ignore"):
        return np.nan_to_num(uv.astype(np.float32), posinf=0.0, neginf=0.0)


def check_mesh(
    path: Path,
    *,
    texture: Path | None = None,
    up: Literal["y", "z"] = "y",
    height: float | None = None,
    upright: bool = False,
) -> None:
    """Raise the InputError that `load_mesh` would raise, without computing normals and vertices.

    Parameters
    ----------
    path
        The mesh file.
    texture
        A picture that would replace the file's own textures; None keeps them.
    up
        The file's upward axis.
    height
        Height in metres to which the mesh would be scaled; None takes the file's units as metres.
    upright
        Whether to raise InputError also for a mesh that is flat and horizontal, too large or too small to be baked.
    """
    path = Path(path)
    sources = Sources()
    soup = _read(path, height, sources)
    solid = _solid_faces(soup, path)
    vertices = np.unique(soup.faces[solid])
    shown = _retextured(replace(soup, uv=soup.uv[vertices], material=soup.material[solid]), texture, path, sources)
    positions = _placed(soup.positions[vertices], path, up, height)
    if upright:
        _check_extent(positions.astype(np.float32), path)
        opaque = np.array([material.opacity is None for material in _drawable(shown, path)], bool)
        _check_opaque(int(opaque[shown.material].sum()), path)


@dataclass(frozen=True, kw_only=True)
class MeshExtent:
    """Hold how large a mesh file is, and whether it can have depth images.

    Attributes
    ----------
    low, high : (3,) float64
        The bounding box of its surfaces, in the frame and unit of the file.
    is_bakeable
        Whether it has a height, a size that depth images hold, and something opaque.
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    is_bakeable: bool


def measure_mesh(path: Path) -> MeshExtent:
    """Measure a mesh file whose y axis points upward. Raises the InputError that `load_mesh` would raise."""
    soup = _read(path, None, Sources())
    solid = _solid_faces(soup, path)
    positions = soup.positions[np.flatnonzero(np.bincount(soup.faces[solid].ravel()))]
    opaque = np.array([material.opacity is None for material in _drawable(soup, path)], bool)
    try:
        _check_extent(_placed(positions, path, "y", None).astype(np.float32), path)
        _check_opaque(int(opaque[soup.material[solid]].sum()), path)
    except UnbakableError:
        return MeshExtent(low=positions.min(axis=0), high=positions.max(axis=0), is_bakeable=False)
    return MeshExtent(low=positions.min(axis=0), high=positions.max(axis=0), is_bakeable=True)


def _read(path: Path, height: float | None, sources: Sources, *, coarse: bool = False) -> Soup:
    if height is not None and not (np.isfinite(height) and height > 0):
        raise InputError(f"{path}: height must be a positive number of metres, not {height}")
    return read_soup(path, sources, coarse=coarse)


def _solid_faces(soup: Soup, path: Path) -> NDArray[np.bool_]:
    """Return which faces (F,) have an area. Raises InputError if none has, or if float32 cannot hold the mesh."""
    axes = corner_axes(soup.positions, soup.faces)
    extent = max(float(np.ptp(axis)) for axis in axes)
    if not (extent == 0 or SMALLEST < extent < LARGEST):
        raise InputError(f"{path}: its extent of {extent:g} is out of range")
    # Relative to the edges, so that neither unit nor size matters.
    x, y, z = (np.square(axis - axis[[2, 0, 1]]) for axis in axes)
    longest = (x + y + z).max(axis=0)
    x, y, z = map(np.square, crossed_edges(axes))
    area = np.sqrt(x + y + z)
    kept = area > 1e-12 * longest
    if not kept.any():
        raise InputError(f"{path}: flat: none of its {len(kept)} faces has an area")
    return np.asarray(kept)


def _compacted(soup: Soup, path: Path) -> Soup:
    """Drop faces of zero area, vertices that no face uses, and duplicates of vertices."""
    kept = _solid_faces(soup, path)
    faces = soup.faces[kept]
    used = np.flatnonzero(np.bincount(faces.ravel()))
    ids, first = row_ids(_differing(soup)[used])
    number = np.zeros(len(soup.positions), np.int64)
    number[used] = ids
    return soup.subset(used[first], number[faces], kept)


def _differing(soup: Soup) -> NDArray[np.float64]:
    """Return the numbers (V, k) in which vertices differ; many files have neither normals nor texture coordinates."""
    columns: list[NDArray[Any]] = [np.zeros((len(soup.positions), 0))]
    for values in (soup.positions, soup.normals, soup.colours, soup.uv):
        finite = np.nan_to_num(values, posinf=0.0, neginf=0.0)
        columns.append(finite[:, (finite != finite[:1]).any(axis=0)])
    return np.hstack(columns)


def _retextured(soup: Soup, texture: Path | None, path: Path, sources: Sources) -> Soup:
    if texture is None:
        return soup
    if np.isnan(soup.uv).all():
        raise InputError(f"{path}: no texture coordinates for the texture {texture}")
    image = decode_texture(sources.read(Path(texture)), Path(texture))
    return replace(soup, materials=tuple(replace(m, base_colour=WHITE, texture=image) for m in soup.materials))


def _placed(positions: NDArray[np.float64], path: Path, up: str, height: float | None) -> NDArray[np.float64]:
    """Return positions (V, 3) float64 upright, scaled, with the centre of the bounding box's base on the origin."""
    if up == "z":
        positions = positions[:, [0, 2, 1]] * [1, 1, -1]
    low, high = positions.min(axis=0), positions.max(axis=0)
    if height is not None and _level(positions):
        raise InputError(f"{path}: is flat and horizontal: it cannot be scaled to a height")
    base = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    scale = 1.0 if height is None else height / (high[1] - low[1])
    placed = np.asarray((positions - base) * scale)
    if not SMALLEST < (largest := float(np.ptp(placed, axis=0).max())) < LARGEST:
        raise InputError(f"{path}: its extent of {largest:g} m at that height is out of range")
    return placed


def check_height(mesh: Mesh, path: Path) -> None:
    """Raise UnbakableError for a `mesh`, from the file `path`, that is flat, out of range, or not opaque at all."""
    _check_extent(mesh.positions, path)
    _check_opaque(len(mesh.faces), path)


def _check_opaque(faces: int, path: Path) -> None:
    if not faces:
        raise UnbakableError(f"{path}: nothing of it is opaque", _AS_POLYGONS)


def _check_extent(positions: NDArray[np.floating], path: Path) -> None:
    largest = float(np.ptp(positions, axis=0).max())
    if not SMALLEST_BAKED <= largest <= LARGEST_BAKED:
        held = f"depth images hold {SMALLEST_BAKED:g} to {LARGEST_BAKED:g} m"
        raise UnbakableError(
            f"{path}: is {largest:g} m across, and {held}", f"give it another 'height', or {_AS_POLYGONS}"
        )
    if _level(positions):
        raise UnbakableError(f"{path}: is flat and horizontal", _AS_POLYGONS)


def _level(positions: NDArray[np.floating]) -> bool:
    extent = np.ptp(positions, axis=0)
    return bool(extent[1] < LEVEL * extent.max())


def _vertices(soup: Soup) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Return the result of `split_at_creases`, but with the file's normals where it has them."""
    given = np.isfinite(soup.normals[:, 0])  # a row is NaN as a whole
    if given.all():
        return np.arange(len(soup.positions)), soup.faces, soup.normals
    source, faces, normals = split_at_creases(soup.positions, soup.faces)
    return source, faces, np.where(given[source][:, None], soup.normals[source], normals)
