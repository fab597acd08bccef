"""Fuzz one target with one seed: change what took new ways, judge it, and make what is wrong short."""

import json
import math
import random
import shutil
import time
from dataclasses import dataclass, field
from pathlib import Path

from fuzz.budget import UNTRACED, limit_seconds, used
from fuzz.bytes_changes import bounded, change_bytes
from fuzz.case import Files, Target, write_files
from fuzz.judge import Fault, judge
from fuzz.line_trace import LineTrace, module_files
from fuzz.seeds import findings

_RECENT = 0.5  # of the inputs to be changed: one of the last that took a new way
_MOST_TRIALS = 300  # to make an input shorter


@dataclass(kw_only=True)
class Tally:
    """What a session has done.

    Attributes
    ----------
    inputs
        How many were read.
    kept
        How many took a new way.
    seconds
        Of a processor.
    lines
        The lines that ran, by file.
    faults
        What was wrong, by kind: what somebody needs who mends it.
    """

    inputs: int = 0
    kept: int = 0
    seconds: float = 0.0
    lines: dict[str, list[int]] = field(default_factory=dict)
    faults: dict[str, str] = field(default_factory=dict)


class Session:
    """Fuzzes one target; what it is reading lies in `folder/input`, should the process end."""

    def __init__(self, target: Target, seed: int, folder: Path) -> None:
        self.target = target
        self.rng = random.Random(f"{target.name} {seed}")
        self.folder = folder
        self.trace = LineTrace(module_files(target.modules))
        self.corpus: list[Files] = []
        self.tally = Tally()

    def run(self, until: float, most_inputs: float = math.inf) -> Tally:
        """Fuzz until a moment of `time.monotonic`, or until so many inputs were read."""
        started = used().seconds
        for files in self.target.seeds() + findings(self.target.name):
            self.attempt(files)
        while time.monotonic() < until and self.tally.inputs < most_inputs and self.corpus:
            self.attempt(self.changed())
            self.tally.seconds = used().seconds - started
            if self.tally.inputs % 256 == 0:
                self._save()
        self.tally.seconds = used().seconds - started
        self._save()
        return self.tally

    def _chosen(self) -> Files:
        if self.rng.random() < _RECENT:
            return self.corpus[-1 - self.rng.randrange(min(len(self.corpus), 20))]
        return self.rng.choice(self.corpus)

    def changed(self) -> Files:
        """Return an input with one to four changes of one of its files; now and then a file is taken from another."""
        rng, files = self.rng, dict(self._chosen())
        names = list(files)
        name = names[0] if rng.random() < 0.75 else rng.choice(names)
        ways = [change for end, known in self.target.changes.items() if name.endswith(end) for change in known]
        for _ in range(rng.choice((1, 1, 2, 4))):
            if ways and rng.random() < 0.75:
                try:
                    files[name] = bounded(rng.choice(ways)(files[name], rng))
                    continue
                except Exception:  # damaged so much that its structure cannot be changed: its bytes can
                    pass
            files[name] = bounded(change_bytes(files[name], rng, self.target.words))
        if rng.random() < 0.05:
            other = rng.choice(self.corpus)
            files |= {key: value for key, value in other.items() if key in files and rng.random() < 0.5}
        return files

    def attempt(self, files: Files) -> None:
        """Judge an input, and keep it to be changed further where it took a new way."""
        before = len(self.trace.steps)
        fault = self._judged(files)
        if _is_slow(fault):
            fault = self._judged(files, traced=False)
        self.tally.inputs += 1
        if fault is not None and fault.kind not in self.tally.faults:
            self._report(files, fault)
        if len(self.trace.steps) > before or not self.corpus:
            self.corpus.append(files)
            self.tally.kept += 1

    def _judged(self, files: Files, traced: bool = True) -> Fault | None:
        """Judge an input, with a trace of its lines; one that took too long is judged again without.

        The trace is called for each function that any library calls, and makes the time of one that is written in
        Python, such as that of YAML, six times as long: on a busy machine too long for a file that is read in 0.1 s.
        """
        folder = self.folder / "input"  # is there as long as it is read: should the process end, it was that
        folder.mkdir()
        (self.folder / "first").write_text(next(iter(files)))
        limit_seconds()
        try:
            return judge(self.target, files, folder, *((self.trace,) if traced else (None, UNTRACED)))
        finally:
            shutil.rmtree(folder)

    def _report(self, files: Files, fault: Fault) -> None:
        self.tally.faults[fault.kind] = fault.detail
        place = self.folder / f"fault-{len(self.tally.faults)}"
        for attempt in (files, shortened(files, lambda tried: self._same(tried, fault))):  # the first, should it end
            shutil.rmtree(place, ignore_errors=True)
            place.mkdir()
            write_files(place, attempt)
            (self.folder / f"{place.name}.json").write_text(
                json.dumps({"kind": fault.kind, "detail": fault.detail, "first": next(iter(files))})
            )

    def _same(self, files: Files, fault: Fault) -> bool:
        again = self._judged(files, traced=not _is_slow(fault))
        return again is not None and again.kind == fault.kind

    def _save(self) -> None:
        lines: dict[str, set[int]] = {}
        for file, _, line in self.trace.steps:
            lines.setdefault(file, set()).add(line)
        self.tally.lines = {file: sorted(numbers) for file, numbers in lines.items()}
        temporary = self.folder / "tally.json.part"
        temporary.write_text(json.dumps(vars(self.tally)))
        temporary.replace(self.folder / "tally.json")


def _is_slow(fault: Fault | None) -> bool:
    return fault is not None and fault.kind == "too many seconds"


def shortened(files: Files, still: object, most_trials: int = _MOST_TRIALS) -> Files:
    """Return an input as short as can be of which something still holds.

    Leaves out whole files, then ever shorter runs of lines and bytes (delta debugging, Zeller and Hildebrandt 2002).

    Parameters
    ----------
    files
        The input, of which it holds.
    still : function
        Whether it holds of the files it is given.
    most_trials
        How often it may be asked.
    """
    trials = 0

    def holds(tried: Files) -> bool:
        nonlocal trials
        trials += 1
        return trials <= most_trials and bool(still(tried))  # type: ignore[operator]

    first = next(iter(files))
    for name in list(files):
        if name != first and holds(tried := {key: value for key, value in files.items() if key != name}):
            files = tried
    for name in list(files):
        length = len(files[name]) // 2
        while length and trials < most_trials:
            at = 0
            while at < len(files[name]):
                data = files[name]
                if holds(tried := files | {name: data[:at] + data[at + length :]}):
                    files = tried
                else:
                    at += length
            length //= 2
    return files
