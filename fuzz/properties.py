"""State what holds of whatever a reader accepts: finite numbers within the limits, and no row number out of range."""

import pickle
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from depthwalk import limits
from depthwalk.bake.file import read_baked, write_baked
from depthwalk.bake.images import BakedObject
from depthwalk.bake.model import BakedModel
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.cook.virtual_texture import VirtualTexture
from depthwalk.ingest.image import PlanarImage
from depthwalk.ingest.loader import LARGEST
from depthwalk.ingest.mesh import Material, Mesh
from depthwalk.ingest.ply_polygons import with_triangles
from depthwalk.ingest.range_image import RangeImage
from depthwalk.ingest.reader import read_geometry
from depthwalk.ingest.soup import Soup, finite_faces
from depthwalk.ingest.sources import Sources
from depthwalk.ingest.trimesh_reader import read_by_trimesh
from depthwalk.scene.path import CameraPath
from depthwalk.scene.scene import Scene
from depthwalk.scene.similarity import Similarity

_COLUMNS = "positions", "normals", "colours", "uv", "faces", "material"


def check_as_trimesh(path: Path) -> None:
    """Check that a mesh file which trimesh reads, too, is read as by trimesh, to the last bit.

    Of a PLY file that is rewritten as one of triangles, trimesh reads these: it cuts polygons otherwise.
    """
    sources = Sources()
    soup, data = read_geometry(path, sources), sources.read(path)
    if path.suffix == ".ply":
        data = with_triangles(data, path) or data
    try:
        with np.errstate(invalid="ignore"):
            other = read_by_trimesh(data, path, sources)
        other = finite_faces(other, path) if isinstance(other, Soup) else other
    except Exception:  # it raises nearly anything for damaged files
        return
    if isinstance(soup, Soup) and isinstance(other, Soup):
        for name in _COLUMNS:
            found, expected = (getattr(each, name) for each in (soup, other))
            holds(np.array_equal(found, expected, equal_nan=name in ("normals", "uv")), f"{name} are those of trimesh")


def holds(truth: Any, what: str) -> None:
    """Raise AssertionError, which says `what` does not hold, unless all of `truth` is true."""
    if not np.all(truth):
        raise AssertionError(what)


def _shaped(values: Any, shape: tuple[int | None, ...], dtype: type, what: str) -> None:
    fits = values.ndim == len(shape) and all(n is None or n == m for n, m in zip(shape, values.shape, strict=True))
    holds(fits and values.dtype == dtype, f"{what} are {values.dtype} of {values.shape}")


def check_mesh_arrays(mesh: Mesh, *, unit_normals: bool = True) -> None:
    """Check what `load_mesh` returns; or a mesh of the cache, whose normals shaders scale to unit length."""
    count = len(mesh.positions)
    _shaped(mesh.positions, (None, 3), np.float32, "positions")
    _shaped(mesh.normals, (count, 3), np.float32, "normals")
    _shaped(mesh.colours, (count, 3), np.uint8, "colours")
    _shaped(mesh.uv, (count, 2), np.float32, "uv")
    total = len(mesh.faces) + len(mesh.translucent_faces)
    holds(0 < total <= limits.MAX_MESH_TRIANGLES, "the mesh has faces, and not too many")
    holds(np.abs(mesh.positions) < LARGEST, "positions are finite")
    holds(np.isfinite(mesh.normals), "normals are finite")
    unit = np.abs(np.linalg.norm(mesh.normals.astype(float), axis=1) - 1) < 1e-3
    holds(unit | (not unit_normals), "normals have unit length")
    holds(mesh.bounds[0] <= mesh.bounds[1], "bounds are in order")
    holds(np.isfinite(mesh.uv), "texture coordinates are finite")
    for faces, parts, through in (
        (mesh.faces, mesh.parts, False),
        (mesh.translucent_faces, mesh.translucent_parts, True),
    ):
        _shaped(faces, (None, 3), np.int32, "faces")
        holds((faces >= 0) & (faces < count), "faces refer to vertices")
        ends = np.cumsum([0, *(part.face_count for part in parts)])
        holds([p.first_face == s and p.face_count > 0 for p, s in zip(parts, ends[:-1], strict=True)], "parts follow")
        holds(ends[-1] == len(faces), "parts cover the faces")
        for material in (mesh.materials[part.material] for part in parts):
            holds((material.opacity is not None) == through, "translucent faces are kept apart")
            _check_material(material)


def _check_material(material: Material) -> None:
    """Check a material of a mesh."""
    colour = np.array([*material.base_colour, material.specular, material.opacity or 0.0])
    holds((colour >= 0) & (colour <= 1), "colours and opacity lie within 0 and 1")
    emission = np.array(material.emission)
    holds((emission >= 0) & (emission <= limits.MAX_EMISSION), "emission lies within its limits")
    holds(abs(material.normal_scale) <= limits.MAX_NORMAL_SCALE, "the scale of the normal map lies within its limits")
    holds(1 <= material.shininess <= limits.MAX_SHININESS, "shininess lies within its limits")
    for texture in (material.texture, material.emission_texture, material.normal_map):
        if texture is not None:
            check_texture(texture)


def check_texture(texels: Any) -> None:
    """Check what `load_texture` returns."""
    _shaped(texels, (None, None, 4), np.uint8, "texels")
    holds(max(texels.shape) <= limits.MAX_TEXTURE_SIDE and texels.size > 0, "a texture has texels, and not too many")


def check_sky(light: Any) -> None:
    """Check what `load_sky_image` returns."""
    _shaped(light, (None, None, 3), np.float32, "light")
    holds(abs(light.shape[1] - 2 * light.shape[0]) <= 2 and light.size > 0, "a sky is twice as wide as high")
    holds(light.shape[1] <= limits.MAX_SKY_WIDTH, "a sky is reduced to the size that is drawn")
    holds(bool(np.isfinite(light).all() and (light >= 0).all()), "light is finite and not negative")


def check_planar(image: PlanarImage | RangeImage) -> None:
    """Check what the readers of depth images and range images return."""
    shape = image.depth.shape
    _shaped(image.depth, (None, None), np.float32, "depth")
    _shaped(image.colour, (*shape, 3), np.uint8, "colours")
    _shaped(image.normal, (*shape, 3), np.float32, "normals")
    holds(min(shape) >= 2 and max(shape) <= limits.MAX_TEXTURE_SIDE, "the picture has pixels, and not too many")
    known = image.depth < np.inf
    depth = image.depth[known]
    holds(known.any(), "a pixel has depth")
    holds((depth >= 0) & (depth <= limits.MAX_COORDINATE), "depths lie within their limits")
    holds(np.isposinf(image.depth[~known]), "where there is no depth it is infinite")
    holds(np.abs(np.linalg.norm(image.normal.astype(float), axis=-1) - 1) < 1e-3, "normals have unit length")


def check_scene(scene: Scene) -> None:
    """Check what `load_scene` returns."""
    objects = scene.objects
    holds(len(objects) <= limits.MAX_INSTANCES, "objects are not too many")
    holds((objects.asset >= 0) & (objects.asset < len(scene.assets)), "objects are of assets that exist")
    for name in ("position", "rotation", "scale"):
        holds(np.isfinite(getattr(objects, name)), f"{name} is finite")
    holds(objects.scale > 0, "scales are positive")
    holds(np.abs(np.linalg.norm(objects.rotation, axis=1) - 1) < 1e-3, "rotations are unit quaternions")
    if scene.camera is not None:
        holds(np.isfinite([*scene.camera.position, *scene.camera.target, scene.camera.fov]), "the camera is finite")


def check_path(path: CameraPath) -> None:
    """Check what `load_path` returns, and cameras along it."""
    times = path.frames()
    holds(0 < len(times) <= limits.MAX_FRAMES, "a path has frames, and not too many")
    for time in (times[0], times[len(times) // 2], times[-1]):
        camera = path.sample(time)
        holds(np.isfinite([*camera.position, *camera.target, camera.fov]), "cameras are finite")
        angle = np.radians([limits.MIN_FOV - 1e-6, limits.MAX_FOV + 1e-6])
        holds(angle[0] <= camera.fov <= angle[1], "the angle of view lies within its limits")


def check_places(places: Similarity) -> None:
    """Check what `read_places` returns."""
    holds(len(places) <= limits.MAX_INSTANCES, "places are not too many")
    _shaped(places.position, (len(places), 3), np.float32, "positions")
    holds(np.abs(places.position) <= limits.MAX_COORDINATE, "positions lie within their limits")
    holds(np.abs(np.linalg.norm(places.rotation, axis=1) - 1) < 1e-5, "rotations are unit quaternions")
    holds((places.scale > 0) & np.isfinite(places.scale), "scales are finite")


def check_model(model: BakedModel) -> None:
    """Check what `read_baked` returns; what is written of it says the same."""
    with tempfile.TemporaryDirectory() as folder:
        write_baked(Path(folder) / "again.dpci.exr", model)
        again = read_baked(Path(folder) / "again.dpci.exr")
    holds(pickle.dumps(again) == pickle.dumps(model), "a model is written as it was read")
    for part in model.parts:
        _check_object(part)


def _check_object(baked: BakedObject) -> None:
    for image in baked.images:
        shape = image.depth.shape
        _shaped(image.normal, (*shape, 3), np.float32, "normals")
        _shaped(image.albedo, (*shape, 4), np.float32, "albedo")
        holds(max(shape) <= limits.MAX_DPCI_RESOLUTION, "images are not too large")
        holds(np.isfinite(image.normal), "normals are finite")
        if image.mapped_normal is not None:
            _shaped(image.mapped_normal, (*shape, 3), np.float32, "mapped normals")
            holds(np.isfinite(image.mapped_normal), "mapped normals are finite")
        holds(np.isfinite(image.albedo), "colours are finite")
        holds(~np.isnan(image.depth) & (image.depth > -np.inf), "depths are numbers")
        holds(image.owner <= 6, "owners are faces")
        images = [other for other in baked.images if other.face is image.face]
        holds(image.layer < len(images), "layers follow")
    for strip in baked.boundary_strips:
        samples = sum(image.depth.size for image in baked.images if image.face is strip.face)
        holds((strip.start >= 0) & (strip.start < samples), "strips start at samples")
        holds(np.isfinite(strip.offset).all() and np.isfinite(strip.rise).all(), "strips are finite")
        holds((strip.triangles >= 0) & (strip.triangles < samples + len(strip.start)), "strips refer to what exists")


def check_cooked(geometry: LodGeometry, texture: VirtualTexture) -> None:
    """Check what a cooked object loads."""
    count, length = len(geometry.vertices), len(geometry.indices)
    _shaped(geometry.vertices, (None, 4), np.uint16, "vertices")
    _shaped(geometry.texels, (count, 2), np.int16, "texels")
    holds(geometry.indices.ndim == 1 and geometry.indices.dtype in (np.uint16, np.uint32), "indices are numbers")
    _shaped(geometry.chunks, (None, 2), np.int64, "chunks")
    first, base = geometry.chunks.T
    holds(np.diff(first) >= 0, "chunks rise")
    holds(length == 0 or (len(first) > 0 and first[0] == 0), "chunks begin with the first index")
    for start, end, begin in zip(first, [*first[1:], length], base, strict=True):
        run = geometry.indices[start:end]
        holds(0 <= start <= end <= length and begin >= 0, "chunks lie within the indices")
        holds(begin + int(run.max(initial=0)) < max(count, 1), "indices refer to vertices")
    runs = geometry.first, geometry.count
    holds(geometry.first.shape == geometry.count.shape and geometry.first.ndim == 2, "levels have pieces")
    holds((runs[0] >= 0) & (runs[1] >= 0) & (runs[0] + runs[1] <= length), "levels lie within the indices")
    for name in ("horizon", "box_low", "box_size", "error"):
        holds(~np.isnan(getattr(geometry, name)), f"{name} is a number")
    holds(np.isfinite(geometry.box_low) & np.isfinite(geometry.box_size), "the box is finite")
    height, width = texture.normals.shape[:2]
    _shaped(texture.normals, (None, None, 4), np.uint8, "normals")
    holds(texture.colours.shape[:2] == (height, width), "colours and normals are of one size")
    _shaped(texture.table, (None, None, None, 2), np.int16, "the table's entries")
    holds(np.isfinite(texture.palette), "the palette is finite")
    holds(0 <= texture.last_mip_tier < len(texture.first_rows), "mip tiers exist")
    holds([0 <= row <= texture.table.shape[1] for row in texture.first_rows], "mip tiers lie within the table")
    if texture.has_coordinates:
        _shaped(texture.coordinates, (height, width, 2), np.uint16, "coordinates")
        holds(texture.texture.ndim == 3 and texture.texture.shape[2] == 3, "the texture is a picture")


def check_clusters(clusters: MeshClusters, parts: int) -> None:
    """Check what `CLUSTERS` returns for a mesh of so many `parts`."""
    holds(clusters.faces < len(clusters.positions), "faces refer to vertices")
    holds((clusters.part >= 0) & (clusters.part < parts), "clusters are of parts that exist")
    for name in ("positions", "normals", "uv", "centre", "radius", "axis", "sine", "error", "group_radius"):
        holds(np.isfinite(getattr(clusters, name)), f"{name} is finite")
