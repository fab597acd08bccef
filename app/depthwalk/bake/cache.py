"""Baked models are made once: kept in the user's cache folder, or shipped beside the mesh, found by their key."""

import contextlib
import hashlib
import json
import os
from pathlib import Path

from platformdirs import user_cache_path

from depthwalk import limits
from depthwalk.bake.file import SUFFIX, read_baked, read_header, write_baked
from depthwalk.bake.header import FORMAT_VERSION
from depthwalk.bake.model import BakedModel
from depthwalk.errors import InputError


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


def cache_folder() -> Path:
    """Return where all that can be made again is kept, as docs/baking.md says; the folder need not exist."""
    return user_cache_path("depthwalk", appauthor=False) / "baked"


def sidecar(mesh: Path) -> Path:
    """Return the path of the baked file beside a mesh: `bust.dpci.exr` beside `bust.obj`."""
    return mesh.with_name(mesh.stem + SUFFIX)


def kept_file(key: str) -> Path:
    """Return where the cache keeps the model of `key`."""
    return cache_folder() / (key + SUFFIX)


def has_key(path: Path, key: str) -> bool:
    """Return whether the file at `path` is a baked model of `key`, by its header alone."""
    try:
        return path.is_file() and read_header(path)["depthwalk.key"] == key
    except InputError:
        return False


def find_baked(mesh: Path, key: str) -> BakedModel | None:
    """Find the model of `key` beside the mesh or in the cache.

    A stale or damaged file is passed over, since baking again replaces it. Returns None where there is no other.
    """
    kept = kept_file(key)
    for path in (sidecar(mesh), kept):
        if not has_key(path, key):
            continue
        try:
            baked = read_baked(path)
        except InputError:
            continue
        if path == kept:
            with contextlib.suppress(OSError):  # removed meanwhile, or a cache that is read-only
                os.utime(path)  # its age is that of its last use
        return baked
    return None


def keep_baked(baked: BakedModel) -> Path:
    """Store `baked` in the cache folder, make room for it, and return its path.

    Raises
    ------
    OSError
        Where it cannot be written.
    InputError
        As `write_baked` does.
    """
    path = kept_file(baked.key)
    write_baked(path, baked)
    make_room(path)
    return path


def make_room(newest: Path) -> None:
    """Remove what was not used for longest, until the rest of the cache and `newest` fit MAX_CACHE_BYTES."""
    files: list[tuple[float, int, Path]] = []
    for path in newest.parent.iterdir():  # with what an interrupted write left
        with contextlib.suppress(OSError):  # another process removes as well
            status = path.stat()
            files.append((status.st_mtime, status.st_size, path))
    excess = sum(size for _, size, _ in files) - limits.MAX_CACHE_BYTES
    for _, size, path in sorted(files):
        if excess <= 0:
            break
        if path != newest:
            with contextlib.suppress(OSError):  # open, where that forbids it
                path.unlink(missing_ok=True)
                excess -= size
