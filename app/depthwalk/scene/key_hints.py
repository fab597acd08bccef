"""Guess what an unknown key of a scene or path file was meant to be.

A hint is the end of an error message: `; did you mean 'bias'?`, or nothing.
"""

from collections.abc import Iterator
from functools import cache
from typing import Any

from pydantic import BaseModel

from depthwalk.errors import suggest
from depthwalk.scene.document import Loc
from depthwalk.scene.fields import KIND

MAX_KEYS_NAMED = 9  # most keys listed in the error about an unknown one
_ANGLES = "yaw", "pitch", "roll"
_OTHER_PROGRAMS = {  # Words that other programs use for one or several keys of scene or path files.
    "bank": ("roll",),
    "euler": _ANGLES,
    "eye": ("position",),
    "file": ("mesh",),
    "heading": ("yaw",),
    "lean": ("pitch", "roll"),
    "location": ("position",),
    "look_at": ("target",),
    "lookat": ("target",),
    "model": ("mesh",),
    "orientation": _ANGLES,
    "path": ("mesh",),
    "quaternion": _ANGLES,
    "rotate": _ANGLES,
    "rotation": _ANGLES,
    "rotation_euler": _ANGLES,
    "src": ("mesh",),
    "tilt": ("pitch", "roll"),
    "translate": ("position",),
    "translation": ("position",),
    "turn": _ANGLES,
    "url": ("mesh",),
}


@cache
def _schema_of(model: type[BaseModel]) -> dict[str, Any]:
    """Return the JSON schema of a model; making it takes longer than checking a scene."""
    return model.model_json_schema()


def meant_key(key: str, known: list[str]) -> str:
    """Return the hint for an unknown `key`: which of the keys `known` is most like it, or else all if they are few."""
    few = len(known) <= MAX_KEYS_NAMED
    return spelling_hint(key, known) or (f"; known here: {', '.join(map(repr, known))}" if known and few else "")


def place_hint(loc: Loc, model: type[BaseModel]) -> str:
    """Return the hint for an unknown setting at `loc` if one other place of `model` has a key of that very name."""
    if any(isinstance(part, int) for part in loc):
        return ""  # what belongs to one object of a list
    places = [place for place in _settings_of(model) if place[-1] == loc[-1]]
    return f"; did you mean {'.'.join(places[0])!r}?" if len(places) == 1 else ""


@cache
def _settings_of(model: type[BaseModel]) -> tuple[tuple[str, ...], ...]:
    """Return the locations of all keys of a model outside of lists."""
    schema = _schema_of(model)
    return tuple(_places(schema, schema, ()))


def _places(node: dict[str, Any], schema: dict[str, Any], place: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Yield the location of each key that the JSON schema has below `node`, which is at `place`, outside of lists."""
    for branch in _branches(node, schema):
        for key, child in branch.get("properties", {}).items():
            yield (*place, key)
            yield from _places(child, schema, (*place, key))


def spelling_hint(key: str, known: list[str]) -> str:
    """Return `; did you mean 'x'?` with the keys of `known` that other programs call `key`, or one that looks like it.

    If `key` is one of them and its value, as in `{mesh:spot.obj}`, the hint asks for the space between them.
    """
    if space := space_hint(key, known):
        return space
    here = [repr(meant) for meant in _OTHER_PROGRAMS.get(str(key).lower(), ()) if meant in known]
    return f"; did you mean {' or '.join(here)}?" if here else suggest(key, known)


def space_hint(text: object, known: list[str]) -> str:
    """Return `; a space is missing after 'x:'` if the `text` in place of a mapping begins with a key of `known` so."""
    key, colon, _ = str(text).partition(":")
    return f"; a space is missing after {key + colon!r}" if colon and key in known else ""


def known_keys(model: type[BaseModel], loc: Loc) -> list[str]:
    """Return the keys that `model` has at a location, those of every branch if it has several.

    Parameters
    ----------
    model
        The model of the whole file.
    loc
        Keys and list indices from the root, in which tags of pydantic's (see `fields.KIND`) select branches.
    """
    return [key for branch in _branches_at(model, loc) for key in branch.get("properties", {})]


def defaults_hint(value: object, model: type[BaseModel], loc: Loc) -> str:
    """Return `write {} for its defaults` if a mapping that needs no keys belongs at `loc`, where `value` stands.

    Where such a mapping can be enabled, the hint for true is to do that. If there are no defaults, returns "".
    """
    branches = [branch for branch in _branches_at(model, loc) if "properties" in branch]
    if not branches or any("required" in branch for branch in branches):
        return ""
    enabled = isinstance(value, bool) and any("enabled" in branch["properties"] for branch in branches)
    return f"write {f'{{enabled: {str(value).lower()}}}' if enabled else '{} for its defaults'}"


def _branches_at(model: type[BaseModel], loc: Loc) -> list[dict[str, Any]]:
    """Return what the JSON schema of `model` allows at the location `loc`, as in `known_keys`."""
    schema = _schema_of(model)
    branches = list(_branches(schema, schema))
    for part in loc:
        if str(part).startswith(KIND):
            branches = [branch for branch in branches if str(part).removeprefix(KIND) in branch.get("properties", {})]
            continue
        branches = [leaf for branch in branches for child in _child(branch, part) for leaf in _branches(child, schema)]
    return branches


def _branches(node: dict[str, Any], schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    if "$ref" in node:
        yield from _branches(schema["$defs"][node["$ref"].rsplit("/", 1)[1]], schema)
    for kind in ("anyOf", "oneOf", "allOf"):
        for branch in node.get(kind, ()):
            yield from _branches(branch, schema)
    yield node


def _child(node: dict[str, Any], part: str | int) -> Iterator[dict[str, Any]]:
    children = [node.get("items")] if isinstance(part, int) else [node.get("properties", {}).get(part)]
    if isinstance(part, str) and children == [None]:
        children = [node.get("additionalProperties")]
    yield from (child for child in children if isinstance(child, dict))
