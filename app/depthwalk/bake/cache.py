"""Find and store baked models by their key: in the user's cache folder, or shipped beside the mesh."""

import hashlib
import json
import logging
from pathlib import Path

from depthwalk.bake.file import SUFFIX, read_baked, read_header, write_baked
from depthwalk.bake.file_layout import FORMAT_VERSION
from depthwalk.bake.model import BakedModel
from depthwalk.cache import Cache
from depthwalk.errors import InputError

log = logging.getLogger(__name__)

_SAMPLING = 3  # version of the baker's results: raise it when they improve for the same parameters, to re-bake caches

BAKED = Cache(suffix=SUFFIX, content="depth images")


def bake_key(source: str, **parameters: object) -> str:
    """Return the key of a baked model: a hash of everything the model depends on.

    Parameters
    ----------
    source
        Hash of the files that the model is made from.
    **parameters
        The bake's parameters, values that JSON can hold. The version of the file format is added.

    Returns
    -------
    str
        64 hex digits.
    """
    text = json.dumps({"source": source, "format": FORMAT_VERSION, "sampling": _SAMPLING, **parameters}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def sidecar(mesh: Path) -> Path:
    """Return the path of the baked file beside the file `mesh`: `bust.dpci.exr` beside `bust.obj`."""
    return mesh.with_name(mesh.stem + SUFFIX)


def has_key(path: Path, key: str) -> bool:
    """Return whether the header at `path` is that of a baked model with this `key`; pixels may still be damaged."""
    try:
        return path.is_file() and read_header(path)["depthwalk.key"] == key
    except (InputError, OSError):
        return False


def read_model(path: Path, key: str) -> BakedModel | None:
    """Read a model from one of the user's files; None if it is missing, has another key or is damaged.

    A damaged file is named in a warning.

    Parameters
    ----------
    path
        The baked file.
    key
        The key that the model must have, see `bake_key`.

    Returns
    -------
    BakedModel | None
        The whole model, or None.
    """
    if not has_key(path, key):
        return None
    try:
        return read_baked(path)
    except (InputError, OSError) as error:
        log.warning("%s; passed over", error)
        return None


def find_baked(mesh: Path, key: str) -> BakedModel | None:
    """Find a baked model beside its mesh or in the cache.

    Stale and damaged files are skipped, since they are replaced by baking again.

    Parameters
    ----------
    mesh
        The mesh file, which need not exist.
    key
        The key that the model must have, see `bake_key`.

    Returns
    -------
    BakedModel | None
        The whole model; None if it is in neither place.
    """
    return read_model(sidecar(mesh), key) or find_cached(key)


def find_cached(key: str) -> BakedModel | None:
    """Return the whole model stored in the cache under `key`; None if there is none, or a damaged one."""
    return BAKED.find(key, lambda path: _read(path, key))


def keep_baked(baked: BakedModel) -> Path:
    """Store a model in the cache folder, and remove the oldest files if the cache is full.

    Parameters
    ----------
    baked
        The model; its `key` names the file.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OSError
        If it cannot be written.
    InputError
        If there are more boundary strips than a file may hold.
    """
    return BAKED.keep(baked.key, lambda path: write_baked(path, baked))


def _read(path: Path, key: str) -> BakedModel:
    """Return the model in a cached file. Raises InputError if it is damaged or has another key."""
    model = read_baked(path)
    if model.key != key:
        raise InputError(f"{path}: depth images of another key")
    return model
