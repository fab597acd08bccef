"""Describe the origin of a measurement: the version of the program and the machine."""

import os
import platform
import subprocess
from dataclasses import dataclass
from pathlib import Path

import depthwalk


@dataclass(frozen=True, kw_only=True)
class Machine:
    """Describe the computer that this process runs on.

    Attributes
    ----------
    processor
        The name of its processor, as the maker or, failing that, the system calls it.
    cores
        Logical cores that this process may use.
    system
        The operating system and its version.
    python
        The version of Python.
    """

    processor: str
    cores: int
    system: str
    python: str


def machine() -> Machine:
    """Return a description of the machine that this process runs on."""
    affinity = getattr(os, "sched_getaffinity", None)  # missing on macOS and Windows
    return Machine(
        processor=_processor(),
        cores=len(affinity(0)) if affinity else os.cpu_count() or 1,
        system=f"{platform.system()} {platform.release()}",
        python=platform.python_version(),
    )


def _processor() -> str:
    """Return the name of the processor: on Linux from the kernel, since `platform` does not report it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return next(filter(None, names), "") or platform.processor() or platform.machine()


def commit() -> str | None:
    """Return the hash, in hex, of the git commit from which this package runs.

    Returns None if the package is installed, even inside the checkout of another project, or if git is missing.
    """
    package = Path(depthwalk.__file__).resolve().parent
    git = ["git", "-C", str(package)]
    try:
        # An installed package may lie inside another project's checkout: check that ours is tracked there.
        subprocess.run([*git, "ls-files", "--error-unmatch", "errors.py"], capture_output=True, check=True)
        return subprocess.run([*git, "rev-parse", "HEAD"], capture_output=True, check=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None
