"""Disable Mesa's shader cache if its disk is nearly full, or its folder cannot be created.

Mesa maps the index of its cache, a sparse file, into memory. If the disk is full when a hole is first written, the
kernel kills the process by SIGBUS, which a program cannot handle (Mesa 22.3, `disk_cache_mmap_cache_index`).
"""

import logging
import os
import shutil
from pathlib import Path

from platformdirs import user_cache_path

log = logging.getLogger(__name__)

DISABLE = "MESA_SHADER_CACHE_DISABLE"
_FOLDER = "MESA_SHADER_CACHE_DIR"
_ROOM = 64 << 20  # bytes: fifty times the index, as others write to the same disk while the program runs


def guard_shader_cache() -> None:
    """Set `DISABLE` in the environment if Mesa's cache has no folder or little room, unless it is set already.

    Call this before a context is created, which is when Mesa reads the environment. Other drivers ignore it.
    """
    if DISABLE in os.environ:
        return
    folder = Path(os.environ.get(_FOLDER) or user_cache_path())
    try:
        place = next(place for place in (folder, *folder.parents) if place.exists())
        disk = shutil.disk_usage(place)
    except (OSError, StopIteration):  # a folder that cannot be accessed, in which Mesa keeps nothing either
        return
    if not place.is_dir():
        why = "is no folder" if place == folder else f"cannot be created, since {place} is no folder"
    elif not disk.total or (place != folder and not os.access(place, os.W_OK)):  # /proc is no disk
        why = "cannot be created"
    elif disk.free < _ROOM:
        why = f"{disk.free >> 20} MB of the disk are free"
    else:
        return
    log.warning("%s: %s: compiled shaders are not kept", folder, why)
    os.environ[DISABLE] = "true"
