"""End the program without a traceback where Ctrl-C meets it before its command has begun.

That is while libraries are imported and options are read, for which there is nothing to clean up. From then on
`program.guarded` sees to it. This module imports next to nothing, so that it is ready before anything else is.
"""

import signal
import sys
from types import FrameType
from typing import NoReturn

INTERRUPTED = 130  # exit code of a program that Ctrl-C has ended, 128 + SIGINT, as shells have it


def leave_when_interrupted() -> None:
    """Let Ctrl-C end the program by one line and exit code 130, unless its signal is ignored or handled otherwise."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, leave)


def leave(number: int, frame: FrameType | None) -> NoReturn:
    """Raise SystemExit(130), as a handler of the signal SIGINT; SystemExit, since libraries pass it on unprinted."""
    signal.signal(number, signal.SIG_IGN)  # a second signal would print a traceback of what this one has begun
    print("depthwalk: interrupted", file=sys.stderr)
    raise SystemExit(INTERRUPTED)
