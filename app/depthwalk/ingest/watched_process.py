"""Let a library decode a file in a process that may take only as much memory and time as the file explains.

Some libraries in other languages take the sizes in a damaged file for what they are: they allocate gigabytes, work for
minutes in which no thread of Python could do anything about it, or end the process. A process of its own can be ended.
"""

import os
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from typing import IO, NamedTuple

READY = b"+"
"""What a module that is run here writes first, once the library that it needs is imported."""

_LENGTH = struct.Struct("<Q")  # before each message
_INTERVAL = 0.05  # s between two looks at the process, in which it allocates some 100 MB at most


class Answer(NamedTuple):
    """Hold what a process has written.

    Attributes
    ----------
    is_ready
        Whether the library that it needs is there.
    data
        Its standard output after READY, also where it was ended.
    excess
        What it took too much of, "memory" or "time"; "" if neither.
    """

    is_ready: bool
    data: bytes
    excess: str


def framed(messages: Iterable[bytes]) -> Iterator[bytes]:
    """Yield messages to or from a process, each with its length before it."""
    for message in messages:
        yield _LENGTH.pack(len(message))
        yield message


def answer_messages(answer: Callable[[bytes], bytes]) -> None:
    """Answer the messages on standard input, in a module that `run_watched` runs, once its library is imported.

    Parameters
    ----------
    answer
        Returns the answer to a message. If it raises anything, the answer is empty: libraries raise exceptions of their
        own, ValueError or MemoryError for damaged data.
    """
    source, target = sys.stdin.buffer, sys.stdout.buffer
    target.write(READY)
    while head := source.read(_LENGTH.size):
        message = source.read(_LENGTH.unpack(head)[0])
        try:
            found = answer(message)
        except Exception:
            found = b""
        target.writelines(framed([found]))
        target.flush()


def messages_in(answer: bytes) -> Iterator[memoryview]:
    """Yield the whole messages in what a process has written, which may end anywhere."""
    left = memoryview(answer)
    while len(left) >= _LENGTH.size:
        (length,) = _LENGTH.unpack(left[: _LENGTH.size])
        if len(left) < _LENGTH.size + length:
            return
        yield left[_LENGTH.size : _LENGTH.size + length]
        left = left[_LENGTH.size + length :]


def run_watched(module: str, request: Iterable[bytes], *, most_bytes: int, most_seconds: float) -> Answer:
    """Run a module of this package in a process, and end it when it takes too much.

    Parameters
    ----------
    module
        The module's name, as for `python -m`. It writes READY to standard output, reads standard input and writes its
        answer. What it writes to standard error is not shown.
    request
        What it reads, in pieces.
    most_bytes
        Memory that it may take, and length of what it may write, bytes.
    most_seconds
        Processor time that it may take.

    Returns
    -------
    Answer
        What it has written, up to `most_bytes`.
    """
    # Files, not pipes, so that what it writes takes no memory here before it is known how much it is.
    with tempfile.TemporaryFile() as source, tempfile.TemporaryFile() as answer:
        source.writelines(request)
        source.seek(0)
        paths = os.pathsep.join(path for path in sys.path if path)
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", module],  # -P: nothing is imported from the current folder
            env=os.environ | {"PYTHONPATH": paths},
            stdin=source,
            stdout=answer,
            stderr=subprocess.DEVNULL,
        )
        try:
            excess = _watch(process, answer, most_bytes, most_seconds)
        finally:
            process.kill()
            process.wait()
        answer.seek(0)
        is_ready = answer.read(len(READY)) == READY
        return Answer(is_ready, answer.read(most_bytes), excess)


def _watch(process: "subprocess.Popen[bytes]", answer: IO[bytes], most_bytes: int, most_seconds: float) -> str:
    """Wait until a process ends or has taken too much; return `Answer.excess`."""
    while True:
        try:
            process.wait(_INTERVAL)
            return ""
        except subprocess.TimeoutExpired:
            too_long = os.fstat(answer.fileno()).st_size > most_bytes
            if excess := "memory" if too_long else _excess(process.pid, most_bytes, most_seconds):
                return excess


def _excess(number: int, most_bytes: int, most_seconds: float) -> str:
    """Return which a process with this number has taken too much of; "" if neither or if it has ended."""
    import psutil  # takes 20 ms to import

    try:
        process = psutil.Process(number)
        # On Windows, an environment's python starts another, which does the work.
        every = [process, *(process.children(recursive=True) if sys.platform == "win32" else [])]
        if sum(each.memory_info().rss for each in every) > most_bytes:
            return "memory"
        return "time" if sum(sum(each.cpu_times()[:2]) for each in every) > most_seconds else ""
    except psutil.Error:
        return ""
