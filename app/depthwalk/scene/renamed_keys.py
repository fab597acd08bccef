"""Keep scene and path files working that still use the name a key had in an earlier version.

To rename a key, edit `RENAMED_KEYS` only. The former name is accepted until the next minor version, with a warning that
gives the present one; then its line is removed. The JSON schema lists only present names.
"""

from collections.abc import Callable, Iterator
from typing import Any

from depthwalk.scene.document import Loc

RENAMED_KEYS = {
    # Former location in the file, with * for any name or list index → the present name of its last part.
    # Renamed after 0.1, to be dropped after 0.2.
    "environment.ground.size": "half_size",
    "render.composite.parallax": "parallax_steps",
    "render.dof.largest": "max_blur",
    "render.fxaa.contrast": "edge_threshold",
    "render.gpaa.crease": "crease_angle",
    "render.output.tone": "tone_mapping",
    "render.smaa.contrast": "edge_threshold",
    "render.smaa.longest": "max_search_distance",
    "render.warp.budget": "triangle_budget",
    "render.warp.tiles": "tile_mapping",
}

Report = Callable[[Loc, Loc, bool], None]


def present_place(place: Loc) -> Loc:
    """Return the present location of a value that was formerly at `place`.

    If no key on the way was renamed, that is `place` itself.
    """
    for former, name in _renamed():
        if _matches(former, place[: len(former)]):
            place = (*place[: len(former) - 1], name, *place[len(former) :])
    return place


def rename_keys(value: Any, place: Loc, report: Report) -> None:
    """Give all keys of a document, or of a part of it, their present names, in place.

    Parameters
    ----------
    value : dict, list or scalar
        The part of the document.
    place : tuple of str and int
        Location of that part in the document.
    report : callable
        Called for every renamed key with its former location, its present location, and whether the mapping has a value
        under the present name as well. It may raise; if it does not, that other value is kept.
    """
    for former, name in _renamed():
        if len(place) < len(former) and _matches(former[: len(place)], place):
            for mapping, at in _mappings(value, place, former[len(place) : -1]):
                if former[-1] in mapping:
                    renamed = mapping.pop(former[-1])
                    report((*at, former[-1]), (*at, name), name in mapping)
                    mapping.setdefault(name, renamed)


def _renamed() -> Iterator[tuple[tuple[str, ...], str]]:
    return ((tuple(former.split(".")), name) for former, name in RENAMED_KEYS.items())


def _matches(pattern: tuple[str, ...], place: Loc) -> bool:
    return len(pattern) == len(place) and all(part in ("*", found) for part, found in zip(pattern, place, strict=True))


def _mappings(value: Any, place: Loc, pattern: tuple[str, ...]) -> Iterator[tuple[dict[str, Any], Loc]]:
    """Yield the mappings within `value`, which is at `place`, that match a pattern, with their locations."""
    if not pattern:
        if isinstance(value, dict):
            yield value, place
        return
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, child in items:
        if pattern[0] in ("*", key):
            yield from _mappings(child, (*place, key), pattern[1:])
