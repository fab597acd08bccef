"""Let the process from which workers are forked compute what all of them would: a zygote, as Android calls it.

A worker that is lost is replaced by one that begins the same job from nothing. The process from which it is forked can
have the files for that read and decoded; the memory is shared until it is written to. Workers tell that process about
the job through a socket that they inherit. It reads the socket only when it is about to fork, so it loads once per job,
when the first worker of the job is replaced, and not at all if none is lost.

Only the latest job's data is kept. Functions called here must not start threads or create a GL context, since neither
survives a fork.
"""

import logging
import os
import pickle
import socket
from collections.abc import Callable, Hashable
from contextlib import suppress
from typing import Any

log = logging.getLogger(__name__)

_MOST_BYTES = 65536  # of a message; a longer one is not sent, and the next worker loads the data itself

_inbox: socket.socket | None = None  # of the zygote
_outbox: socket.socket | None = None  # of its workers
_key: Hashable = None
_value: Any = None


def serve() -> None:
    """Make this process one whose children may `ask`; it must be without threads, now and later."""
    global _inbox, _outbox
    _inbox, _outbox = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    _inbox.setblocking(False)
    _outbox.setblocking(False)  # a worker does not wait for a zygote that does not read
    os.register_at_fork(before=_make_requested, after_in_child=_become_worker)


def ask(key: Hashable, make: Callable[..., object]) -> None:
    """Let processes that are forked later inherit the result of a function; without a zygote, do nothing.

    Parameters
    ----------
    key
        Argument of the function, and the key of its result for `inherited`; it must be picklable and not None.
    make
        A function that the zygote can import. If it raises, nothing is inherited.
    """
    if _outbox is None:
        return
    message = pickle.dumps((key, make))
    if len(message) <= _MOST_BYTES:
        with suppress(OSError):  # the zygote has ended, or its socket is full because it has not forked for long
            _outbox.send(message)


def inherited(key: Hashable) -> Any:
    """Return what the process from which this one was forked made for `key`; None if it made nothing.

    It is returned only once, since the caller may change it.
    """
    global _key, _value
    if _key != key:
        return None
    value, _key, _value = _value, None, None
    return value


def _make_requested() -> None:
    """Make what workers have asked for last; called in the zygote, and in its workers, before they fork."""
    global _key, _value
    if _inbox is None:
        return
    asked: bytes | None = None
    with suppress(BlockingIOError):
        while True:
            asked = _inbox.recv(_MOST_BYTES)
    if asked is None:
        return
    try:
        key, make = pickle.loads(asked)
        if key == _key:
            return
        _key, _value = key, None  # free the old value first; a failed attempt is not repeated
        _value = make(key)
    except Exception as error:  # reported by the worker, which does the same
        log.info("nothing is made ahead: %s: %s", type(error).__name__, error)


def _become_worker() -> None:
    """Leave the socket's other end to the zygote."""
    global _inbox
    if _inbox is not None:
        _inbox.close()
        _inbox = None
