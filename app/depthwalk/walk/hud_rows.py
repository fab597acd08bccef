"""Format the rows of the HUD: the viewer's position, where the time goes, and what a frame consists of."""

import math
import textwrap
from collections.abc import Mapping

from depthwalk.render.pixel_shares import KINDS
from depthwalk.walk.orbit import distance
from depthwalk.walk.state import State

CAMERA_ROWS = "path", "recording"  # names of rows about what is played or recorded
_PASS_CHARACTERS = 18  # that fit into it
_SMALLEST_SHARE = 0.005  # of a frame's time, from which a pass gets its own row
_NONE = "\u2013"
_FAR = 1000.0  # metres, from which on they are whole
CASES = {"side": "side", "side_and_top": "side + top", "side_and_bottom": "side + bottom", "all": "all"}


def viewer_rows(state: State) -> list[tuple[str, str]]:
    """Return names and texts of the rows about the viewer's position and movement."""
    walker = state.walker
    x, y, z = walker.position
    rows = [
        ("mode", _mode(state)),
        ("position", f"{x:z.2f}  {y:z.2f}  {z:z.2f} m"),
        ("direction", f"yaw {math.degrees(walker.yaw):z.0f}\u00b0, pitch {math.degrees(walker.pitch):z.0f}\u00b0"),
    ]
    playback = state.playback
    if playback is not None:
        rows.append(("path", f"{'playing' if playback.playing else 'P plays it'}, {playback.time:.1f} s"))
    if state.recorder is not None:
        rows.append(("recording", f"{state.recorder.seconds:.1f} s, K saves it"))
    return rows


def _mode(state: State) -> str:
    if state.orbit is not None:
        away = distance(state.orbit.camera)
        return f"orbit, {away:,.0f} m" if away >= _FAR else f"orbit, {away:.3g} m"
    return f"{state.mode.name.lower()}, {state.walker.speed:.3g} m/s"


def pass_rows(milliseconds: Mapping[str, float]) -> list[tuple[str, str]]:
    """Return the names and times of a frame's passes as texts; the quickest passes are summed up as `others`.

    Parameters
    ----------
    milliseconds
        Time of each pass by name, milliseconds.

    Returns
    -------
    list[tuple[str, str]]
        A name, on several lines if passes share a program, and a text for each row.
    """
    smallest = _SMALLEST_SHARE * sum(milliseconds.values())
    rows = {name: spent for name, spent in milliseconds.items() if spent > smallest}
    if len(rows) < len(milliseconds):
        rows["others"] = sum(milliseconds.values()) - sum(rows.values())
    return [
        (textwrap.fill(name, _PASS_CHARACTERS, break_long_words=False), f"{spent:.2f}") for name, spent in rows.items()
    ]


def count_rows(counts: Mapping[str, float]) -> list[tuple[str, str]]:
    """Return names and texts of the rows about what was drawn in a frame.

    Parameters
    ----------
    counts
        The frame's numbers by name, as in `FrameDrawLists.counts`; once they are known, also those of
        `pixel_shares.shares`.

    Returns
    -------
    list[tuple[str, str]]
        A name and a text for each row.
    """
    kinds = [f"{name} {counts[name]:,}" for name in KINDS if counts.get(name)]
    pixels = [f"{kind} {counts[f'share_{kind}']:.0%}" for kind in KINDS if counts.get(f"share_{kind}")]
    cases = [f"{text} {counts[f'case_{name}']:,}" for name, text in CASES.items() if counts.get(f"case_{name}")]
    rows = [
        ("objects", f"{counts['objects']:,}"),
        ("made of", f"{counts['full_triangles']:,} triangles" if counts["full_triangles"] else _NONE),
        ("occluded", f"{counts['occluded']:,}"),
        ("drawn as", _lines(kinds)),
        ("pixels", _lines(pixels)),
        ("case", _lines(cases, 2)),
        ("Iter_step", _lines(_numbered(counts, "step_"))),
        ("LOD level", _lines(_numbered(counts, "level_"))),
    ]
    if counts["dpci"]:
        rows += [
            ("warped", f"{counts['warped']:,} of {counts['dpci']:,} impostors"),
            ("", f"{counts['warped_triangles']:,} triangles"),
            ("tile cache", f"{counts['atlas_used']:.0%} full, scale {counts['tile_resolution']:.0%}"),
        ]
    plural = "" if counts["assets"] == 1 else "s"
    rows.append(("on the GPU", f"{counts['assets']:,} asset{plural}, {counts['gpu_mb']:,.0f} MB"))
    return [(name, text) for name, text in rows if text != _NONE or name == "drawn as"]


def _numbered(counts: Mapping[str, float], prefix: str) -> list[str]:
    """Return `number: count` for the counts whose names are `prefix` and a number, in the order of the numbers."""
    found = {int(name.removeprefix(prefix)): count for name, count in counts.items() if name.startswith(prefix)}
    return [f"{number}: {found[number]:,}" for number in sorted(found)]


def _lines(parts: list[str], per_line: int = 3) -> str:
    """Return the parts in lines of `per_line`, or a dash if there are none."""
    lines = [", ".join(parts[k : k + per_line]) for k in range(0, len(parts), per_line)]
    return "\n".join(lines) or _NONE
