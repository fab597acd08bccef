"""List what is fuzzed: every reader of files, how its files are changed, and what holds of what it returns."""

import os
import shutil
from functools import partial
from pathlib import Path
from typing import Literal, TypedDict

from depthwalk.assets.asset_files import complaints_about, mesh_source
from depthwalk.bake.cache import find_cached
from depthwalk.bake.file import read_baked
from depthwalk.bake.level_file import LEVELS
from depthwalk.bake.meso_file import load_meso
from depthwalk.bake.planar import range_mesh
from depthwalk.cache import DamagedFileError, cache_folder
from depthwalk.conversion.gltf import convert_gltf
from depthwalk.cook.cluster_file import CLUSTERS
from depthwalk.cook.cook import COOK_VERSION, CookOptions
from depthwalk.cook.cooked_file import find_cooked, read_cooked
from depthwalk.errors import InputError
from depthwalk.ingest.image import load_texture
from depthwalk.ingest.loader import check_mesh, load_mesh
from depthwalk.ingest.range_image import Intrinsics, load_depth_image, load_panorama, load_range_image
from depthwalk.ingest.sky_image import load_sky_image
from depthwalk.ingest.solid import is_solid
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.scene.places import read_places
from depthwalk.scene.scene import MeshAsset
from fuzz import dictionary, gltf_seeds, interchange_seeds, properties, seeds, usd_seeds
from fuzz.bytes_changes import change_text
from fuzz.case import Change, Target
from fuzz.container_changes import change_exr, change_glb, change_npy, change_npz, change_png, change_zip
from fuzz.tree_changes import change_json, change_yaml

INGEST = ("depthwalk.ingest",)
INTERCHANGE = (*INGEST, "depthwalk.ingest.interchange")


class _Options(TypedDict, total=False):
    up: Literal["y", "z"]
    height: float


class _Pictures(TypedDict):
    colour: Path | None
    normal: Path | None


_OPTIONS: dict[str, _Options] = {"tall": {"height": 2.0}, "z-up": {"up": "z"}}  # by how files are called


def read_mesh(path: Path) -> None:
    """Load a mesh, check it, hash it: all agree on whether it is right."""
    options = _OPTIONS.get(path.stem, _Options())
    texture = path.parent / "picture.png" if path.stem == "textured" else None
    try:
        mesh = load_mesh(path, texture=texture, **options)
    except InputError as refused:
        try:
            check_mesh(path, texture=texture, **options)
        except InputError as also:
            properties.holds(str(refused) == str(also), f"check_mesh says the same: {refused} / {also}")
        else:
            raise AssertionError(f"check_mesh accepts what load_mesh refuses: {refused}") from refused
        raise
    properties.check_mesh_arrays(mesh)
    if path.suffix in (".ply", ".glb", ".gltf"):
        properties.check_as_trimesh(path)
    is_solid(mesh)
    check_mesh(path, texture=texture, **options)
    up, height = options.get("up", "y"), options.get("height")
    mesh_source(MeshAsset(name="x", mesh=path, texture=texture, up=up, height=height, dpci=None))


def convert(path: Path) -> None:
    """Make a scene of a glTF file, which has as many objects as it says; nothing is left of a refused one."""
    folder = path.parent / "converted"
    try:
        made = convert_gltf(path, folder)
    except InputError:
        properties.holds(not folder.exists(), "a refused file leaves no folder")
        raise
    objects = load_scene(made.scene).objects
    properties.holds(len(objects) == made.objects, f"{made.objects} objects are {len(objects)}")
    shutil.rmtree(folder)


def read_range(path: Path) -> None:
    """Read a depth file as its name says, with the pictures that lie beside it."""
    colour, normal = (file if (file := path.parent / name).exists() else None for name in ("colour.png", "normal.png"))
    pictures = _Pictures(colour=colour, normal=normal)
    match path.stem:
        case "unit":
            return properties.check_planar(load_depth_image(path, size=(1, 2), unit=0.01, **pictures))
        case "range":
            return properties.check_planar(load_depth_image(path, size=(1, 2), depth_range=0.1, **pictures))
        case "meso":
            meso = load_meso(path, height=0.1, tile=(1, 1), normal=normal)
            return properties.holds(abs(meso.relief) < float("inf"), "the relief is finite")
        case "panorama":
            seen = load_panorama(path, unit=0.001, colour=colour)
        case _:
            lens = Intrinsics(fx=8.0, fy=7.5, cx=4.0, cy=3.5)
            seen = load_range_image(path, lens=lens, unit=0.001, **pictures)
    properties.check_planar(seen)
    with complaints_about(path):  # a picture may be readable and hold no surface
        properties.check_mesh_arrays(range_mesh(seen))


def read_cooked_file(path: Path) -> None:
    """Read cooked objects from a file of a user's, or from the cache."""
    if path.name.endswith(".dpci.npz"):
        for cooked in read_cooked(path):
            properties.check_cooked(*cooked.load())
        return
    _put_into_cache(path, f"ab-cook{COOK_VERSION}.npz")
    for cooked in find_cooked("ab", CookOptions()) or ():
        try:
            properties.check_cooked(*cooked.load())
        except DamagedFileError:
            return


def read_cached(path: Path) -> None:
    """Find simplified meshes, clusters or depth images in a cache that holds this file."""
    mesh = seeds.dense()
    if path.name.startswith("levels"):
        _put_into_cache(path, "ab.levels.npz")
        for level in LEVELS.find_value(mesh, "ab") or ():
            properties.check_mesh_arrays(level.mesh, unit_normals=False)
    elif path.name.startswith("clusters"):
        _put_into_cache(path, "ab.clusters.npz")
        clusters = CLUSTERS.find_value(mesh, "ab")
        if clusters is not None:
            properties.check_clusters(clusters, len(mesh.parts))
    else:
        _put_into_cache(path, "ab" * 16 + ".dpci.exr")
        model = find_cached("ab" * 16)
        if model is not None:
            properties.check_model(model)


def _put_into_cache(path: Path, name: str) -> None:
    """Make the file the only one of a cache beside it."""
    os.environ["XDG_CACHE_HOME"] = str(path.parent / "cache")
    folder = cache_folder()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(path.read_bytes())


_PNG: dict[str, tuple[Change, ...]] = {".png": (change_png,)}
TARGETS = (
    Target(
        name="scene",
        seeds=seeds.scenes,
        read=lambda path: properties.check_scene(load_scene(path)),
        modules=("depthwalk.scene", "depthwalk.ingest.formats"),
        words=(*dictionary.YAML, *(key.encode() + b": " for key in dictionary.SCENE_KEYS)),
        changes={
            ".yaml": (
                change_text,
                partial(change_yaml, keys=dictionary.SCENE_KEYS),
                partial(change_yaml, keys=dictionary.SCENE_KEYS),
            )
        },
    ),
    Target(
        name="path",
        seeds=seeds.paths,
        read=lambda path: properties.check_path(load_path(path)),
        modules=("depthwalk.scene.path", "depthwalk.scene.document", "depthwalk.scene.validate"),
        words=(*dictionary.YAML, *(key.encode() + b": " for key in dictionary.PATH_KEYS)),
        changes={".yaml": (change_text, partial(change_yaml, keys=dictionary.PATH_KEYS))},
    ),
    Target(
        name="places",
        seeds=seeds.places,
        read=lambda path: properties.check_places(read_places(path)),
        modules=("depthwalk.scene.places", "depthwalk.ingest.npy"),
        words=dictionary.PLACES,
        changes={".csv": (change_text,), ".npy": (change_npy,)},
    ),
    Target(
        name="obj",
        seeds=seeds.objs,
        read=read_mesh,
        modules=INGEST,
        words=dictionary.OBJ,
        changes={".obj": (change_text,), ".mtl": (change_text,), **_PNG},
    ),
    Target(
        name="ply",
        seeds=seeds.plys,
        read=read_mesh,
        modules=(*INGEST, "trimesh.exchange.ply"),
        words=dictionary.PLY,
        changes={".ply": (change_text,), **_PNG},
    ),
    Target(
        name="stl",
        seeds=seeds.stls,
        read=read_mesh,
        modules=(*INGEST, "trimesh.exchange.stl"),
        words=dictionary.STL,
        changes={".stl": (change_text,)},
    ),
    Target(
        name="off",
        seeds=seeds.offs,
        read=read_mesh,
        modules=INGEST,
        words=dictionary.OFF,
        changes={".off": (change_text,)},
    ),
    Target(
        name="gltf",
        seeds=gltf_seeds.gltfs,
        read=read_mesh,
        modules=(*INGEST, "trimesh.exchange.gltf"),
        words=tuple(f'"{key}": '.encode() for key in dictionary.GLTF_KEYS),
        changes={".gltf": (partial(change_json, keys=dictionary.GLTF_KEYS),), ".glb": (change_glb,), **_PNG},
    ),
    Target(
        name="fbx",
        seeds=interchange_seeds.fbxs,
        read=read_mesh,
        modules=INTERCHANGE,
        words=dictionary.FBX,
        changes={".fbx": (change_text,), **_PNG},
    ),
    Target(
        name="dae",
        seeds=interchange_seeds.daes,
        read=read_mesh,
        modules=INTERCHANGE,
        words=dictionary.DAE,
        changes={".dae": (change_text,), **_PNG},
    ),
    Target(
        name="3ds",
        seeds=interchange_seeds.three_dss,
        read=read_mesh,
        modules=INTERCHANGE,
        words=dictionary.THREE_DS,
        changes=_PNG,
    ),
    Target(
        name="3mf",
        seeds=interchange_seeds.three_mfs,
        read=read_mesh,
        modules=INTERCHANGE,
        words=dictionary.THREE_MF,
        changes={".3mf": (change_zip, change_zip)},
    ),
    Target(
        name="usd",
        seeds=usd_seeds.usds,
        read=read_mesh,
        modules=INGEST,
        words=dictionary.USD,
        changes={".usda": (change_text,), ".usdz": (change_zip,), **_PNG},
        slowness=100,  # a process for each
    ),
    Target(
        name="conversion",
        seeds=gltf_seeds.gltfs,
        read=convert,
        modules=(*INGEST, "depthwalk.conversion"),
        words=tuple(f'"{key}": '.encode() for key in dictionary.GLTF_KEYS),
        changes={".gltf": (partial(change_json, keys=dictionary.GLTF_KEYS),), ".glb": (change_glb,), **_PNG},
    ),
    Target(
        name="texture",
        seeds=seeds.textures,
        read=lambda path: properties.check_texture(load_texture(path)),
        modules=(
            "depthwalk.ingest.image",
            "depthwalk.ingest.sources",
            "PIL.PngImagePlugin",
            "PIL.TiffImagePlugin",
            "PIL.TgaImagePlugin",
            "PIL.DdsImagePlugin",
            "PIL.BmpImagePlugin",
            "PIL.GifImagePlugin",
        ),
        words=dictionary.PICTURE,
        changes=_PNG,
    ),
    Target(
        name="sky",
        seeds=seeds.skies,
        read=lambda path: properties.check_sky(load_sky_image(path)),
        modules=("depthwalk.ingest.sky_image", "depthwalk.ingest.radiance_hdr", "depthwalk.ingest.exr"),
        words=dictionary.SKY,
        changes={".exr": (change_exr,), **_PNG},
    ),
    Target(
        name="range",
        seeds=seeds.ranges,
        read=read_range,
        modules=(*INGEST, "depthwalk.bake.meso_file"),
        words=dictionary.DEPTH,
        changes={".npy": (change_npy,), ".exr": (change_exr,), **_PNG},
    ),
    Target(
        name="baked",
        seeds=seeds.baked,
        read=lambda path: properties.check_model(read_baked(path)),
        modules=("depthwalk.bake.file", "depthwalk.bake.file_layout", "depthwalk.bake.header"),
        words=dictionary.BAKED,
        changes={".exr": (change_exr, change_exr)},
    ),
    Target(
        name="cooked",
        seeds=seeds.cooked,
        read=read_cooked_file,
        modules=("depthwalk.cook.cooked_file", "depthwalk.cook.array_packing", "depthwalk.array_file"),
        changes={".npz": (change_npz, change_npz)},
    ),
    Target(
        name="cache",
        seeds=lambda: seeds.caches() + [{"kept.exr": files["model.dpci.exr"]} for files in seeds.baked()],
        read=read_cached,
        modules=(
            "depthwalk.cache",
            "depthwalk.array_file",
            "depthwalk.bake.level_file",
            "depthwalk.cook.cluster_file",
            "depthwalk.bake.cache",
        ),
        changes={".npz": (change_npz, change_npz), ".exr": (change_exr,)},
    ),
)
