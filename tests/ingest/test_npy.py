"""NPY files that are none: one line that names the file, whatever is wrong."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from depthwalk.errors import InputError
from depthwalk.ingest.depth_file import read_depth
from depthwalk.ingest.npy import map_npy
from depthwalk.scene.places import read_places
from depthwalk.types import Array

VALUES = np.arange(1, 13, dtype=np.float32).reshape(4, 3)


def npy_bytes(values: Array) -> bytes:
    stream = io.BytesIO()
    np.save(stream, values)
    return stream.getvalue()


def with_header(text: str) -> bytes:
    """An NPY file of version 1 with this header."""
    header = text.encode("latin-1").ljust(118)
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + bytes(48)


def archive() -> bytes:
    stream = io.BytesIO()
    np.savez(stream, a=VALUES)
    return stream.getvalue()


BAD = {
    "archive": archive(),
    "empty archive": b"PK\x05\x06" + bytes(18),
    "token": with_header("{'descr': '<f4', 'shape': (4, 3"),
    "string": with_header('{\'descr\': """'),
    "nothing": b"",
    "no header": b"\x93NUMPY\x01\x00",
    "pickle": b"\x80\x04N.",
    "no dict": with_header("[1, 2]"),
    "deep": with_header("(" * 100),
    "null": with_header("\0"),
    "huge": with_header("{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999, 3), }"),
    "negative": with_header("{'descr': '<f4', 'fortran_order': False, 'shape': (-4, 3), }"),
}


@pytest.mark.parametrize(
    "read", [map_npy, read_places, lambda f: read_depth(f, depth_range=None, unit=None, camera=True)]
)
@pytest.mark.parametrize("data", BAD.values(), ids=BAD.keys())
def test_what_is_no_npy_is_one_line(tmp_path: Path, read: Callable[..., Any], data: bytes) -> None:
    file = tmp_path / "a.npy"
    file.write_bytes(data)
    with pytest.raises(InputError) as error:
        read(file)
    assert str(error.value) == f"{file}: cannot be read as an NPY array"


def test_an_array_is_mapped(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", VALUES)
    np.testing.assert_array_equal(map_npy(tmp_path / "a.npy"), VALUES)
    with pytest.raises(InputError, match="no such file"):
        map_npy(tmp_path / "b.npy")


def test_objects_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array([{}, None]), allow_pickle=True)
    with pytest.raises(InputError, match="cannot be read"):
        map_npy(tmp_path / "a.npy")


@given(st.integers(0, 127), st.binary(min_size=1, max_size=4))
@example(61, b"\n(")
def test_a_damaged_header_is_one_line_or_an_array(
    tmp_path_factory: pytest.TempPathFactory, at: int, patch: bytes
) -> None:
    data = npy_bytes(VALUES)
    file = tmp_path_factory.getbasetemp() / "damaged.npy"
    file.write_bytes(data[:at] + patch + data[at + len(patch) :])
    try:
        assert isinstance(map_npy(file), np.ndarray)
    except InputError as error:
        assert str(error).startswith(f"{file}: ") and "\n" not in str(error)
