"""End the program without a traceback if Ctrl-C arrives before its command has begun.

At that time libraries are imported and options are read, so there is nothing to clean up. Later, `program.guarded`
handles Ctrl-C. This module imports next to nothing, so that it is ready before anything else is.
"""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import NoReturn

from depthwalk.commands.exit_codes import INTERRUPTED

_INTERRUPTED = INTERRUPTED, 128 + signal.SIGTERM


def leave_when_interrupted() -> None:
    """Let Ctrl-C end the program with one line and exit code 130, unless its signal is ignored or handled otherwise."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, leave)


def leave(number: int, frame: FrameType | None) -> NoReturn:
    """Raise SystemExit(130), as a handler of SIGINT; SystemExit, since libraries pass it on without printing it."""
    signal.signal(number, signal.SIG_IGN)  # a second signal would print a traceback of the clean-up
    print("depthwalk: interrupted", file=sys.stderr)
    raise SystemExit(INTERRUPTED)


@contextmanager
def ended_by_its_signal() -> Iterator[None]:
    """Let the process die of SIGINT where the block ends with the exit code of Ctrl-C; Windows keeps the code.

    A shell's loop goes on with the next file after a command that returns 130, and ends only with one that dies of the
    signal, which the shell reports as 130 too. Python sends itself SIGINT, after its clean-up at exit, when a
    KeyboardInterrupt reaches the top. That clean-up waits for threads; those that compute what nobody needs any more,
    for minutes perhaps, are not waited for.
    """
    try:
        yield
    except SystemExit as end:
        if end.code in _INTERRUPTED and _is_at_work():
            _end_now(int(end.code))
        if end.code != INTERRUPTED or sys.platform == "win32":
            raise
        sys.excepthook = lambda *_: None  # which would print a traceback
        raise KeyboardInterrupt from None


def _is_at_work() -> bool:
    """Return whether threads compute for a command that has ended, without importing anything."""
    parallel = sys.modules.get("depthwalk.parallel")
    return parallel is not None and parallel.is_at_work()


def _end_now(code: int) -> NoReturn:
    """End the process with an exit code, or by SIGINT if the code stands for that; `finally` clauses have run."""
    for stream in sys.stdout, sys.stderr:
        with suppress(OSError, ValueError):  # closed, or its reader is gone
            stream.flush()
    if code == INTERRUPTED and sys.platform != "win32":
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
    os._exit(code)
