"""Tell which version of the program made something: reports of measurements name the commit."""

import subprocess
from pathlib import Path

import depthwalk


def commit() -> str | None:
    """Return the hash, in hex, of the git commit that is checked out where this package runs from.

    Returns None where the package is installed, even inside the checkout of another project, and where git is missing.
    """
    package = Path(depthwalk.__file__).resolve().parent
    git = ["git", "-C", str(package)]
    try:
        # An installed package may lie inside somebody else's checkout: ask whether ours is tracked where it is.
        subprocess.run([*git, "ls-files", "--error-unmatch", "errors.py"], capture_output=True, check=True)
        return subprocess.run([*git, "rev-parse", "HEAD"], capture_output=True, check=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None
