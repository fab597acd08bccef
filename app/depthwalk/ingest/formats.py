"""Distinguish files by the endings of their names, without opening them or importing their readers."""

from pathlib import Path

from depthwalk.errors import InputError

USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
GLTF_SUFFIXES = (".glb", ".gltf", *USD_SUFFIXES)  # USD is translated when it is read, see `sources`
LAS_SUFFIXES = (".las", ".laz")
INTERCHANGE_SUFFIXES = (".fbx", ".dae", ".3ds", ".3mf")
UPRIGHT_SUFFIXES = (*GLTF_SUFFIXES, *LAS_SUFFIXES, *INTERCHANGE_SUFFIXES)  # whose axes are known
METRIC_SUFFIXES = tuple(suffix for suffix in UPRIGHT_SUFFIXES if suffix != ".3ds")  # whose unit is known
MESH_SUFFIXES = (".obj", ".ply", ".stl", ".off", *UPRIGHT_SUFFIXES)
OTHER_MESH_SUFFIXES = (
    ".abc",
    ".amf",
    ".blend",
    ".dxf",
    ".iges",
    ".igs",
    ".lwo",
    ".max",
    ".step",
    ".stp",
    ".vrm",
    ".wrl",
    ".x",
    ".x3d",
)
OTHER_POINT_SUFFIXES = (".asc", ".e57", ".ksplat", ".pcd", ".pts", ".ptx", ".sog", ".splat", ".spz", ".xyz")
BAKED_SUFFIX, COOKED_SUFFIX = ".dpci.exr", ".dpci.npz"
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".tif", ".tiff", ".bmp", ".tga", ".gif", ".ppm", ".dds")
SKY_SUFFIXES = (".hdr", ".exr", *IMAGE_SUFFIXES)
MESH_PART_SUFFIXES = (".mtl", ".bin", *IMAGE_SUFFIXES)  # of files that meshes name, and that are read with them

SCENE_SUFFIXES = (".yaml", ".yml")
_SCENE = "a scene or a camera path", "`view`, `render` and `check` take it"
_PICTURE = "a picture", "--sky lights a scene or a model by it"
# What files are that users take for meshes or scenes, and what takes them.
_CONTENTS = {
    **dict.fromkeys(SCENE_SUFFIXES, _SCENE),
    **dict.fromkeys(SKY_SUFFIXES, _PICTURE),
    ".html": ("a web page, such as a report", "a browser opens it"),
    ".csv": ("a table", "a scene names a table of places by the key 'places'"),
    ".json": ("advice or measurements, such as `advise` writes", "a scene names advice by the key 'advice'"),
    ".mp4": ("a video", "a player shows it"),
}
_DEPTH_IMAGES = "depth images", "`view` opens them, and a scene names them by the key 'baked'"


def content(path: Path) -> tuple[str, str] | None:
    """Return what the file `path` holds by its name, and what takes it; None for meshes and unknown names."""
    return _DEPTH_IMAGES if is_baked_file(path) else _CONTENTS.get(path.suffix.lower())


def check_suffix(path: Path) -> None:
    """Raise InputError unless the name of the file `path` ends like that of a mesh that can be read."""
    suffix = path.suffix.lower()
    if suffix not in MESH_SUFFIXES:
        if known := content(path):
            raise InputError(f"{path}: {known[0]}, no mesh; {known[1]}")
        hint = "; save it as .glb, for example in Blender" if suffix in OTHER_MESH_SUFFIXES else ""
        hint = "; save it as .ply" if suffix in OTHER_POINT_SUFFIXES else hint
        raise InputError(f"{path}: {suffix!r} is not a mesh format (use {', '.join(MESH_SUFFIXES)}){hint}")


def check_baked_suffix(path: Path) -> None:
    """Raise InputError unless the name of the file `path` ends like that of depth images."""
    if path.suffix.lower() != ".exr" and not is_cooked_file(path):
        raise InputError(
            f"{path}: does not hold depth images ({COOKED_SUFFIX} or {BAKED_SUFFIX}); a mesh is named by the key 'mesh'"
        )


def check_sky_suffix(path: Path) -> None:
    """Raise InputError unless the name of the file `path` ends like that of a picture that can be a sky."""
    if path.suffix.lower() not in SKY_SUFFIXES:
        raise InputError(f"{path}: {path.suffix!r} is not a picture of a sky (use {', '.join(SKY_SUFFIXES[:4])})")


def is_mesh_file(path: Path) -> bool:
    """Return whether the name of the file `path` ends like that of a mesh.

    Raises InputError for mesh formats that cannot be read, so that such a file is not taken for a scene.
    """
    if path.suffix.lower() in (*OTHER_MESH_SUFFIXES, *OTHER_POINT_SUFFIXES):
        check_suffix(path)
    return path.suffix.lower() in MESH_SUFFIXES


def is_baked_file(path: Path) -> bool:
    """Return whether the file `path` is named like depth images, baked or cooked."""
    return path.name.lower().endswith(BAKED_SUFFIX) or is_cooked_file(path)


def is_cooked_file(path: Path) -> bool:
    """Return whether the file `path` is named like cooked depth images."""
    return path.name.lower().endswith(COOKED_SUFFIX)


def is_model_file(path: Path) -> bool:
    """Return whether the file `path` is named like a mesh or depth images.

    Raises InputError as `is_mesh_file` does.
    """
    return is_baked_file(path) or is_mesh_file(path)
