"""Read lists of positions, as other programs export them, for the `places` items of a scene."""

import csv
import re
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError, suggest
from depthwalk.ingest.npy import map_npy
from depthwalk.limits import MAX_COORDINATE, MAX_INSTANCES, MAX_PLACES_BYTES
from depthwalk.scene.fields import MAX_SCALE, MIN_SCALE
from depthwalk.scene.similarity import Similarity, from_angles, from_yaw

_COLUMNS = "x", "y", "z", "yaw", "scale", "pitch", "roll"  # metres, degrees; the first three are required
_LIMITS = {"x": (-MAX_COORDINATE, MAX_COORDINATE), "yaw": (-36000, 36000), "scale": (MIN_SCALE, MAX_SCALE)}
_LIMITS |= {"y": _LIMITS["x"], "z": _LIMITS["x"], "pitch": _LIMITS["yaw"], "roll": _LIMITS["yaw"]}


def read_places(path: Path) -> Similarity:
    """Read the transforms of the objects of a `places` item, in the frame of its node.

    Parameters
    ----------
    path
        The file: `.npy`, an array (n, 3 to 7) of x, y, z, yaw, scale, pitch and roll; or CSV text whose first line
        names those columns in any order, in small letters or capitals. Fields are separated by commas, semicolons or
        tabs, as by spreadsheets in countries that write commas in numbers. All columns after z are optional. Lengths
        are metres, angles degrees.

    Returns
    -------
    Similarity
        n transforms, float32, metres.

    Raises
    ------
    InputError
        `path:line: defect`, where arrays have a row counted from 0 instead of a line; also for more than MAX_INSTANCES
        rows.
    """
    if path.stat().st_size > MAX_PLACES_BYTES:
        raise InputError(f"{path}: too large: the limit is {MAX_PLACES_BYTES} bytes")
    names, values, first = _read_npy(path) if path.suffix.lower() == ".npy" else _read_text(path)
    for name, column in zip(names, values.T, strict=True):
        low, high = _LIMITS[name]
        fits = (column >= low) & (column <= high)  # False for NaN
        if not fits.all():
            row = int(np.argmin(fits))
            raise InputError(f"{path}:{row + first}: {name} is {column[row]:g}; it must be {low:g} to {high:g}")
    of = dict(zip(names, values.astype(np.float32).T, strict=True))
    zeros = np.zeros(len(values), np.float32)
    yaw, pitch, roll = (np.radians(of.get(name, zeros)) for name in ("yaw", "pitch", "roll"))
    return Similarity(
        np.stack([of["x"], of["y"], of["z"]], 1),
        from_angles(yaw, pitch, roll) if pitch.any() or roll.any() else from_yaw(yaw),
        of.get("scale", zeros + 1),
    )


def _read_npy(path: Path) -> tuple[tuple[str, ...], NDArray[np.float64], int]:
    """Return the columns' names, the values (n, columns), and the number that messages give the first row."""
    values = map_npy(path)
    if values.ndim != 2 or not 3 <= values.shape[1] <= len(_COLUMNS) or values.dtype.kind not in "fiu":
        raise InputError(
            f"{path}: must be numbers of shape (n, 3 to {len(_COLUMNS)}), not {values.dtype} of {values.shape}"
        )
    _check_count(path, len(values))
    return _COLUMNS[: values.shape[1]], np.array(values, np.float64), 0


def _read_text(path: Path) -> tuple[tuple[str, ...], NDArray[np.float64], int]:
    """Return the same as `_read_npy`, from a CSV file."""
    try:
        head, _, body = path.read_text("utf-8-sig").partition("\n")
    except (OSError, ValueError):
        raise InputError(f"{path}: cannot be read as UTF-8 text") from None
    separator = next((found for found in ";\t" if found in head), ",")
    names = tuple(name.strip() for name in next(csv.reader([head.lower()], delimiter=separator), []))
    rule = f": the first line must name the columns x, y, z, and may name {', '.join(_COLUMNS[3:])}, once each"
    for name in names:
        if name not in _COLUMNS:
            raise InputError(f"{path}:1: unknown column {name[:40]!r}{suggest(name, list(_COLUMNS)) or rule}")
    if len(set(names)) < len(names) or not set(_COLUMNS[:3]) <= set(names):
        raise InputError(f"{path}:1{rule}")
    lines = body.rstrip().splitlines()
    _check_count(path, len(lines))
    return names, _numbers(path, lines, len(names), separator), 2


def _numbers(path: Path, lines: list[str], columns: int, separator: str) -> NDArray[np.float64]:
    """Return the numbers (n, columns) in `lines`, the file's second line and all after it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # raised if there are no lines
        try:
            values = np.loadtxt(lines, delimiter=separator, comments=None, ndmin=2).reshape(-1, columns)
            if len(values) == len(lines):
                return values
        except (ValueError, OverflowError):
            pass
    for line, text in enumerate(lines, 2):
        fields = text.split(separator)
        if len(fields) != columns:
            raise InputError(
                f"{path}:{line}: has {len(fields) if text.strip() else 0} columns, the first line {columns}"
            )
        for field in fields:
            if not re.fullmatch(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*", field):
                raise InputError(f"{path}:{line}: {field.strip()[:40]!r} is not a number{_point_for(field)}")
    raise InputError(f"{path}: cannot be read as numbers")


def _point_for(field: str) -> str:
    """Return what to write instead, if a field is a number with a decimal comma; otherwise ""."""
    return f"; write {field.strip().replace(',', '.')}" if re.fullmatch(r"\s*[+-]?\d+,\d+\s*", field) else ""


def _check_count(path: Path, count: int) -> None:
    if count > MAX_INSTANCES:
        raise InputError(f"{path}: holds {count} places; the limit is {MAX_INSTANCES}")
