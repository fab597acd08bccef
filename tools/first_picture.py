"""Measure when a window shows its first picture: `python -m tools.first_picture MODEL` prints rows for docs/vitals.md.

Whole processes are measured: `depthwalk view MODEL` and `depthwalk demo` until their window shows the first frame, and
`depthwalk render` of the garden to its end; each with an empty cache (cold) and with a full one (warm). With `--against
DIR` measurements alternate with another checkout, so that ratios hold even if other programs run. Besides wall-clock
time, this counts the processor time of all threads in seconds, which depends less on other load. Windows need a
display, which may be that of Xvfb. Bytecode should be compiled in both checkouts, as in an installed program: `python
-m compileall app`.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from itertools import product
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

ROOT = Path(__file__).resolve().parents[1]

# Ends the process after the first frame of the walk, and prints what it has cost until then.
_UNTIL_FIRST_FRAME = """
import importlib, os, resource, time
from depthwalk.commands.cli import main

def hook(name, *rest, original=importlib.import_module, **options):
    module = original(name, *rest, **options)
    if name == "depthwalk.walk.app" and not hasattr(module, "measured"):
        module.measured, step = True, module.Walk.step
        def first(self):
            step(self)
            used = resource.getrusage(resource.RUSAGE_SELF)
            print("FIRST", time.time(), used.ru_utime + used.ru_stime, flush=True)
            (self.background if hasattr(self, "background") else self.beside).close()  # as earlier checkouts call it
            os._exit(0)
        module.Walk.step = first
    return module

importlib.import_module = hook  # before `depthwalk.walk` takes it
main()
"""


class Cost(NamedTuple):
    """Hold the cost of the first picture, seconds: wall-clock and processor time."""

    wall: float
    cpu: float


def first_picture(checkout: Path, cache: Path, arguments: list[str]) -> Cost:
    """Run a command of `depthwalk` until its first picture.

    Parameters
    ----------
    checkout
        Folder of the checkout whose program is run.
    cache
        Folder of the cache that the program uses.
    arguments
        The command, `view`, `demo` or `render`, and its options.

    Returns
    -------
    Cost
        Seconds from the start of the process; for `render`, until its end.

    Raises
    ------
    CalledProcessError
        If the command fails.
    RuntimeError
        If it showed no picture.
    """
    environment = os.environ | {"PYTHONPATH": str(checkout / "app"), "XDG_CACHE_HOME": str(cache)}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    how = ["-m", "depthwalk"] if arguments[0] == "render" else ["-c", _UNTIL_FIRST_FRAME]
    before, begin = os.times(), time.time()
    done = subprocess.run(
        [sys.executable, *how, *arguments], env=environment, cwd=checkout, check=True, capture_output=True, text=True
    )
    if arguments[0] == "render":
        after = os.times()
        used = after.children_user + after.children_system - before.children_user - before.children_system
        return Cost(time.time() - begin, used)
    for line in done.stdout.splitlines():
        if line.startswith("FIRST "):
            shown, used = map(float, line.split()[1:])
            return Cost(shown - begin, used)
    raise RuntimeError(f"no picture was shown: {done.stderr[-500:]}")


def main(
    model: Annotated[Path, typer.Argument(help="Mesh without depth images, as polygons.")],
    against: Annotated[Path | None, typer.Option(help="Another checkout, measured in turn.")] = None,
    rounds: Annotated[int, typer.Option(help="How often each is measured.")] = 7,
) -> None:
    """Print medians for each command and cache, of this checkout and of the other, and of the ratios between them."""
    commands = [["view", str(model.resolve())], ["demo"], ["render", "scenes/garden.yaml", "-o"]]
    checkouts = [ROOT, *([against.resolve()] if against else [])]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for command, cold in product(commands, (True, False)):
            arguments = [*command, str(folder / "p.png")] if command[0] == "render" else command
            costs: dict[Path, list[Cost]] = {checkout: [] for checkout in checkouts}
            for number, checkout in product(range(rounds), checkouts):
                cache = folder / f"{command[0]}-{checkouts.index(checkout)}-{number if cold else 'warm'}{cold}"
                if not cold and not number:
                    first_picture(checkout, cache, arguments)  # fills the cache
                costs[checkout].append(first_picture(checkout, cache, arguments))
            for checkout, found in costs.items():
                wall, cpu = (statistics.median(column) for column in zip(*found, strict=True))
                state = "cold" if cold else "warm"
                print(f"{command[0]} {state} | {checkout.name} | {wall:.2f} s | {cpu:.2f} s of processor time")
            if against:
                pairs = list(zip(*costs.values(), strict=True))
                ratios = [statistics.median(ours[k] / its[k] for ours, its in pairs) for k in (0, 1)]
                print(f"    ratios: {ratios[0]:.2f} × on the clock, {ratios[1]:.2f} × of processor time")


if __name__ == "__main__":
    typer.run(main)
