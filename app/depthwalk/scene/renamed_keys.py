"""Keep scene and path files working in which a key still has the name of an earlier version.

`RENAMED_KEYS` is the only thing to edit when a key gets a better name. A former name is accepted, with a warning that
tells the present one, until the next minor version; then its line goes. The JSON schema knows the present names only.
"""

from collections.abc import Callable, Iterator
from typing import Any

from depthwalk.scene.document import Loc

RENAMED_KEYS = {
    # Former place in the file, with * for any name or list index → the present name of its last part.
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
    """Return where a value stands today that formerly stood at `place`.

    Without a renamed key on the way, that is `place` itself.
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
        Where that part stands in the document.
    report : callable
        Called for every renamed key with its former place, its present place, and whether the mapping has a value under
        the present name as well. It may raise; where it does not, that other value is kept.
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
    """Yield the mappings within `value`, which stands at `place`, that a pattern leads to, with their places."""
    if not pattern:
        if isinstance(value, dict):
            yield value, place
        return
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, child in items:
        if pattern[0] in ("*", key):
            yield from _mappings(child, (*place, key), pattern[1:])
