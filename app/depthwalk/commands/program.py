"""Give every command the same behaviour: exit codes, one-line errors, logging on stderr, clean interruption.

Results go to stdout, everything else to stderr. Exit codes: 0 done, 1 failed, 2 wrong input, 130 Ctrl-C, 143 SIGTERM.
"""

import functools
import gc
import io
import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import PurePath
from types import FrameType
from typing import Any, NoReturn, TypeVar

import typer
import typer.core

from depthwalk.budget import CACHE_LIMIT, cache_limit, parse_size
from depthwalk.commands.interruption import INTERRUPTED, leave
from depthwalk.errors import InputError, printable

log = logging.getLogger("depthwalk")

FAILURE, BAD_INPUT = 1, 2

HELP_OPTIONS = {"help_option_names": ["-h", "--help"]}

Command = TypeVar("Command", bound=Callable[..., None])

# Names of options in other programs, and their names here; suggested if the command has the latter.
_SIZE = "--resolution", "--dpci-resolution"
_ELSEWHERE = {
    "--size": _SIZE, "--width": _SIZE, "--height": _SIZE, "--fov": ("--camera-view-angle",),
    "--position": ("--camera-position",), "--target": ("--camera-target",), "--silent": ("--quiet",),
    "--transparent": ("--no-background",),
}  # fmt: skip

UsageError: Any = typer.BadParameter.__base__  # of the click that this typer brings along


class _OneLineErrors:
    """Mix-in: report a mistake in the options in one line, with exit code 2, as `guarded` reports wrong input."""

    def main(self, *args: Any, standalone_mode: bool = True, **extra: Any) -> Any:
        """Run the command line; see `click.Command.main`."""
        try:
            code = super().main(*args, standalone_mode=False, **extra)  # type: ignore[misc]  # of the class it is mixed into
        except InputError as error:  # about a file that the arguments name
            if not standalone_mode:
                raise
            print(error, file=sys.stderr)
            code = BAD_INPUT
        except UsageError as error:
            if not standalone_mode:
                raise
            if type(error).__name__ == "NoArgsIsHelpError":  # called without any argument
                error.show()
            else:
                command = error.ctx.command_path if error.ctx else "depthwalk"
                _name_as_here(error)
                message = " ".join(error.format_message().split()).removesuffix(".").replace("Value error, ", "")
                print(f"{command}: {message} ({command} --help tells more)", file=sys.stderr)
            code = BAD_INPUT
        if standalone_mode:
            sys.exit(code)
        return code


def _name_as_here(error: Any) -> None:
    """Complete the error about an unknown option by its name here, if it is known from other programs."""
    if error.ctx and (meant := _ELSEWHERE.get(getattr(error, "option_name", ""))):
        own = [name for param in error.ctx.command.params for name in param.opts]
        error.possibilities = [name for name in meant if name in own] or error.possibilities


class OneLineGroup(_OneLineErrors, typer.core.TyperGroup):
    """Group commands, and report a mistake in their options in one line."""


class OneLineCommand(_OneLineErrors, typer.core.TyperCommand):
    """Run a command, and report a mistake in its options in one line.

    Its help calls arguments by their names: `SCENE`, where typer would write `{SCENE}` and `SCENE <path>`.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> Any:
        """Parse the arguments; report mistakes under the name of this command instead of the whole program's."""
        try:
            return super().parse_args(ctx, args)
        except UsageError as error:
            error.ctx = error.ctx or ctx
            raise

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the parts of the line "Usage:" after the command's name."""
        return [piece.replace("{", "").replace("}", "") for piece in super().collect_usage_pieces(ctx)]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the sections of `--help` that list arguments and options."""
        records: dict[str, list[tuple[str, str]]] = {"Arguments": [], "Options": []}
        for param in self.get_params(ctx):
            if record := param.get_help_record(ctx):
                is_argument = param.param_type_name == "argument"
                name = record[0].partition(" <")[0] if is_argument else record[0]
                records["Arguments" if is_argument else "Options"].append((name, record[1]))
        for title, rows in records.items():
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


def as_program(main: Callable[..., None], name: str | None = None) -> typer.Typer:
    """Return a program of one command, called `name`; None uses the name of the function `main`.

    The program calls `main`, whose annotations declare the arguments and options.
    """
    program = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    program.command(name, cls=OneLineCommand, context_settings=HELP_OPTIONS)(main)
    return program


def guarded(command: Command) -> Command:
    """Wrap the function `command` so that it ends with the exit codes that this module documents.

    An InputError is printed as its bare message, without the lines that were warnings before. Any other exception is
    printed in one line, with a traceback only with --verbose. SIGTERM unwinds the command like Ctrl-C, so that
    half-written files are removed; long-running commands also call `end_if_interrupted`. The command's options
    `verbose` and `quiet` set up logging, and `cache_limit` bounds the cache.
    """

    @functools.wraps(command)
    def run(*args: Any, **options: Any) -> None:
        if not gc.isenabled():  # it was off while the command was imported
            with without_garbage():
                pass
        _open_closed_streams()
        _escape_what_streams_lack()
        verbose = bool(options.get("verbose"))
        _configure_logging(verbose, bool(options.get("quiet")))
        try:
            _limit_cache(options.get("cache_limit"))
            with _unwound_by_signals():
                command(*args, **options)
            sys.stdout.flush()  # a closed pipe is noticed here, not at exit
        except (typer.Exit, typer.BadParameter):
            raise
        except InputError as error:
            for line in error.lines:
                if line not in _warned():
                    print(line, file=sys.stderr)
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
def without_garbage() -> Iterator[None]:
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
def _unwound_by_signals() -> Iterator[None]:
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


class _PlainFormatter(logging.Formatter):
    """Format records without characters from file names that could control a terminal, see `printable`."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the text of `record`."""
        if isinstance(record.args, tuple):
            escaped = (printable(arg) if isinstance(arg, str | PurePath) else arg for arg in record.args)
            record = logging.makeLogRecord(vars(record) | {"args": tuple(escaped)})
        return super().format(record)


class _OnceFilter(logging.Filter):
    """Let each warning pass once: a mesh's files are looked up when it is hashed and again when it is read.

    Attributes
    ----------
    seen
        The warnings so far.
    """

    def __init__(self) -> None:
        super().__init__()
        self.seen: set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether to print `record`."""
        message = record.getMessage()
        is_new = record.levelno != logging.WARNING or message not in self.seen
        self.seen.add(message)
        return is_new


def _warned() -> set[str]:
    """Return the warnings on stderr so far: what is first noticed in the background may then end the command."""
    filters = [one for handler in log.handlers for one in handler.filters]
    return set().union(*(one.seen for one in filters if isinstance(one, _OnceFilter)))


def _configure_logging(verbose: bool, quiet: bool) -> None:
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_PlainFormatter("%(message)s"))
    handler.addFilter(_OnceFilter())
    log.handlers = [handler]
    log.propagate = False
    log.setLevel(logging.DEBUG if verbose else logging.ERROR if quiet else logging.WARNING)


def _fail(error: Exception, verbose: bool) -> NoReturn:
    """Print an unexpected error and exit with code 1."""
    if verbose:
        import traceback

        traceback.print_exc()
    else:
        lines = str(error).strip().splitlines()
        print(f"depthwalk: {type(error).__name__}: {printable(lines[0]) if lines else 'no message'}", file=sys.stderr)
        print("run with --verbose for the traceback", file=sys.stderr)
    raise typer.Exit(FAILURE) from None


def _drop_stdout() -> None:
    """Redirect stdout to nowhere: its reader is gone, and flushing it at exit would fail again."""
    with open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())
