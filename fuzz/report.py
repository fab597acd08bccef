"""Lay out what was done as tables of text."""

from collections.abc import Iterable
from pathlib import Path

from fuzz.line_trace import executable_lines, module_files
from fuzz.session import Tally


def tally_table(tallies: list[tuple[str, Tally]]) -> str:
    """Return, of each target, how many inputs were read, how many took a new way, and the seconds of a processor."""
    rows = ["target      inputs   new ways   CPU s   found"]
    for name in dict.fromkeys(name for name, _ in tallies):
        own = [tally for other, tally in tallies if other == name]
        inputs, kept, faults = (sum(n) for n in zip(*((t.inputs, t.kept, len(t.faults)) for t in own), strict=True))
        rows.append(f"{name:10}{inputs:8}{kept:11}{sum(tally.seconds for tally in own):8.0f}{faults:8}")
    return "\n".join(rows)


def coverage_table(tallies: Iterable[Tally], modules: tuple[str, ...], missed: bool) -> str:
    """Return which share of the lines in functions of modules ran, by file; with the lines that did not, if asked."""
    ran: dict[str, set[int]] = {}
    for tally in tallies:
        for file, numbers in tally.lines.items():
            ran.setdefault(file, set()).update(numbers)
    rows = []
    for module in modules:
        rows += ["", f"lines of {module} that were reached"]
        reached = total = 0
        for file in sorted(module_files((module,))):
            lines = executable_lines(file)
            hit = lines & ran.get(file, set())
            reached, total = reached + len(hit), total + len(lines)
            if lines:
                rows.append(_row(Path(file).name, len(hit), len(lines)))
            if missed and lines - hit:
                rows.append(f"    {', '.join(map(str, sorted(lines - hit)))}")
        rows.append(_row("in all", reached, total))
    return "\n".join(rows)


def _row(name: str, reached: int, total: int) -> str:
    return f"{name:24}{reached:5} of {total:5}{100 * reached / max(total, 1):7.1f} %"
