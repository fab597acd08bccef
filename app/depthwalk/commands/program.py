"""Give every command the same behaviour: exit codes, one-line errors, logging on stderr, clean interruption.

Results go to stdout, everything else to stderr.
"""

import functools
import gc
import io
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import typer

from depthwalk.budget import CACHE_LIMIT, cache_limit, parse_size
from depthwalk.commands.exit_codes import BAD_INPUT, INTERRUPTED
from depthwalk.commands.failures import tell_failure, tell_mistakes
from depthwalk.commands.log_output import configure_logging
from depthwalk.commands.signals import end_if_interrupted, unwound_by_signals
from depthwalk.commands.usage import HELP_OPTIONS, OneLineCommand
from depthwalk.errors import InputError

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
            sys.stdout.flush()  # a full disk or a closed pipe is noticed here, not at exit
        except (typer.Exit, typer.BadParameter):
            raise
        except InputError as error:
            tell_mistakes(error)
            raise typer.Exit(BAD_INPUT) from None
        except KeyboardInterrupt:
            raise typer.Exit(INTERRUPTED) from None
        except Exception as error:
            raise typer.Exit(tell_failure(error, verbose)) from None

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
