"""End a running command when Ctrl-C or SIGTERM asks for it, so that its `finally` clauses still run.

Until the command has begun, `interruption` handles Ctrl-C.
"""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

from depthwalk.commands.interruption import leave

_asked_to_end: list[int] = []  # signals that have asked the running command to end, in order


def end_if_interrupted() -> None:
    """End the command if Ctrl-C or SIGTERM has asked for it, but went unnoticed; otherwise do nothing.

    A signal raises an exception wherever the program is at that moment. Python drops exceptions that are raised in
    `__del__`, in callbacks of weak references, and in calls from C; libraries catch more than they should. Long-running
    commands call this between steps, so that they end one step later at worst.

    Raises
    ------
    KeyboardInterrupt
        After Ctrl-C.
    SystemExit
        After SIGTERM.
    """
    if _asked_to_end:
        _raise_for(_asked_to_end[0])


def _raise_for(number: int) -> NoReturn:
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    raise SystemExit(128 + number)


@contextmanager
def unwound_by_signals() -> Iterator[None]:
    """Let SIGTERM raise SystemExit within the block, so that `finally` clauses run; by default Python just ends.

    Ctrl-C raises KeyboardInterrupt as usual, unless it is ignored. Both are remembered for `end_if_interrupted`, so
    Python need not complain where it drops one of them.
    """
    if threading.current_thread() is not threading.main_thread():  # only the main thread may set handlers
        yield
        return
    _asked_to_end.clear()
    before = {signal.SIGTERM: signal.signal(signal.SIGTERM, _end_by_signal)}
    if signal.getsignal(signal.SIGINT) in (signal.default_int_handler, leave):
        before[signal.SIGINT] = signal.signal(signal.SIGINT, _end_by_signal)
    complain = sys.unraisablehook
    sys.unraisablehook = lambda dropped: None if _is_request_to_end(dropped.exc_value) else complain(dropped)
    try:
        yield
    except Exception:
        end_if_interrupted()  # for example if trimesh, during its import, turned the exception into another
        raise
    finally:
        sys.unraisablehook = complain
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)
        _asked_to_end.clear()


def _is_request_to_end(error: BaseException | None) -> bool:
    return bool(_asked_to_end) and isinstance(error, KeyboardInterrupt | SystemExit)


def _end_by_signal(number: int, frame: FrameType | None) -> NoReturn:
    _asked_to_end.append(number)
    if number == signal.SIGTERM:
        signal.signal(number, signal.SIG_IGN)  # a second signal would interrupt the clean-up
    _raise_for(number)
