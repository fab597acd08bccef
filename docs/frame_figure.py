"""Draw the figure of a frame as SVG, from the declarations of passes and targets, for docs/generate.py.

All coordinates are pixels, x to the right and y down.
"""

from itertools import groupby
from typing import Any

from depthwalk.render.frame import Pass
from depthwalk.render.passes import PASSES
from depthwalk.render.target_table import TARGETS

_LEFT, _TOP, _COLUMN, _ROW = 350, 120, 52, 26  # of the figure, pixels
_READ, _WRITTEN, _INK, _FAINT = "#2563a8", "#c0392b", "#222", "#999"


def frame_figure() -> str:
    """Return the figure of a frame as SVG: a row for each pass, a column for each target, marks where they meet."""
    width, height = _LEFT + _COLUMN * len(TARGETS) + 60, _TOP + _ROW * len(PASSES) + 50
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif"'
        f' font-size="13"><rect width="{width}" height="{height}" fill="white"/>'
    ]
    rows = list(enumerate(PASSES))
    for runs, group in groupby(rows, lambda row: _runs(row[1])):
        members = [row for row, _ in group]
        parts.append(_bracket(runs, members[0], members[-1]))
    for row, pass_ in rows:
        y = _TOP + _ROW * row + _ROW / 2
        parts.append(f'<line x1="{_LEFT - 20}" y1="{y}" x2="{width - 50}" y2="{y}" stroke="#eee"/>')
        parts.append(f'<text x="{_LEFT - 26}" y="{y + 4}" text-anchor="end" fill="{_INK}">{pass_.name}</text>')
    for column, name in enumerate(TARGETS):
        parts += _target_column(_LEFT + _COLUMN * column + _COLUMN / 2, name)
    y = height - 18
    parts += [
        f'{_mark(_LEFT, y, True)}<text x="{_LEFT + 12}" y="{y + 4}">writes</text>',
        f'{_mark(_LEFT + 80, y, False)}<text x="{_LEFT + 92}" y="{y + 4}">reads, or tests against a depth</text>',
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def _runs(pass_: type[Pass[Any]]) -> str:
    """Return how often a pass runs in a frame."""
    return "for each occlusion phase" if pass_.draws_objects else "for each sample" if pass_.per_sample else "once"


def _bracket(label: str, first: int, last: int) -> str:
    """Return a bracket on the left of the rows from `first` to `last`."""
    low, high = _TOP + _ROW * first + 4, _TOP + _ROW * (last + 1) - 4
    middle = (low + high) / 2
    return (
        f'<path d="M188 {low}h-6V{high}h6" fill="none" stroke="{_FAINT}"/>'
        f'<text x="178" y="{middle + 4}" text-anchor="end" fill="{_FAINT}">{label}</text>'
    )


def _target_column(x: float, name: str) -> list[str]:
    """Return the name of a target, a line for as long as it is needed, and its marks."""
    parts = [f'<text transform="translate({x + 4} {_TOP - 8}) rotate(-50)" fill="{_INK}">{name}</text>']
    users = [row for row, pass_ in enumerate(PASSES) if name in (*pass_.reads, *pass_.writes)]
    low, high = (_TOP + _ROW * row + _ROW / 2 for row in (users[0], users[-1]))
    parts.append(f'<line x1="{x}" y1="{low}" x2="{x}" y2="{high}" stroke="{_FAINT}" stroke-width="2"/>')
    for row in users:
        y = _TOP + _ROW * row + _ROW / 2
        if name in PASSES[row].writes:
            parts.append(_mark(x, y, True))
        if name in PASSES[row].reads:
            parts.append(_mark(x, y, False))
    return parts


def _mark(x: float, y: float, written: bool) -> str:
    """Return a square where a target is written, a smaller disc where it is read; both fit into each other."""
    if written:
        return f'<rect x="{x - 7}" y="{y - 7}" width="14" height="14" rx="2" fill="{_WRITTEN}"/>'
    return f'<circle cx="{x}" cy="{y}" r="4.5" fill="{_READ}" stroke="white"/>'
