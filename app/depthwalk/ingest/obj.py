"""OBJ text, checked and put into the form that trimesh reads without guessing.

trimesh wraps indices out of range, takes relative indices to count from the end of the file, drops texture
coordinates where faces are written in different ways, and reads only the first material library.
"""

import re
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError

LIBRARY = "all.mtl"  # what the prepared text calls its material libraries, joined into one

_NUMBER = rb"[-+.\deEnNaAiIfFtTyY]+"
_BAD_VERTEX = re.compile(rb"^v(?: |$)(?!%b %b %b(?: |$))" % ((_NUMBER,) * 3), re.MULTILINE)
_FACE = re.compile(rb"^f (.*)$", re.MULTILINE)
_CORNER = re.compile(rb"-?\d+(?:/(?:-?\d+)?(?:/(?:-?\d+)?)?)?")
_COLUMNS = {b"n": [0], b"n/": [0], b"n//": [0], b"n/n": [0, 1], b"n/n/": [0, 1], b"n//n": [0, 2], b"n/n/n": [0, 1, 2]}
_KINDS = ((b"v", "vertex"), (b"vt", "texture coordinate"), (b"vn", "normal"))


def prepare_obj(data: bytes, path: Path) -> bytes:
    """The same mesh with absolute indices and one style of face, its libraries renamed to LIBRARY.

    Raises InputError, `path:line: defect`, for damaged vertices and faces and for indices out of range.
    """
    data = b"\n" + _tidy(data)
    if bad := _BAD_VERTEX.search(data):
        raise _error(path, data, bad.start(), "a vertex needs three numbers")
    faces = [face.strip() for face in _FACE.findall(data)]
    if not faces:
        raise InputError(f"{path}: no faces")
    sizes = np.array([face.count(b" ") + 1 for face in faces])
    if sizes.min() < 3:
        raise _face_error(path, data, int(np.argmax(sizes < 3)), "a face needs at least three corners")
    try:
        corners, uniform = _corners(b" ".join(faces))
    except (ValueError, OverflowError):
        wrong = next((i for i, f in enumerate(faces) if not all(map(_CORNER.fullmatch, f.split(b" ")))), 0)
        shown = faces[wrong][:40].decode(errors="replace")
        raise _face_error(path, data, wrong, f"cannot read the face {shown!r}") from None
    relative = bool((corners < 0).any())
    absolute = _absolute(corners, sizes, data, path)
    if relative or not uniform:
        data = _rewritten(data, absolute, sizes)
    if b"\nmtllib " in data:
        data = b"\nmtllib " + LIBRARY.encode() + re.sub(rb"\nmtllib .*", b"\n", data)
    return data


def _tidy(data: bytes) -> bytes:
    """One blank between words, none at the ends of lines, no comments; lines keep their numbers."""
    data = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n").replace(b"\\\n", b" ")
    if b"#" in data:
        data = re.sub(rb"(?:^|(?<=\s))#.*", b"", data, flags=re.MULTILINE)
    data = re.sub(rb"[\t\x0b\x0c]", b" ", data)
    if b"  " in data:
        data = re.sub(rb" {2,}", b" ", data)
    return re.sub(rb"^ +| +$", b"", data, flags=re.MULTILINE) if b"\n " in data or b" \n" in data else data.strip(b" ")


def _corners(joined: bytes) -> tuple[NDArray[np.int64], bool]:
    """(C, 3) vertex, texture and normal index as written, 0 where absent; and whether all corners have one style."""
    styles = set(re.sub(rb"-?\d+", b"n", joined).split(b" ")) if b"/" in joined else {b"n"}
    if not styles <= _COLUMNS.keys():
        raise ValueError("not a face")
    if len(styles) == 1:
        columns = _COLUMNS[styles.pop()]
        corners = np.zeros((joined.count(b" ") + 1, 3), np.int64)
        corners[:, columns] = np.array(joined.replace(b"/", b" ").split()).astype(np.int64).reshape(-1, len(columns))
        return corners, True
    padded = [[part or b"0" for part in (corner + b"//").split(b"/")[:3]] for corner in joined.split(b" ")]
    return np.array(padded).astype(np.int64), False


def _absolute(corners: NDArray[np.int64], sizes: NDArray, data: bytes, path: Path) -> NDArray[np.int64]:
    """Corners with relative indices resolved; raises InputError for the first index out of range."""
    face_of = np.repeat(np.arange(len(sizes)), sizes)
    result = corners.copy()
    for column, (key, name) in enumerate(_KINDS):
        written, total = corners[:, column], data.count(b"\n" + key + b" ")
        if (written < 0).any():
            declared = np.array([m.start() for m in re.finditer(rb"^%b " % key, data, re.MULTILINE)])
            starts = np.array([m.start() for m in _FACE.finditer(data)])
            known = np.searchsorted(declared, starts)[face_of]
            result[:, column] = np.where(written < 0, written + known + 1, written)
        least = 1 if column == 0 else np.where(written < 0, 1, 0)
        wrong = (result[:, column] < least) | (result[:, column] > total)
        if wrong.any():
            at = int(np.argmax(wrong))
            raise _face_error(path, data, int(face_of[at]), f"face refers to {name} {written[at]} of {total}")
    return result


def _rewritten(data: bytes, corners: NDArray[np.int64], sizes: NDArray) -> bytes:
    """The text with every corner written alike; corners without texture coordinates get (0, 0)."""
    vertex, texture, normal = (column.astype("S") for column in (corners[:, 0], corners[:, 1] + 1, corners[:, 2]))
    words = vertex
    if corners[:, 1].any():
        data = b"\nvt 0 0" + data  # absent ones are index 0: moved up by one, they refer to this
        words = np.strings.add(np.strings.add(words, b"/"), texture)
    if corners[:, 2].all():
        words = np.strings.add(np.strings.add(words, b"/" if corners[:, 1].any() else b"//"), normal)
    lines = iter([b"f " + b" ".join(face.tolist()) for face in np.split(words, np.cumsum(sizes)[:-1])])
    return _FACE.sub(lambda _: next(lines), data)


def _face_error(path: Path, data: bytes, face: int, defect: str) -> InputError:
    return _error(path, data, next(islice(_FACE.finditer(data), face, None)).start(), defect)


def _error(path: Path, data: bytes, offset: int, defect: str) -> InputError:
    return InputError(f"{path}:{data.count(bytes([10]), 0, offset)}: {defect}")
