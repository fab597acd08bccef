"""End the program without a traceback if Ctrl-C arrives before its command has begun.

At that time libraries are imported and options are read, so there is nothing to clean up. Later, `program.guarded`
handles Ctrl-C. This module imports next to nothing, so that it is ready before anything else is.
"""

import signal
import sys
from types import FrameType
from typing import NoReturn

from depthwalk.commands.exit_codes import INTERRUPTED


def leave_when_interrupted() -> None:
    """Let Ctrl-C end the program with one line and exit code 130, unless its signal is ignored or handled otherwise."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, leave)


def leave(number: int, frame: FrameType | None) -> NoReturn:
    """Raise SystemExit(130), as a handler of SIGINT; SystemExit, since libraries pass it on without printing it."""
    signal.signal(number, signal.SIG_IGN)  # a second signal would print a traceback of the clean-up
    print("depthwalk: interrupted", file=sys.stderr)
    raise SystemExit(INTERRUPTED)
