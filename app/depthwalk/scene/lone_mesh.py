"""A mesh file where a scene file is expected: a scene of that mesh alone."""

import json
from pathlib import Path

from depthwalk.errors import InputError
from depthwalk.ingest.sources import MESH_SUFFIXES, OTHER_MESH_SUFFIXES, check_suffix
from depthwalk.scene.document import Document, parse_document


def is_mesh_file(path: Path) -> bool:
    """Whether the file's name is that of a mesh. Raises InputError where it is that of one which is not read."""
    if path.suffix.lower() in OTHER_MESH_SUFFIXES:
        check_suffix(path)
    return path.suffix.lower() in MESH_SUFFIXES


def mesh_document(path: Path) -> Document:
    """The scene file that somebody would write to look at a mesh: its depth images, as `depthwalk bake` makes them, and
    nothing around. `--set` reaches the mesh as `assets.model`. The file is named as it is where links lead to.

    Raises InputError where there is no such file.
    """
    if not path.is_file():
        raise InputError(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}")
    name = json.dumps(path.resolve().name, ensure_ascii=False)
    return parse_document(
        f"{{version: 1, assets: {{model: {{mesh: {name}, dpci: {{}}}}}}, objects: [{{asset: model}}]}}", str(path)
    )
