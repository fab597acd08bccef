"""Baked objects are made once: kept in the user's cache folder, or shipped beside the mesh, found by their key."""

import hashlib
import json
from pathlib import Path

from platformdirs import user_cache_path

from depthwalk.bake.file import FORMAT_VERSION, SUFFIX, read_baked, read_header, write_baked
from depthwalk.bake.images import BakedObject
from depthwalk.errors import InputError


def bake_key(source: str, **parameters: object) -> str:
    """What a baked object depends on, as 64 hex digits: its sources' hash, the bake's parameters, the file format."""
    text = json.dumps({"source": source, "format": FORMAT_VERSION, **parameters}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def cache_folder() -> Path:
    return user_cache_path("depthwalk", appauthor=False) / "baked"


def sidecar(mesh: Path) -> Path:
    """`bust.dpci.exr` beside `bust.obj`."""
    return mesh.with_name(mesh.stem + SUFFIX)


def find_baked(mesh: Path, key: str) -> BakedObject | None:
    """The object of `key` beside the mesh or in the cache; a file that is stale or damaged is passed over."""
    for path in (sidecar(mesh), cache_folder() / (key + SUFFIX)):
        try:
            if path.is_file() and read_header(path)["depthwalk.key"] == key:
                return read_baked(path)
        except InputError:
            continue
    return None


def keep_baked(baked: BakedObject) -> Path:
    """Stores `baked` in the cache folder and returns where. Raises OSError where that is not possible."""
    path = cache_folder() / (baked.key + SUFFIX)
    write_baked(path, baked)
    return path
