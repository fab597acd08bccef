"""Do a task in a worker process of a cluster.

Dask imports this module in its workers, before the first task if they were started by `depthwalk`.
"""

import atexit
import signal
import threading
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import depthwalk
from depthwalk.errors import InputError
from depthwalk.files import work_for

_open = ExitStack()  # what tasks keep for later ones, such as a renderer with its GL context
_open_for: object = None
_value: Any = None
_alone = threading.RLock()


def call(version: str, run: str, function: Callable[..., object], *arguments: object) -> object:
    """Call a function of this package in a worker.

    Parameters
    ----------
    version
        The version of the caller's package; another one might produce different files.
    run
        The caller's run, eight hex digits, which becomes part of the names of unfinished files.
    function, arguments
        The function and its arguments.

    Returns
    -------
    object
        What `function` returns.

    Raises
    ------
    InputError
        If the worker has another version of the package.
    """
    if version != depthwalk.__version__:
        raise InputError(f"--cluster: a worker has depthwalk {depthwalk.__version__}, this is {version}")
    with _alone:  # even a worker with several threads has only one GL context
        work_for(run)
        return function(*arguments)


def keep(key: object, make: Callable[[ExitStack], Any]) -> Any:
    """Return what an earlier task of this process made for the same key, or make it.

    Only one thing is kept at a time: one made for another key is closed first.

    Parameters
    ----------
    key
        Identifies the thing.
    make
        Creates the thing, and registers its clean-up with the given stack.

    Returns
    -------
    Any
        The result of `make`.
    """
    global _open_for, _value
    with _alone:
        if _open_for != key:
            close()
            with ExitStack() as made:
                _value = make(made)
                _open.push(made.pop_all())
            _open_for = key
        return _value


def close() -> None:
    """Close what `keep` has kept, if anything."""
    global _open_for, _value
    with _alone:
        _open_for = _value = None
        _open.close()


def dask_setup(worker: object) -> None:
    """Prepare a worker of a local cluster; Dask calls this when it preloads the module.

    Ctrl-C in a terminal reaches the worker as well as the command, which decides what should end.
    """
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)


atexit.register(close)
