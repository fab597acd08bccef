"""Translate USD files to glTF, in a process that may take only as much as the files explain.

usd-core is C++ that believes the sizes in a damaged file; a process of its own can be ended.
"""

import json
import logging
import os
from collections.abc import Iterable
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from threading import Lock
from typing import NamedTuple

from depthwalk.budget import machine_memory
from depthwalk.errors import InputError
from depthwalk.extras import install_command
from depthwalk.ingest.formats import USD_SUFFIXES
from depthwalk.ingest.watched_process import messages_in, run_watched
from depthwalk.limits import MAX_LOOKUPS, MAX_MESH_BYTES, MEMORY_SHARE

log = logging.getLogger(__name__)

_WORKER = "depthwalk.ingest.usd.worker"
# What a translation may take. Measured, per byte of the file: binary meshes 11 bytes and 0.03 µs, a million copies of a
# PointInstancer 65 bytes and 0.2 µs, instances in text 25 bytes and 1 µs; and 100 MB and 0.4 s for the library.
_BYTES, _BYTES_PER_BYTE = 1 << 30, 100
_SECONDS, _SECONDS_PER_BYTE = 60.0, 1e-5
_KEPT_BYTES = 256 << 20  # of all translations that are kept but the last
_PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".tga", ".tif", ".tiff", ".bmp", ".hdr", ".exr")


class _Kept(NamedTuple):
    """A translation, and the files that it is made of, as `_stamps` returns them."""

    stamps: dict[str, tuple[int, int] | None]
    data: bytes


_kept: dict[Path, _Kept] = {}  # the oldest first
_keeping = Lock()


def translated(path: Path) -> bytes:
    """Return a GLB file that shows what a USD file shows.

    The last translations are kept, as long as no file changes that they are made of: a mesh is read several times, for
    its head, its hash and its triangles.

    The scene of the GLB file has the axes and the unit of glTF: y upward, metres. Pictures are in it. Its header says
    below the key `extras` what is not in it, see `gltf_unread`, and what the picture of the dome light is, see
    `usd.lights`. Copies are instances of `EXT_mesh_gpu_instancing` where nodes for each would be too many.

    Parameters
    ----------
    path
        The USD file.

    Returns
    -------
    bytes
        The GLB file.

    Raises
    ------
    InputError
        `path: defect` or `path: /Prim/Path: defect`, also if usd-core is not installed.
    """
    if find_spec("pxr") is None:
        raise InputError(f"{path}: `{install_command('usd')}` installs what reads USD files")
    if (kept := _kept.get(path)) is not None and _stamps(kept.stamps) == kept.stamps:
        return kept.data
    beside = _stamps_beside(path)
    length = sum(min(stamp[1], MAX_MESH_BYTES) for stamp in beside.values() if stamp is not None)
    most_bytes = min(_BYTES + _BYTES_PER_BYTE * length, int(MEMORY_SHARE * machine_memory()))
    request = json.dumps({"path": str(path.resolve()), "root": str(path.resolve().parent)}).encode()
    answer = run_watched(_WORKER, [request], most_bytes=most_bytes, most_seconds=_SECONDS + _SECONDS_PER_BYTE * length)
    messages = list(messages_in(answer.data))
    said = json.loads(bytes(messages[0])) if messages else {}
    if "error" in said:
        raise InputError(f"{path}: {said['error']}")
    if answer.excess:
        raise InputError(f"{path}: damaged, or too large: it takes too much {answer.excess} to read")
    if not answer.is_ready:
        raise InputError(f"{path}: usd-core, which reads USD files, does not start")
    if len(messages) != 2:
        raise InputError(f"{path}: damaged, truncated or an unsupported kind of USD")
    for warning in said["warnings"]:
        log.warning("%s: %s", path, warning)
    data = bytes(messages[1])
    if not said["warnings"]:  # such as of a picture that is missing, and may come
        # By the stamps from before the files were read: one that was written meanwhile counts as changed.
        _keep(path, _Kept({file: beside.get(file) for file in said["files"]}, data))
    return data


def _stamps(files: Iterable[str]) -> dict[str, tuple[int, int] | None]:
    """Return when files were changed and how long they are; None for those that are missing."""

    def stamp(file: str) -> tuple[int, int] | None:
        try:
            found = os.stat(file)
        except OSError:
            return None
        return found.st_mtime_ns, found.st_size

    return {file: stamp(file) for file in files}


def _keep(path: Path, made: _Kept) -> None:
    """Keep a translation, and forget the oldest ones if all together are too long."""
    with _keeping:
        _kept.pop(path, None)
        _kept[path] = made
        for oldest in list(_kept)[:-1]:
            if sum(len(each.data) for each in _kept.values()) > _KEPT_BYTES:
                del _kept[oldest]


def _stamps_beside(path: Path) -> dict[str, tuple[int, int] | None]:
    """Return the stamps of files below the folder of a USD file that it may be made of, of the first MAX_LOOKUPS."""
    walked = ((folder, name) for folder, _, names in os.walk(path.resolve().parent) for name in names)
    kinds = (*USD_SUFFIXES, *_PICTURES)
    return _stamps(
        os.path.join(folder, name) for folder, name in islice(walked, MAX_LOOKUPS) if name.lower().endswith(kinds)
    )
