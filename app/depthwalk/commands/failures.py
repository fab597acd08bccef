"""Print why a command fails, in one line each, and work with standard streams that cannot be written."""

import errno
import os
import sys
from typing import TextIO

from depthwalk.commands.exit_codes import FAILURE
from depthwalk.commands.log_output import from_here, warned
from depthwalk.errors import InputError, printable

_OF_THE_DISK = errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS  # a traceback would explain nothing


def tell(line: str) -> None:
    """Print a line on stderr, if that can be written."""
    try:
        print(line, file=sys.stderr, flush=True)
    except OSError:
        _discard(sys.stderr)


def tell_mistakes(error: InputError) -> None:
    """Print the mistakes in the user's input, without lines that were printed as warnings before."""
    for line in error.lines:
        if line not in warned():
            tell(from_here(line))


def tell_failure(error: Exception, verbose: bool = False) -> int:
    """Print an unexpected error, and return the exit code.

    A reader of stdout that is gone, as after `| head -1`, is no error to anybody: nothing is printed.

    Parameters
    ----------
    error
        The exception, while it is being handled.
    verbose
        Whether to print its traceback.

    Returns
    -------
    int
        FAILURE.
    """
    drop_unwritable_stdout()
    if isinstance(error, BrokenPipeError):
        return FAILURE
    if verbose:
        import traceback

        tell(traceback.format_exc().rstrip())
    elif isinstance(error, OSError) and error.errno in _OF_THE_DISK:
        where = "depthwalk" if error.filename is None else str(error.filename)
        tell(from_here(printable(f"{where}: {error.strerror}")))
    else:
        lines = str(error).strip().splitlines()
        tell(f"depthwalk: {type(error).__name__}: {from_here(printable(lines[0])) if lines else 'no message'}")
        tell("run with --verbose for the traceback")
    return FAILURE


def drop_unwritable_stdout() -> None:
    """Discard what stdout still holds if it cannot be written: Python would complain about it again at exit."""
    try:
        sys.stdout.flush()
    except OSError:
        _discard(sys.stdout)


def _discard(stream: TextIO) -> None:
    """Redirect a stream to nowhere."""
    with open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), stream.fileno())
