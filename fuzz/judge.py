"""Read one input and say what is wrong with how it was read: an exception, a message, a result, or the cost."""

import logging
import traceback
import warnings
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from depthwalk.errors import InputError
from fuzz.budget import overdrawn, used
from fuzz.case import Files, Target, write_files
from fuzz.line_trace import LineTrace


@dataclass(frozen=True, kw_only=True)
class Fault:
    """What is wrong with how an input was read.

    Attributes
    ----------
    kind
        Tells faults apart: the exception and the place in the package where it was raised, the defect of the message,
        or what was used too much of.
    detail
        What somebody needs who mends it.
    """

    kind: str
    detail: str


def judge(
    target: Target, files: Files, folder: Path, trace: LineTrace | None = None, part: float = 1.0
) -> Fault | None:
    """Read an input and judge how it was read.

    Parameters
    ----------
    target
        Whose reader it is given to.
    files
        The input.
    folder
        An empty folder, to which the files are written; nobody empties it.
    trace
        Notes which lines run; None: nothing does.
    part
        Of the seconds of its budget, how many reading may take, 0 to 1.

    Returns
    -------
    Fault | None
        What is wrong; None where the reader did what it should.
    """
    path = write_files(folder, files)
    length = sum(map(len, files.values()))
    before = used()
    fault = None
    try:
        with warnings.catch_warnings(record=True) as warned, trace.tracing() if trace else nullcontext():
            warnings.simplefilter("always")
            target.read(path)
        if unforeseen := [w for w in warned if issubclass(w.category, RuntimeWarning)]:  # numbers that have become none
            where = f"{Path(unforeseen[0].filename).name}:{unforeseen[0].lineno}"
            fault = Fault(kind=f"a warning in {where}", detail=str(unforeseen[0].message))
    except InputError as error:
        fault = _bad_message(str(error), folder)
    except Exception as error:
        fault = Fault(kind=f"{type(error).__name__} {_place(error)}", detail="".join(traceback.format_exception(error)))
    overdraft = overdrawn(before, length, target.megabytes, part)
    if fault is None and overdraft is not None:
        spent = used()
        detail = f"{spent.seconds - before.seconds:.1f} s, {(spent.peak - before.peak) >> 20} MiB for {length} bytes"
        fault = Fault(kind=f"too many {overdraft}" if overdraft == "seconds" else "too much memory", detail=detail)
    return fault


def _bad_message(message: str, folder: Path) -> Fault | None:
    """Return what is wrong with an error message: each of its lines names a file and can be printed."""
    for line in message.split("\n"):
        if not line.startswith((f"{folder}", "... and")):
            return Fault(kind="a message without a place", detail=repr(line))
        if not line.isprintable():
            return Fault(kind="a message that cannot be printed", detail=repr(line))
        if len(line) > 1000 + len(str(folder)):
            return Fault(kind="a message too long to be read", detail=repr(line[:200]))
    return None


def _place(error: BaseException) -> str:
    """Return file and function in which an exception left the package's code, or was raised by this folder's."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [
        frame for frame in frames if "depthwalk" in Path(frame.filename).parts or "fuzz" in Path(frame.filename).parts
    ]
    last = own[-1]
    what = f": {error}"[:80] if isinstance(error, AssertionError) else ""
    return f"in {Path(last.filename).name} {last.name}{what}"


def silence() -> None:
    """Let nobody log what readers warn of."""
    logging.disable(logging.CRITICAL)
