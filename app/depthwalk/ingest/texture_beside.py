"""Suggest to a user that a picture beside a mesh may be its texture.

Nothing is guessed: a mesh whose file names no picture is drawn without one, as in other programs. But an OBJ file that
has texture coordinates and no material was made for a texture, and a single picture named after it is likely that one.
"""

import json
import re
import shlex
from pathlib import Path

from depthwalk.errors import InputError
from depthwalk.ingest.formats import IMAGE_SUFFIXES
from depthwalk.ingest.mesh_head import read_head

# What the name of a picture of colours adds to the mesh's, in lower case without anything but letters.
_WORDS = {"", "texture", "tex", "diffuse", "diff", "albedo", "color", "colour", "col", "basecolor", "basecolour", "map"}
_COORDINATE = re.compile(rb"[\r\n]vt[ \t]")
_BLOCK = 1 << 20  # bytes read at a time


def texture_hint(mesh: Path, option: str) -> str:
    """Return a hint that a picture beside a mesh may be its texture.

    Parameters
    ----------
    mesh
        The mesh file.
    option
        How the user names the texture, without its file: `--texture `, which takes a path, or `--set …=`, which takes
        the name of a file beside the mesh.

    Returns
    -------
    str
        One line without the mesh's name; "" for a mesh that has materials or no texture coordinates, or beside which
        there is no picture named after it, or several.
    """
    if mesh.suffix.lower() != ".obj" or (picture := _picture_beside(mesh)) is None or not _awaits_texture(mesh):
        return ""
    named = picture.name
    if option.startswith("--texture"):
        named = str(picture)
    elif not re.fullmatch(r"[\w.-]+", named):
        named = json.dumps(named, ensure_ascii=False)  # values of --set are YAML
    return f"names no texture; if {picture.name} is its texture: {option}{shlex.quote(named)}"


def _picture_beside(mesh: Path) -> Path | None:
    """Return the only picture in the mesh's folder that is named after it; None if there is none, or another."""
    stem = mesh.stem.lower()
    try:
        pictures = [
            file
            for file in mesh.parent.iterdir()
            if file.suffix.lower() in IMAGE_SUFFIXES
            and (name := file.stem.lower()).startswith(stem)
            and re.sub(r"[\W\d_]", "", name[len(stem) :]) in _WORDS
        ]
    except OSError:  # the folder may not be listed
        return None
    return pictures[0] if len(pictures) == 1 else None


def _awaits_texture(mesh: Path) -> bool:
    """Return whether an OBJ file has texture coordinates, but no library of materials that can be read."""
    try:
        if read_head(mesh).files != (mesh,):
            return False
        with mesh.open("rb") as file:
            end = b"\n"
            while block := file.read(_BLOCK):
                if _COORDINATE.search(end + block):
                    return True
                end = block[-3:]
    except (InputError, OSError):  # reported when the mesh is read
        pass
    return False
