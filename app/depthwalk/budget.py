"""Limit what the program takes of a machine: memory for reading one input, and disk space for its cache.

`limits` holds absolute bounds. A small file may need more memory than the machine has long before it reaches one of
them: a megabyte of compressed picture may be a gigabyte of pixels, and a scene graph may place one mesh a thousand
times. So readers work out from the file's header what they will need, and check it here before they allocate.
"""

import os
from functools import cache
from pathlib import Path

from depthwalk import limits
from depthwalk.errors import InputError
from depthwalk.limits import MEMORY_SHARE, size_in_bytes

CACHE_LIMIT = "DEPTHWALK_CACHE_LIMIT"  # environment variable; child processes inherit it

_SMALL = 256 << 20  # bytes; every machine has these, so smaller needs are not checked


@cache
def machine_memory() -> int:
    """Return how many bytes of memory this process may use: the machine's, or the limit of a Linux container."""
    import psutil  # takes 20 ms to import, and few inputs are large enough to need it

    total = int(psutil.virtual_memory().total)
    try:
        return min(total, int(Path("/sys/fs/cgroup/memory.max").read_text()))
    except (OSError, ValueError):  # not in a Linux container, or in one without a limit, which says "max"
        return total


def check_memory(name: object, needed: int, content: str) -> None:
    """Check, before anything is allocated, that reading an input leaves the machine some memory.

    Parameters
    ----------
    name
        The file, as messages name it.
    needed
        Most bytes that the reader will hold at once.
    content
        What takes the memory, in words for the message.

    Raises
    ------
    InputError
        If that is more than MEMORY_SHARE of the memory that this process may use.
    """
    if needed > _SMALL and needed > (allowed := int(MEMORY_SHARE * machine_memory())):
        raise InputError(
            f"{name}: {content} would take {needed / 1e6:.0f} MB of memory; {allowed / 1e6:.0f} MB are allowed here"
        )


def cache_limit() -> int:
    """Return how many bytes the cache may hold: the environment variable CACHE_LIMIT, or else MAX_CACHE_BYTES.

    Raises InputError if the variable is not a size.
    """
    text = os.environ.get(CACHE_LIMIT)
    return parse_size(text, CACHE_LIMIT) if text else limits.MAX_CACHE_BYTES


def parse_size(text: str, name: str) -> int:
    """Return the number of bytes that a text such as `4GB` stands for, see `size_in_bytes`.

    Parameters
    ----------
    text
        The value of an option or a variable.
    name
        Name of that option or variable; the error message begins with it.

    Raises
    ------
    InputError
        If the text is not a size.
    """
    found = size_in_bytes(text)
    if found is None:
        raise InputError(f"{name} {text}: must be a size such as 500MB or 4GB")
    return found
