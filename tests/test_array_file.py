"""Arrays in files: what is damaged is seen before it is used."""

import ast
import io
import shutil
import zipfile
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray

from depthwalk.array_file import read_arrays, write_arrays

ARRAYS = {"a": np.arange(12, dtype=np.float32).reshape(3, 4), "b.c": np.array("text"), "empty": np.zeros((0, 3))}


@pytest.fixture(scope="module")
def arrays_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("arrays") / "a.npz"
    write_arrays(path, ARRAYS)
    return path


@given(
    arrays(
        st.sampled_from(["f2", "f4", "f8", "i1", "i2", "i8", "u1", "u4", "?", "U1", "U7", ">f4", ">i2"]),
        array_shapes(min_dims=0, min_side=0, max_side=4),
    ),
    st.sampled_from("CF"),
)
def test_arrays_come_back(
    tmp_path_factory: pytest.TempPathFactory, values: NDArray[Any], order: Literal["C", "F"]
) -> None:
    """As NumPy reads the same file: shape, dtype, order, every bit; and they may be written into."""
    path = tmp_path_factory.getbasetemp() / "back.npz"
    write_arrays(path, {"a": np.asarray(values, order=order)}, compression=1)
    with np.load(path) as archive:
        expected = archive["a"]
    found = read_arrays(path)["a"]
    assert (found.dtype, found.shape, found.tobytes()) == (expected.dtype, expected.shape, expected.tobytes())
    assert found.flags.writeable and found.flags.f_contiguous == expected.flags.f_contiguous


def test_headers_are_not_parsed_as_python(arrays_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """CPython 3.11's parser counts its recursion for all threads together, and fails where two of them use it."""

    def fail(*_: object) -> None:
        raise SystemError("AST constructor recursion depth mismatch")

    monkeypatch.setattr(ast, "literal_eval", fail)
    monkeypatch.setattr(ast, "parse", fail)
    assert read_arrays(arrays_file).keys() == ARRAYS.keys()


@given(st.floats(0, 1, exclude_max=True), st.integers(0, 7))
def test_a_flipped_bit_is_seen_or_harmless(arrays_file: Path, place: float, bit: int) -> None:
    damaged = arrays_file.with_name("damaged.npz")
    shutil.copyfile(arrays_file, damaged)
    data = bytearray(damaged.read_bytes())
    data[int(place * len(data))] ^= 1 << bit
    damaged.write_bytes(data)
    try:
        found = read_arrays(damaged, ARRAYS)
    except ValueError:
        return
    for name, value in ARRAYS.items():
        np.testing.assert_array_equal(found[name], value)


@given(st.floats(0, 1, exclude_max=True))
def test_a_file_cut_short_is_seen(arrays_file: Path, place: float) -> None:
    short = arrays_file.with_name("short.npz")
    short.write_bytes(arrays_file.read_bytes()[: int(place * arrays_file.stat().st_size)])
    with pytest.raises(ValueError):
        read_arrays(short)


def test_an_array_larger_than_its_bytes_is_damage(tmp_path: Path) -> None:
    """A header that lies would make NumPy ask for a terabyte; its CRC-32 is right where somebody crafted it."""
    stream = io.BytesIO()
    header = {"descr": "<f4", "fortran_order": False, "shape": (1 << 20, 1 << 18)}
    np.lib.format.write_array_header_1_0(stream, header)
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("a.npy", stream.getvalue() + bytes(64))
    with pytest.raises(ValueError, match=r"^an array of shape \(1048576, 262144\) in 64 bytes$"):
        read_arrays(tmp_path / "a.npz")
