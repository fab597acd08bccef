"""Bound what the program takes of a machine: memory for reading one input, and the disk for its cache.

`limits` says what the program can make use of. A small file may ask for more than the machine holds long before it
meets one of them: a megabyte of a compressed picture is a gigabyte of pixels, and a scene graph places one mesh a
thousand times. So readers tell what they are about to need, from the file's header, before they allocate it.
"""

import os
import re
from functools import cache
from pathlib import Path

from depthwalk import limits
from depthwalk.errors import InputError
from depthwalk.limits import MEMORY_SHARE

CACHE_LIMIT = "DEPTHWALK_CACHE_LIMIT"  # the variable of the environment, which processes that are started inherit

_SIZE = re.compile(r"(\d{1,9}(?:\.\d{1,9})?)\s*([kMGT]?)(i?)B?", re.IGNORECASE | re.ASCII)
_PREFIXES = ("", "k", "m", "g", "t")

_SMALL = 256 << 20  # bytes that every machine has, so that it need not be asked


@cache
def machine_memory() -> int:
    """Return how many bytes of memory this process may use: the machine's, or what a container of Linux allows."""
    import psutil  # takes 20 ms to import, and few inputs are that large

    total = int(psutil.virtual_memory().total)
    try:
        return min(total, int(Path("/sys/fs/cgroup/memory.max").read_text()))
    except (OSError, ValueError):  # no container of Linux, or one without a bound, which says "max"
        return total


def check_memory(name: object, needed: int, content: str) -> None:
    """Check that reading an input leaves the machine some memory, before any is allocated.

    Parameters
    ----------
    name
        The file, as messages call it.
    needed
        Bytes that the reader will hold at once, at most.
    content
        What takes the memory, in words for the message.

    Raises
    ------
    InputError
        Where that is more than MEMORY_SHARE of the memory that this process may use.
    """
    if needed > _SMALL and needed > (allowed := int(MEMORY_SHARE * machine_memory())):
        raise InputError(
            f"{name}: {content} would take {needed / 1e6:.0f} MB of memory; {allowed / 1e6:.0f} MB are allowed here"
        )


def cache_limit() -> int:
    """Return how many bytes the cache may hold: by the environment variable CACHE_LIMIT, else MAX_CACHE_BYTES.

    Raises InputError where the variable is no size.
    """
    text = os.environ.get(CACHE_LIMIT)
    return parse_size(text, CACHE_LIMIT) if text else limits.MAX_CACHE_BYTES


def size_in_bytes(text: str) -> int | None:
    """Return the bytes that a text such as `500MB`, `4 GiB` or `1000` stands for; None if it is no size.

    Parameters
    ----------
    text
        A number, and B, kB, MB, GB or TB in powers of 1000, KiB, MiB, GiB or TiB in powers of 1024.
    """
    match = _SIZE.fullmatch(text.strip())
    if match is None:
        return None
    number, prefix, binary = match.groups()
    return int(float(number) * (1024 if binary else 1000) ** _PREFIXES.index(prefix.lower()))


def parse_size(text: str, name: str) -> int:
    """Return the bytes that a text stands for, see `size_in_bytes`.

    Parameters
    ----------
    text
        What an option or variable was given.
    name
        That option or variable, to begin the message.

    Raises
    ------
    InputError
        Where the text is no size.
    """
    found = size_in_bytes(text)
    if found is None:
        raise InputError(f"{name} {text}: must be a size such as 500MB or 4GB")
    return found
