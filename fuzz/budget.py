"""Bound what reading a file may cost: seconds of a processor and memory, each some and so much per byte of input."""

import resource
import sys
from dataclasses import dataclass

SECONDS, SECONDS_PER_BYTE = 2.0, 2e-5
"""Of a processor, with calls and lines traced."""
UNTRACED = 1 / 3
"""Part of these that reading may take without a trace, which makes it three to six times as long."""
BYTES_PER_BYTE = 4096
"""Of memory; deflate makes at most 1032 bytes of one, and a byte of grey becomes four of a texture."""
_ENDS_AT = 20
"""Seconds of a processor after which the system ends the process, so that loops without an end are found, too."""
_ROOM = 3 << 30
"""Bytes of addresses beyond those in use, beyond which the system refuses memory: the machine is not to be harmed."""


@dataclass(frozen=True, kw_only=True)
class Cost:
    """What was used: seconds of a processor, and the most memory that the process ever took, bytes."""

    seconds: float
    peak: int


def used() -> Cost:
    """Return what this process has used so far."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    scale = 1 if sys.platform == "darwin" else 1024
    return Cost(seconds=usage.ru_utime + usage.ru_stime, peak=usage.ru_maxrss * scale)


def limit_memory() -> None:
    """Let the system refuse this process memory far beyond what it has."""
    if sys.platform == "linux":  # elsewhere addresses cannot be counted, or not limited
        with open("/proc/self/statm", encoding="ascii") as file:
            size = int(file.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (size + _ROOM, resource.RLIM_INFINITY))


def limit_seconds() -> None:
    """Let the system end this process after so many more seconds of a processor."""
    soft = int(used().seconds) + _ENDS_AT
    resource.setrlimit(resource.RLIMIT_CPU, (soft, resource.RLIM_INFINITY))


def overdrawn(before: Cost, length: int, megabytes: int, part: float = 1.0) -> str | None:
    """Say by what reading an input took more than it may.

    Parameters
    ----------
    before
        What was used before the input was read.
    length
        Bytes of the input.
    megabytes
        Memory that reading may take besides what grows with the input.
    part
        Of the seconds, how many it may take, 0 to 1.

    Returns
    -------
    str | None
        "seconds" or "memory"; None where it kept within both.
    """
    after = used()
    if after.seconds - before.seconds > part * (SECONDS + SECONDS_PER_BYTE * length):
        return "seconds"
    if after.peak - before.peak > (megabytes << 20) + BYTES_PER_BYTE * length:
        return "memory"
    return None
