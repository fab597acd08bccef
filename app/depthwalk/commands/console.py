"""What every command does the same way: logging and progress on stderr, results on stdout, exit codes."""

import functools
import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, NoReturn, TypeVar

import typer
import typer.core

from depthwalk.errors import InputError

log = logging.getLogger("depthwalk")

FAILURE, BAD_INPUT, INTERRUPTED = 1, 2, 130

Report = Callable[[str, str], None]  # what is worked on, which stage of it
Command = TypeVar("Command", bound=Callable[..., None])

_UsageError: Any = typer.BadParameter.__base__  # of the click that this typer brings along


class OneLineGroup(typer.core.TyperGroup):
    """Commands that tell a mistake in their options, too, in one line with exit code 2."""

    def main(self, *args: Any, standalone_mode: bool = True, **extra: Any) -> Any:
        try:
            code = super().main(*args, standalone_mode=False, **extra)  # type: ignore[misc]  # never by place
        except _UsageError as error:
            if not standalone_mode:
                raise
            if type(error).__name__ == "NoArgsIsHelpError":  # for who said nothing
                error.show()
            else:
                command = error.ctx.command_path if error.ctx else "depthwalk"
                message = " ".join(error.format_message().split()).removesuffix(".")
                print(f"{command}: {message} ({command} --help tells more)", file=sys.stderr)
            code = BAD_INPUT
        if standalone_mode:
            sys.exit(code)
        return code


def guarded(command: Command) -> Command:
    """Gives a command the contract's exit codes: 2 and the bare message for an InputError, 130 for Ctrl-C, 1 for the
    rest, without a traceback unless --verbose asks for it. `verbose` and `quiet` of the command set up logging. SIGTERM
    unwinds the command as Ctrl-C does, and ends it with 143."""

    @functools.wraps(command)
    def run(*args: Any, **options: Any) -> None:
        _open_closed_streams()
        verbose = bool(options.get("verbose"))
        _configure_logging(verbose, bool(options.get("quiet")))
        try:
            with _unwound_by_sigterm():
                command(*args, **options)
            sys.stdout.flush()  # here, so that a reader that went away is noticed here
        except (typer.Exit, typer.BadParameter):
            raise
        except InputError as error:
            print(error, file=sys.stderr)
            raise typer.Exit(BAD_INPUT) from None
        except KeyboardInterrupt:
            raise typer.Exit(INTERRUPTED) from None
        except BrokenPipeError:
            _drop_stdout()
            raise typer.Exit(FAILURE) from None
        except Exception as error:
            _fail(error, verbose)

    return run  # type: ignore[return-value]


def show_progress() -> bool:
    """Whether live progress is wanted: stderr is a terminal and --quiet was not given."""
    return sys.stderr.isatty() and log.getEffectiveLevel() < logging.ERROR


def live_options() -> dict[str, Any]:
    """How rich's live displays are made here: on stderr, and gone when they are done."""
    from rich.console import Console

    # Results on stdout are printed above the display only where they share its terminal; else they go their own way.
    return {"console": Console(stderr=True), "transient": True, "redirect_stdout": sys.stdout.isatty()}


@contextmanager
def asset_progress() -> Iterator[Report]:
    """A line on stderr that says which asset is being read or baked, while there is something to wait for."""
    if not show_progress():
        yield lambda name, stage: log.info("%s: %s", name, stage)
        return
    from rich.console import Console
    from rich.markup import escape

    with Console(stderr=True).status("") as status:
        yield lambda name, stage: status.update(f"{escape(name)}: {stage}")


@contextmanager
def frame_progress(label: str, total: int) -> Iterator[Callable[[], None]]:
    """A bar on stderr over `total` frames; what it yields is called after each."""
    if total < 2 or not show_progress():
        yield lambda: None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with Progress(*columns, **live_options()) as progress:
        task = progress.add_task(label, total=total)
        yield lambda: progress.advance(task)


def _open_closed_streams() -> None:
    """Who starts a program with `>&-` wants no output: it vanishes, and not in the file that is opened next."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 - as long as the process


@contextmanager
def _unwound_by_sigterm() -> Iterator[None]:
    """SIGTERM raises SystemExit here, so that what is half written vanishes; Python by itself would just be gone."""
    if threading.current_thread() is not threading.main_thread():  # only that one may set handlers
        yield
        return
    before = signal.signal(signal.SIGTERM, _exit_by_signal)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before or signal.SIG_DFL)


def _exit_by_signal(number: int, frame: FrameType | None) -> NoReturn:
    signal.signal(number, signal.SIG_IGN)  # whoever asks again would interrupt the cleaning up
    raise SystemExit(128 + number)


class _Once(logging.Filter):
    """Lets each warning pass once: a mesh's files are looked for when it is hashed and again when it is read."""

    def __init__(self) -> None:
        super().__init__()
        self._seen: set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        message = record.getMessage()
        fresh = record.levelno != logging.WARNING or message not in self._seen
        self._seen.add(message)
        return fresh


def _configure_logging(verbose: bool, quiet: bool) -> None:
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(message)s"))
    handler.addFilter(_Once())
    log.handlers = [handler]
    log.propagate = False
    log.setLevel(logging.DEBUG if verbose else logging.ERROR if quiet else logging.WARNING)


def _fail(error: Exception, verbose: bool) -> NoReturn:
    if verbose:
        import traceback

        traceback.print_exc()
    else:
        lines = str(error).strip().splitlines()
        print(f"depthwalk: {type(error).__name__}: {lines[0] if lines else 'no message'}", file=sys.stderr)
        print("run with --verbose for the traceback", file=sys.stderr)
    raise typer.Exit(FAILURE) from None


def _drop_stdout() -> None:
    """Whoever read stdout is gone: let what is still buffered vanish instead of failing again at exit."""
    with open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())
