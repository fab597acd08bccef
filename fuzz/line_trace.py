"""Note which lines of some modules run, and in which order: an input that takes a new way is worth changing further."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

Step = tuple[str, int, int]
"""File, and two of its lines of which the second ran after the first; 0 before the first line of a function."""


def module_files(names: tuple[str, ...]) -> frozenset[str]:
    """Return the source files of modules, and of all modules of packages, by their names."""
    found: set[str] = set()
    for name in names:
        spec = find_spec(name)
        assert spec is not None and spec.origin is not None, name
        folders = spec.submodule_search_locations
        found |= {str(file) for folder in folders for file in Path(folder).glob("*.py")} if folders else {spec.origin}
    return frozenset(found)


class LineTrace:
    """Collects the steps that are taken in some files while its `with` block runs."""

    def __init__(self, files: frozenset[str]) -> None:
        self.files = files
        self.steps: set[Step] = set()

    @contextmanager
    def tracing(self) -> Iterator[None]:
        before = sys.gettrace()
        threading.settrace(self._called)
        sys.settrace(self._called)
        try:
            yield
        finally:
            sys.settrace(before)
            threading.settrace(before)

    def _called(self, frame: FrameType, event: str, argument: Any) -> Any:
        file = frame.f_code.co_filename
        if file not in self.files:
            return None
        steps, last = self.steps, 0

        def ran(frame: FrameType, event: str, argument: Any) -> Any:
            nonlocal last
            if event == "line":
                line = frame.f_lineno
                steps.add((file, last, line))
                last = line
            return ran

        return ran


def executable_lines(file: str) -> set[int]:
    """Return the numbers of the lines in functions of a source file that the interpreter reports when they run.

    What runs on import says nothing about an input: the lines of modules and of class bodies are left out.
    """
    lines: set[int] = set()
    pending = [compile(Path(file).read_bytes(), file, "exec")]
    while pending:
        code = pending.pop()
        pending += [constant for constant in code.co_consts if isinstance(constant, CodeType)]
        if code.co_flags & 0x2:  # has fast locals: a function, neither a module nor the body of a class
            lines |= {line for _, _, line in code.co_lines() if line and line != code.co_firstlineno}
            lines |= {code.co_firstlineno} & _one_liner(code)
    return lines


def _one_liner(code: CodeType) -> set[int]:
    """Return the line of a lambda or comprehension that stands on one line; of others nothing."""
    lines = {line for _, _, line in code.co_lines() if line}
    return lines if len(lines) == 1 else set()
