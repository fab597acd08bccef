"""Name the attributes, parts and channels of a file of depth images, as `bake.file` describes them."""

import re

import numpy as np

from depthwalk.bake.images import Face

FORMAT_VERSION = 10
TEXTURED_VERSION = 11  # of files in which an object has a texture and its images have texture coordinates
MAPPED_VERSION = 12  # of files in which the normals of an object's images are turned by normal maps
ATTRIBUTE = "depthwalk."
GEOMETRY = ("radius", "bottom", "top", "half_width", "half_depth")
PLACEMENT = ("x", "y", "z", "qx", "qy", "qz", "qw")
LEFT_OUT = "left_out"  # optional attribute
MESH_TRIANGLES = "mesh_triangles"  # optional
HAS_INTERIOR = "has_interior"  # optional
KEEPS_NORMALS = "keeps_normals"  # optional
REFLECTION = ("roughness", "metalness")  # optional, both or neither
TELLS_ROUGHNESS = "tells_roughness"  # optional
LISTS = ("border", "triangles")  # names of the parts that hold a boundary strip: border.side.0, triangles.side.0
TEXTURE = "texture"  # name of the part that holds the texture
COORDINATES = "uv"  # channel of texture coordinates
MAPPED_NORMAL = ("M.x", "M.y", "M.z")  # channels of normals turned by normal maps
TEXTURE_CHANNELS = ("R", "G", "B")
CHANNELS = ("R", "G", "B", "specular", "Z", "N.x", "N.y", "N.z", "owner")
_LIST_CHANNELS = {"border": ("start", "du", "dv", "rise", "used"), "triangles": ("a", "b", "c", "used")}
_FACES = "|".join(face.name.lower() for face in Face)
_NAME = re.compile(rf"(?:(border|triangles)\.)?({_FACES})\.([0-7])", re.ASCII)
_OBJECT = re.compile(r"(?:part([1-9][0-9]?)\.)?(.*)", re.ASCII | re.DOTALL)


def split_name(name: str) -> tuple[int, str]:
    """Split the `name` of a part into the number of its object, from 0, and the rest.

    The name `part2.side.0` gives (1, `side.0`).
    """
    match = _OBJECT.fullmatch(name)
    assert match is not None  # it matches anything
    return (int(match[1]) - 1 if match[1] else 0), match[2]


def is_part(name: str, steps: int) -> bool:
    """Return whether a part of an object whose images have `steps` grids may have the name `name`."""
    match = _NAME.fullmatch(split_name(name)[1])
    return is_texture(name) or (match is not None and not (match[1] and int(match[3]) >= steps))


def is_list(name: str) -> bool:
    """Return whether the part `name` holds vertices or triangles of a boundary strip instead of an image."""
    return split_name(name)[1].startswith(LISTS)


def is_texture(name: str) -> bool:
    """Return whether the part `name` holds the texture of an object."""
    return split_name(name)[1] == TEXTURE


def channel_names(name: str, steps: int, textured: bool = False, mapped: bool = False) -> tuple[str, ...]:
    """Return the names of the channels of a part of a file.

    Parameters
    ----------
    name
        The name of the part.
    steps
        Number of grids of its object's images.
    textured
        Whether its object has a texture.
    mapped
        Whether its object has normals that are turned by normal maps.

    Returns
    -------
    tuple
        The names, in no particular order.
    """
    if is_texture(name):
        return TEXTURE_CHANNELS
    if is_list(name):
        return _LIST_CHANNELS[split_name(name)[1].split(".")[0]]
    cells = (f"cells.{pair}" for pair in range((steps + 1) // 2))
    return (*CHANNELS, *cells, *((COORDINATES,) if textured else ()), *(MAPPED_NORMAL if mapped else ()))


def channel_type(channel: str) -> type[np.generic]:
    """Return the NumPy type of the pixels of the channel `channel`, the same in all parts that have it."""
    if channel.startswith("cells.") or channel in ("owner", "start", "used", "a", "b", "c", COORDINATES):
        return np.uint32
    return np.float32 if channel == "Z" else np.float16
