"""Keep what numba compiles in the cache folder.

numba looks only at the file of a function before it takes it from there, not at what that file imports, so each state
of these files has a folder of its own; those of other states are removed when nobody has used them for some weeks.
"""

import hashlib
import logging
import shutil
import tempfile
import time
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

from depthwalk.cache import cache_folder

log = logging.getLogger(__name__)

_COMPLETE = "complete"  # a file in a folder whose loops are all compiled, as old as their last use
_UNUSED = 21 * 86_400  # seconds after which the code of another state of these files is removed


def folder() -> Path:
    """Return the folder in which the compiled code of these files is kept, for the version of numba that is here."""
    sources = sorted(Path(__file__).parent.glob("*.py"))
    state = b"".join(path.read_bytes() for path in sources) + version("numba").encode()
    return cache_folder().parent / "compiled" / hashlib.sha256(state).hexdigest()[:16]


def is_writable() -> bool:
    """Return whether compiled code can be kept; warn where it cannot."""
    try:
        folder().mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder()).close()
    except OSError as error:
        log.warning("frames are planned by NumPy, since %s cannot be written: %s", folder(), error.strerror or error)
        return False
    return True


def is_complete() -> bool:
    """Return whether all loops are compiled, so that loading them takes no longer than reading files."""
    return (folder() / _COMPLETE).is_file()


def mark_complete() -> None:
    """Note that all loops are compiled, and used now."""
    with suppress(OSError):  # removed meanwhile, or the disk is full
        (folder() / _COMPLETE).touch()


def remove_unused() -> None:
    """Remove what other states of these files were compiled to, if nobody has used it for some weeks.

    The mark `complete` goes first. Whoever needs a folder that is half removed then compiles what is missing.
    """
    for other in folder().parent.iterdir():
        with suppress(OSError):  # of another process, which removes it too, or on a read-only disk
            mark = other / _COMPLETE
            used = (mark if mark.is_file() else other).stat().st_mtime
            if other != folder() and time.time() - used > _UNUSED:
                mark.unlink(missing_ok=True)
                shutil.rmtree(other)
