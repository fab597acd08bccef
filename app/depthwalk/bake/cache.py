"""Find and keep baked models: in the user's cache folder, or shipped beside the mesh, by their key."""

import hashlib
import json
import logging
from pathlib import Path

from depthwalk.bake.file import SUFFIX, read_baked, read_header, write_baked
from depthwalk.bake.header import FORMAT_VERSION
from depthwalk.bake.model import BakedModel
from depthwalk.cache import Cache
from depthwalk.errors import InputError

log = logging.getLogger(__name__)

BAKED = Cache(suffix=SUFFIX, content="depth images")


def bake_key(source: str, **parameters: object) -> str:
    """Return the key of a baked model, 64 hex digits: a hash of all that it depends on.

    Parameters
    ----------
    source
        Hash of the files it is made from.
    **parameters
        The bake's parameters, values that JSON can hold; the file format is added.
    """
    text = json.dumps({"source": source, "format": FORMAT_VERSION, **parameters}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def sidecar(mesh: Path) -> Path:
    """Return the path of the baked file beside a mesh: `bust.dpci.exr` beside `bust.obj`."""
    return mesh.with_name(mesh.stem + SUFFIX)


def has_key(path: Path, key: str) -> bool:
    """Return whether the file at `path` is a baked model of `key`, by its header; its pixels may still be damaged."""
    try:
        return path.is_file() and read_header(path)["depthwalk.key"] == key
    except (InputError, OSError):
        return False


def read_model(path: Path, key: str) -> BakedModel | None:
    """Return the whole model of `key` that the user's file `path` holds.

    None where it is missing or of another key; and, with a warning, where it is damaged.
    """
    if not has_key(path, key):
        return None
    try:
        return read_baked(path)
    except (InputError, OSError) as error:
        log.warning("%s; passed over", error)
        return None


def find_baked(mesh: Path, key: str) -> BakedModel | None:
    """Find the model of `key` beside the mesh or in the cache.

    A stale or damaged file is passed over, since baking again replaces it. Returns None where no other is found.
    """
    return read_model(sidecar(mesh), key) or find_cached(key)


def find_cached(key: str) -> BakedModel | None:
    """Return the model of `key` in the cache, or None."""
    return BAKED.find(key, lambda path: _read(path, key))


def keep_baked(baked: BakedModel) -> Path:
    """Store `baked` in the cache folder, make room for it, and return its path.

    Raises
    ------
    OSError
        Where it cannot be written.
    InputError
        As `write_baked` does.
    """
    return BAKED.keep(baked.key, lambda path: write_baked(path, baked))


def _read(path: Path, key: str) -> BakedModel:
    """Return the model in a cached file. Raises InputError where it is damaged or not of `key`."""
    model = read_baked(path)
    if model.key != key:
        raise InputError(f"{path}: depth images of another key")
    return model
