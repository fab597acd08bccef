"""Keep the code that numba compiles in the cache folder.

numba only checks whether the file of a function has changed, not the files that it imports. So each state of these
files has its own folder; folders of other states are removed when they have not been used for some weeks.
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

_COMPLETE = "complete"  # a file in a folder whose loops are all compiled; its time is that of their last use
_UNUSED = 21 * 86_400  # seconds after which the code of another state of these files is removed


def folder() -> Path:
    """Return the folder for the compiled code of these files, in their present state and for the installed numba."""
    sources = sorted(Path(__file__).parent.glob("*.py"))
    state = b"".join(path.read_bytes() for path in sources) + version("numba").encode()
    return cache_folder().parent / "compiled" / hashlib.sha256(state).hexdigest()[:16]


def is_writable() -> bool:
    """Return whether compiled code can be kept; log a warning if not."""
    try:
        folder().mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder()).close()
    except OSError as error:
        log.warning(
            "frames are planned by NumPy, which is slower, since %s cannot be written: %s",
            folder(),
            error.strerror or error,
        )
        return False
    return True


def is_complete() -> bool:
    """Return whether all loops are compiled, so that loading them only reads files."""
    return (folder() / _COMPLETE).is_file()


def mark_complete() -> None:
    """Record that all loops are compiled, and used now."""
    with suppress(OSError):  # the folder was removed meanwhile, or the disk is full
        (folder() / _COMPLETE).touch()


def remove_unused() -> None:
    """Remove the compiled code of other states of these files that has not been used for some weeks.

    The mark `complete` is removed first, so that a process that needs a half removed folder compiles what is missing.
    """
    for other in folder().parent.iterdir():
        with suppress(OSError):  # another process removes it too, or the disk is read-only
            mark = other / _COMPLETE
            used = (mark if mark.is_file() else other).stat().st_mtime
            if other != folder() and time.time() - used > _UNUSED:
                mark.unlink(missing_ok=True)
                shutil.rmtree(other)
