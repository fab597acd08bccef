"""Have the process that workers are forked from make what they would all make again: a zygote, as Android calls it.

A worker that is lost is replaced by one that begins the same job from nothing. What it reads and decodes for that, the
process that it is forked from can have ready; the memory is shared until somebody writes to it. That process is told by
workers what the job is, through a socket that they inherit, and looks there only when it is about to fork: so it reads
once for each job, when the first worker of the job is replaced, and not at all where none is lost.

One thing is kept, that of the latest job. Functions that are called here may start no thread and make no GL context,
since neither survives a fork.
"""

import logging
import os
import pickle
import socket
from collections.abc import Callable, Hashable
from contextlib import suppress
from typing import Any

log = logging.getLogger(__name__)

_MOST_BYTES = 65536  # of a message; a longer one is not sent, and then the next worker reads for itself

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
    os.register_at_fork(before=_do_what_was_asked, after_in_child=_become_worker)


def ask(key: Hashable, make: Callable[..., object]) -> None:
    """Have the processes that are forked later inherit what a function makes; without a zygote do nothing.

    Parameters
    ----------
    key
        What the function is called with, and what `inherited` knows its result by; it can be pickled, is not None.
    make
        A function that the zygote can import. Where it raises, nothing is inherited.
    """
    if _outbox is None:
        return
    message = pickle.dumps((key, make))
    if len(message) <= _MOST_BYTES:
        with suppress(OSError):  # the zygote has ended, or has been told by many workers and not forked since
            _outbox.send(message)


def inherited(key: Hashable) -> Any:
    """Return what the process that this one was forked from has made for `key`; None where it has made nothing.

    It is handed over once, since whoever gets it may change it.
    """
    global _key, _value
    if _key != key:
        return None
    value, _key, _value = _value, None, None
    return value


def _do_what_was_asked() -> None:
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
        _key, _value = key, None  # never two at a time in memory, and what fails is not tried again
        _value = make(key)
    except Exception as error:  # told of by the worker, which does the same
        log.info("nothing is made ahead: %s: %s", type(error).__name__, error)


def _become_worker() -> None:
    """Leave the socket's other end to the zygote."""
    global _inbox
    if _inbox is not None:
        _inbox.close()
        _inbox = None
