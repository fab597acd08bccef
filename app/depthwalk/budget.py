"""Bound the memory that reading one input may take by what this machine has.

`limits` says what the program can make use of. A small file may ask for more than the machine holds long before it
meets one of them: a megabyte of a compressed picture is a gigabyte of pixels, and a scene graph places one mesh a
thousand times. So readers tell what they are about to need, from the file's header, before they allocate it.
"""

from functools import cache
from pathlib import Path

from depthwalk.errors import InputError
from depthwalk.limits import MEMORY_SHARE

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
            f"{name}: {content} would take {needed / 1e9:.1f} GB of memory; {allowed / 1e9:.1f} GB are allowed here"
        )
