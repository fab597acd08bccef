"""Give every command the same behaviour: exit codes, one-line errors, logging on stderr, clean interruption.

Results go to stdout, everything else to stderr.
"""

import errno
import functools
import gc
import io
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NoReturn, TypeVar

import typer

from depthwalk.budget import CACHE_LIMIT, cache_limit, parse_size
from depthwalk.commands.exit_codes import BAD_INPUT, FAILURE, INTERRUPTED
from depthwalk.commands.log_output import configure_logging, from_here, warned
from depthwalk.commands.signals import end_if_interrupted, unwound_by_signals
from depthwalk.commands.usage import HELP_OPTIONS, OneLineCommand
from depthwalk.errors import InputError, printable

_OF_THE_DISK = errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS  # a traceback would explain nothing

Command = TypeVar("Command", bound=Callable[..., None])


def as_program(main: Callable[..., None], name: str | None = None) -> typer.Typer:
    """Return a program of one command, called `name`; None uses the name of the function `main`.

    The program calls `main`, whose annotations declare the arguments and options.
    """
    program = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    program.command(name, cls=OneLineCommand, context_settings=HELP_OPTIONS)(main)
    return program


def guarded(command: Command) -> Command:
    """Wrap the function `command` so that it ends with the codes of `exit_codes`.

    An InputError is printed as its bare message, without the lines that were warnings before. Any other exception is
    printed in one line, with a traceback only with --verbose. SIGTERM unwinds the command like Ctrl-C, so that
    half-written files are removed; long-running commands also call `end_if_interrupted`. The command's options
    `verbose` and `quiet` set up logging, and `cache_limit` bounds the cache.
    """

    @functools.wraps(command)
    def run(*args: Any, **options: Any) -> None:
        if not gc.isenabled():  # it was off while the command was imported
            with without_garbage_collection():
                pass
        _open_closed_streams()
        _escape_what_streams_lack()
        verbose = bool(options.get("verbose"))
        configure_logging(verbose, bool(options.get("quiet")))
        try:
            _limit_cache(options.get("cache_limit"))
            with unwound_by_signals():
                command(*args, **options)
                end_if_interrupted()
            sys.stdout.flush()  # a closed pipe is noticed here, not at exit
        except (typer.Exit, typer.BadParameter):
            raise
        except InputError as error:
            for line in error.lines:
                if line not in warned():
                    print(from_here(line), file=sys.stderr)
            raise typer.Exit(BAD_INPUT) from None
        except KeyboardInterrupt:
            raise typer.Exit(INTERRUPTED) from None
        except BrokenPipeError:
            _drop_stdout()
            raise typer.Exit(FAILURE) from None
        except Exception as error:
            _fail(error, verbose)

    return run  # type: ignore[return-value]  # `wraps` keeps the signature, which mypy cannot know


def _limit_cache(size: str | None) -> None:
    """Apply the option --cache-limit to this process and those that it starts.

    Raises InputError if the option or, without it, the environment variable is not a size.
    """
    if size is not None:
        parse_size(size, "--cache-limit")
        os.environ[CACHE_LIMIT] = size
    cache_limit()


@contextmanager
def without_garbage_collection() -> Iterator[None]:
    """Disable garbage collection in a `with` block that imports libraries and reads a scene.

    These objects live as long as the program. Searching them repeatedly while they grow takes a tenth of the time;
    afterwards they are never searched. An interrupt within the block takes effect at its end: libraries swallow
    exceptions that a signal raises during their import, and a window would open all the same.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()
    end_if_interrupted()


def _open_closed_streams() -> None:
    """Replace closed standard streams (`>&-`) by ones that discard their output.

    Otherwise the next opened file would get the stream's number, and receive the output.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 - open until the process ends


def _escape_what_streams_lack() -> None:
    r"""Have standard streams write `\xd7` for a `×` missing from their encoding, as in Windows' files or LC_ALL=C.

    By default Python fails there, with half of a table written.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _fail(error: Exception, verbose: bool) -> NoReturn:
    """Print an unexpected error and exit with code 1."""
    if verbose:
        import traceback

        traceback.print_exc()
    elif isinstance(error, OSError) and error.errno in _OF_THE_DISK:
        where = "depthwalk" if error.filename is None else str(error.filename)
        print(printable(f"{where}: {error.strerror}"), file=sys.stderr)
    else:
        lines = str(error).strip().splitlines()
        print(f"depthwalk: {type(error).__name__}: {printable(lines[0]) if lines else 'no message'}", file=sys.stderr)
        print("run with --verbose for the traceback", file=sys.stderr)
    raise typer.Exit(FAILURE) from None


def _drop_stdout() -> None:
    """Redirect stdout to nowhere: its reader is gone, and flushing it at exit would fail again."""
    with open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())
