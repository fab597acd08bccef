"""Save changed values into a scene file, or into a copy of it, without touching anything else in its text.

The new text is checked before it is written: the program's own loader must read it, and find exactly those values
changed.
"""

import json
import os
import shutil
import stat
from collections.abc import Iterator, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

from depthwalk.errors import InputError
from depthwalk.files import reason, replacing
from depthwalk.scene.document import Document, decoded, label, parse_document, read_bytes
from depthwalk.scene.schema import SceneFile
from depthwalk.scene.validate import Source, check_model
from depthwalk.scene.yaml_edit import Place, with_values
from depthwalk.scene.yaml_text import float32_value

_MARK = b"\xef\xbb\xbf"  # byte order mark of UTF-8
_CHANGEABLE = {"environment", "camera", "walk", "render"}  # what of a scene can be saved
_WRITABLE = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH


def save_values(path: Path, values: Mapping[str, Any]) -> None:
    """Change values in a scene file.

    The file is replaced at once, and keeps its permissions; a link to it stays one.

    Parameters
    ----------
    path
        The scene file.
    values
        The values, in nested mappings like the file's, numbers as `float32_value` gives them.

    Raises
    ------
    InputError
        If the file cannot be read or written, is no scene, or cannot get exactly these values; it is then unchanged.
    """
    data = bytes_with_values(path, values)
    try:
        file = path.resolve()
        if not is_writable(file):
            raise InputError(f"{path}: is read-only")
        with replacing(file) as temporary:
            temporary.write_bytes(data)
            shutil.copymode(file, temporary)
    except OSError as error:
        raise InputError(f"{path}: {reason(error)}") from None


def is_writable(file: Path) -> bool:
    """Return whether a file exists and may be written to; one that nobody may write to is not, even for root."""
    try:
        return bool(file.stat().st_mode & _WRITABLE) and os.access(file, os.W_OK)
    except OSError:
        return False


def bytes_with_values(path: Path, values: Mapping[str, Any]) -> bytes:
    """Return what a scene file would hold with changed values.

    Parameters
    ----------
    path
        The scene file, which is read again: it may have changed since the scene was loaded.
    values
        As for `save_values`.

    Returns
    -------
    bytes
        The contents.

    Raises
    ------
    InputError
        As for `save_values`.
    """
    data = read_bytes(path)
    text, name = decoded(data, path), str(path)
    before = parse_document(text, name)
    original = deepcopy(before.value)
    file, source = check_model(before, SceneFile)  # changes the document: keys get their present names
    _check_groups(file, values, name)
    written = _as_written(values, (), source)
    new = with_values(text, name, written)
    try:
        after = parse_document(new, name)
    except InputError as error:
        raise InputError(f"{name}: its text cannot be edited: {error}") from None
    if json.dumps(_without(after.value, written)) != json.dumps(_without(original, written)):
        raise InputError(f"{name}: its text cannot be edited without changing something else")
    _check_values(file, _checked(after), values, name)
    return _MARK * data.startswith(_MARK) + new.encode()


def _checked(document: Document) -> SceneFile:
    """Return the scene that a new text says. Raises InputError."""
    try:
        return check_model(document, SceneFile)[0]
    except InputError as error:
        raise InputError("the file would not be valid any more:", *error.lines) from None


def _check_groups(file: SceneFile, values: Mapping[str, Any], name: str) -> None:
    """Raise InputError if the file lacks what is to be changed, such as the fog: it came from an option."""
    for place, _ in leaves(values):
        group: Any = file
        for depth, key in enumerate(place[:-1], 1):
            if (group := getattr(group, key)) is None:
                raise InputError(f"{name}: has no {label(place[:depth])}: an option gave it, or the file has changed")


def _check_values(before: SceneFile, after: SceneFile, values: Mapping[str, Any], name: str) -> None:
    """Raise InputError unless the scene has exactly these values, and the others near them are as before."""
    old, new = before.model_dump(include=_CHANGEABLE), after.model_dump(include=_CHANGEABLE)
    for place, value in leaves(values):
        one, other = old, new
        for key in place[:-1]:
            one, other = one[key], other[key]
        if not _is_equal(value, other[place[-1]]):
            raise InputError(f"{name}: its text cannot be edited so that {label(place)} changes")
        one[place[-1]] = other[place[-1]]
    if old != new:
        raise InputError(f"{name}: its text cannot be edited without changing something else")


def leaves(values: Mapping[str, Any], place: Place = ()) -> Iterator[tuple[Place, Any]]:
    """Yield the values in nested mappings, each with its keys from the root."""
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from leaves(value, (*place, key))
        else:
            yield (*place, key), value


def count_text(values: Mapping[str, Any]) -> str:
    """Return how many values there are in nested mappings, in words."""
    count = sum(1 for _ in leaves(values))
    return "1 value" if count == 1 else f"{count} values"


def _is_equal(written: Any, read: Any) -> bool:
    """Return whether a value is read as it was written, numbers within the precision of float32."""
    if isinstance(written, str) and isinstance(read, tuple):  # a colour
        parts = [int(written[start : start + 2], 16) / 255 for start in (1, 3, 5)]
        return _is_equal(parts, read)
    if isinstance(written, list):
        return isinstance(read, tuple) and len(written) == len(read) and all(map(_is_equal, written, read))
    if isinstance(written, float) and isinstance(read, float):
        return float32_value(written) == float32_value(read)
    return type(written) is type(read) and bool(written == read)


def _as_written(values: Mapping[str, Any], place: Place, source: Source) -> dict[str, Any]:
    """Return values under the keys that the file has for them, which may be former names."""
    written = {}
    for key, value in values.items():
        here = (*place, key)
        name = str(source.as_written(here)[-1])
        written[name] = _as_written(value, here, source) if isinstance(value, Mapping) else value
    return written


def _without(value: Any, values: Mapping[str, Any]) -> Any:
    """Return what a document holds besides some values, and besides mappings that hold nothing else."""
    if not isinstance(value, dict):
        return value
    kept = {}
    for key, child in value.items():
        if key not in values:
            kept[key] = child
        elif isinstance(inner := values[key], Mapping) and (rest := _without(child, inner)) not in ({}, None):
            kept[key] = rest
    return kept
