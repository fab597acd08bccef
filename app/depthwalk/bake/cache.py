"""Baked models are made once: kept in the user's cache folder, or shipped beside the mesh, found by their key."""

import hashlib
import json
import logging
from pathlib import Path

from depthwalk.bake.file import FORMAT_VERSION, SUFFIX, read_baked, read_header, write_baked
from depthwalk.bake.model import BakedModel
from depthwalk.cache import Cache
from depthwalk.errors import InputError

log = logging.getLogger(__name__)

BAKED = Cache(suffix=SUFFIX, content="depth images")


def bake_key(source: str, **parameters: object) -> str:
    """What a baked model depends on, as 64 hex digits: its sources' hash, the bake's parameters, the file format."""
    text = json.dumps({"source": source, "format": FORMAT_VERSION, **parameters}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def sidecar(mesh: Path) -> Path:
    """`bust.dpci.exr` beside `bust.obj`."""
    return mesh.with_name(mesh.stem + SUFFIX)


def has_key(path: Path, key: str) -> bool:
    """Whether the file is a model of `key`, by its header; its pixels may still be damaged."""
    try:
        return path.is_file() and read_header(path)["depthwalk.key"] == key
    except InputError:
        return False


def read_model(path: Path, key: str) -> BakedModel | None:
    """Return the whole model of `key` that the user's file `path` holds.

    None where it is missing or of another key; and, with a warning, where it is damaged.
    """
    if not has_key(path, key):
        return None
    try:
        return read_baked(path)
    except InputError as error:
        log.warning("%s; passed over", error)
        return None


def find_baked(mesh: Path, key: str) -> BakedModel | None:
    """The model of `key` beside the mesh or in the cache; a file that is stale or damaged is passed over."""
    return read_model(sidecar(mesh), key) or find_cached(key)


def find_cached(key: str) -> BakedModel | None:
    """The model of `key` in the cache."""
    return BAKED.find(key, lambda path: _read(path, key))


def keep_baked(baked: BakedModel) -> Path:
    """Stores `baked` in the cache folder, makes room for it and returns where.

    Raises OSError where that is not possible, InputError as `write_baked` does.
    """
    return BAKED.keep(baked.key, lambda path: write_baked(path, baked))


def _read(path: Path, key: str) -> BakedModel:
    """The model in a cached file. Raises InputError where it is damaged or not of `key`."""
    model = read_baked(path)
    if model.key != key:
        raise InputError(f"{path}: depth images of another key")
    return model
