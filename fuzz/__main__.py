"""`python -m fuzz`: give the package's readers files that are broken on purpose, and say what they made of them."""

import argparse
import json
import math
import multiprocessing
import multiprocessing.connection
import os
import shutil
import signal
import sys
import tempfile
import time
from dataclasses import dataclass
from datetime import date
from multiprocessing.process import BaseProcess
from pathlib import Path

for _library in ("OPENBLAS", "OMP"):  # a process has one thread, as long as it is one of several
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")
os.environ["XDG_CACHE_HOME"] = "/nonexistent"  # each target that has a cache names its own

from fuzz.small_limits import lower_limits  # noqa: E402

lower_limits()

from fuzz.budget import limit_memory  # noqa: E402
from fuzz.case import Target  # noqa: E402
from fuzz.judge import silence  # noqa: E402
from fuzz.report import coverage_table, tally_table  # noqa: E402
from fuzz.session import Session, Tally  # noqa: E402
from fuzz.targets import TARGETS  # noqa: E402

_SHORTEST = 2.0  # seconds that are worth beginning a session for
_PATIENCE = 600.0  # seconds after its end at which a session is ended, which may be making a fault short


@dataclass(frozen=True, kw_only=True)
class Task:
    """One session: a target, the seed of its random numbers, and how many inputs it reads if time lasts."""

    target: Target
    seed: int
    most_inputs: float
    folder: Path


def main() -> int:
    """Fuzz, print what was done and found; returns 1 where something was found, else 0."""
    options = _options()
    started = time.monotonic()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # whoever ends it gets the report of what was done
    names = options.targets or [target.name for target in TARGETS]
    chosen = [target for target in TARGETS if target.name in names]
    for target in chosen:
        target.seeds()  # before processes part: what they cost is cached
    silence()
    work = Path(tempfile.mkdtemp(prefix="depthwalk-fuzz-"))
    try:
        tasks = [
            Task(target=target, seed=seed, most_inputs=options.inputs, folder=work / f"{target.name}-{seed}")
            for seed in options.seed or [0, date.today().toordinal()]
            for target in chosen
        ]
        faults, tallies = _run(tasks, started + options.seconds, options.jobs, options.findings)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    print(tally_table(tallies))
    print(coverage_table([tally for _, tally in tallies], ("depthwalk.ingest", "depthwalk.bake.file"), options.missed))
    for name, kind, detail, place in faults:
        print(f"\nFOUND by {name}: {kind}\n{detail.rstrip()}\n  the files: {place}")
    print(f"\n{len(faults)} found in {sum(tally.inputs for _, tally in tallies)} inputs")
    return 1 if faults else 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m fuzz", description=__doc__)
    names = ", ".join(target.name for target in TARGETS)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=f"what to fuzz, all by default: {names}")
    parser.add_argument("--seconds", type=float, default=60, help="how long to go on, in all (60)")
    parser.add_argument(
        "--inputs", type=float, default=math.inf, help="end each target's session after so many inputs (no end)"
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes at a time (one per processor)")
    parser.add_argument(
        "--seed", type=int, action="append", help="of the random numbers, may be repeated (0 and today's)"
    )
    parser.add_argument("--findings", type=Path, default=Path("out/fuzz"), help="folder for what is found (out/fuzz)")
    parser.add_argument("--missed", action="store_true", help="name the lines that no input reached")
    options = parser.parse_args()
    if unknown := set(options.targets) - {target.name for target in TARGETS}:
        parser.error(f"unknown target {sorted(unknown)[0]!r}; known: {names}")
    if not 0 < options.seconds < 1e7 or not 0 < options.jobs <= 256:
        parser.error("--seconds and --jobs must be positive, and jobs at most 256")
    if not options.inputs > 0:
        parser.error("--inputs must be positive")
    if options.findings.exists() and not options.findings.is_dir():
        parser.error(f"--findings {options.findings}: is a file")
    return options


Found = tuple[str, str, str, Path]


def _run(tasks: list[Task], end: float, jobs: int, findings: Path) -> tuple[list[Found], list[tuple[str, Tally]]]:
    """Run sessions, so many at a time, of equal length, and return what they found and did."""
    context = multiprocessing.get_context("fork")  # what is imported and baked once serves all
    waiting = list(tasks)
    running: dict[BaseProcess, tuple[Task, float]] = {}
    found: dict[tuple[str, str], Found] = {}
    tallies: list[tuple[str, Tally]] = []
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                task = waiting.pop(0)
                rounds = -(-(len(waiting) + 1) // jobs)
                until = time.monotonic() + max((end - time.monotonic()) / rounds, _SHORTEST)
                task.folder.mkdir(exist_ok=True)
                begun = context.Process(target=_session, args=(task, until))
                begun.start()
                running[begun] = task, until
            multiprocessing.connection.wait([process.sentinel for process in running], timeout=5)
            for process, (task, until) in list(running.items()):
                if process.is_alive():
                    if time.monotonic() < until + _PATIENCE:
                        continue
                    process.kill()  # waits for something that uses no processor
                    process.join()
                del running[process]
                if process.exitcode:
                    _note_end(task, process.exitcode)
                _collect(task, findings, found)
                tallies.append((task.target.name, _tally(task)))
    except KeyboardInterrupt:  # what was found until then is told
        for process, (task, _) in running.items():
            process.terminate()
            process.join()
            _collect(task, findings, found)
            tallies.append((task.target.name, _tally(task)))
    return list(found.values()), tallies


def _session(task: Task, until: float) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGXCPU, signal.SIG_DFL)
    errors = os.open(task.folder / "errors", os.O_CREAT | os.O_WRONLY | os.O_APPEND)
    for output in (1, 2):  # libraries print
        os.dup2(errors, output)
    limit_memory()
    Session(task.target, task.seed, task.folder).run(until, task.most_inputs / task.target.slowness)


def _note_end(task: Task, exitcode: int) -> None:
    """Note the input at which a process ended as a fault."""
    names = {-signal.SIGXCPU: "no end of it: seconds of a processor", -signal.SIGKILL: "no end of it: seconds"}
    kind = names.get(exitcode, f"the process ended: {exitcode}")
    errors = (task.folder / "errors").read_text(errors="replace")[-3000:]
    if not (task.folder / "input").exists():  # nothing was being read: it is the fuzzer's own fault
        raise RuntimeError(f"{task.folder.name}: {kind}\n{errors}")
    shutil.copytree(task.folder / "input", task.folder / "fault-end", dirs_exist_ok=True)
    first = (task.folder / "first").read_text()
    (task.folder / "fault-end.json").write_text(json.dumps({"kind": kind, "detail": errors, "first": first}))


def _collect(task: Task, findings: Path, found: dict[tuple[str, str], Found]) -> None:
    """Copy what a session found to the folder of findings, and note what no other found before."""
    for note in sorted(task.folder.glob("fault-*.json")):
        fault = json.loads(note.read_text())
        key = (task.target.name, fault["kind"])
        if key in found:
            continue
        place = findings / task.target.name / f"{fault['first']}-{len(found) + 1}"
        shutil.rmtree(place, ignore_errors=True)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(note.with_suffix(""), place)
        found[key] = (task.target.name, fault["kind"], fault["detail"], place)


def _tally(task: Task) -> Tally:
    try:
        return Tally(**json.loads((task.folder / "tally.json").read_text()))
    except FileNotFoundError:  # it ended before it noted anything
        return Tally()


if __name__ == "__main__":
    sys.exit(main())
