"""Radiance pictures: what is read, and what is said of files that cannot be."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from depthwalk.errors import InputError
from depthwalk.ingest import radiance_hdr
from depthwalk.ingest.radiance_hdr import read_radiance
from fuzz.seeds import radiance

LIGHT = np.random.default_rng(1).uniform(0, 9, (6, 12, 3)).astype(np.float32)
CODED = radiance(LIGHT)
HEAD = CODED.index(b"+X 12\n") + 6


def written(folder: Path, data: bytes) -> Path:
    (file := folder / "sky.hdr").write_bytes(data)
    return file


@pytest.mark.parametrize("coded", [True, False])
@given(
    light=arrays(np.float32, st.tuples(st.integers(1, 5), st.integers(1, 300), st.just(3)),
                 elements=st.sampled_from([0, 0.25, 1, 3, 40000, 1e-9]))
)  # fmt: skip
def test_what_was_written_is_read(tmp_path_factory: pytest.TempPathFactory, light: np.ndarray, coded: bool) -> None:
    """Each colour keeps eight bits of its brightest component."""
    found = read_radiance(written(tmp_path_factory.getbasetemp(), radiance(light, coded)))
    assert found.dtype == np.float32 and found.shape == light.shape
    assert (np.abs(found - light) <= light.max(-1, keepdims=True) / 128).all()


def test_exact_values_and_directions_of_rows(tmp_path: Path) -> None:
    light = np.array([[[1, 0.5, 0.25], [0, 0, 0]], [[256, 128, 64], [0.125, 0.125, 0.125]]], np.float32)
    data = radiance(light)
    assert (read_radiance(written(tmp_path, data)) == light).all()
    assert (read_radiance(written(tmp_path, data.replace(b"-Y", b"+Y"))) == light[::-1]).all()
    assert (read_radiance(written(tmp_path, data.replace(b"+X", b"-X"))) == light[:, ::-1]).all()
    head, pixels = data[: data.index(b"+X 2\n") + 5], data[data.index(b"+X 2\n") + 5 :]
    assert (read_radiance(written(tmp_path, head.replace(b"\n", b"\r\n") + pixels)) == light).all()


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"P6 2 2 255\n", "not a Radiance picture: it must begin with #?RADIANCE"),
        (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", "the header has no end within 65536 bytes"),
        (CODED.replace(b"rgbe", b"xyze"), "pixels must be 32-bit_rle_rgbe; XYZ colours are not supported"),
        (CODED.replace(b"-Y 6 +X 12", b"+X 12 -Y 6"), "after the header must come the size, as in -Y 1024 +X 2048"),
        (CODED.replace(b"-Y 6", b"-Y 0"), "image of 12 × 0 pixels; each side must be 1 to 16384"),
        (CODED.replace(b"+X 12", b"+X 20000"), "image of 20000 × 6 pixels; each side must be 1 to 16384"),
        (CODED.replace(b"-Y 6", b"-Y 16000"), "ends before its 16000 rows of 12 pixels do"),
        (CODED[:-9], "row 5 of 6: the file ends within it"),
        (CODED[: HEAD + 4] + b"\0" + CODED[HEAD + 5 :], "row 0 of 6: a run is empty"),
        (CODED[: HEAD + 4] + b"\xff" + CODED[HEAD + 5 :], "row 0 of 6: a run is longer than the row"),
        (
            radiance(LIGHT, coded=False)[:HEAD] + b"\1\1\1\5" * 72,
            "row 0 of 6: runs are coded as before 1991, or the row is damaged; save the picture again",
        ),
    ],
)
def test_damage_is_located(tmp_path: Path, data: bytes, message: str) -> None:
    with pytest.raises(InputError, match="^" + re.escape(f"{tmp_path / 'sky.hdr'}: {message}") + "$"):
        read_radiance(written(tmp_path, data))


@given(at=st.integers(0, len(CODED) - 1), new=st.binary(max_size=6))
def test_any_change_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, at: int, new: bytes) -> None:
    file = written(tmp_path_factory.getbasetemp(), CODED[:at] + new + CODED[at + len(new) :])
    try:
        assert read_radiance(file).shape[-1] == 3
    except InputError as error:
        assert str(error).startswith(f"{file}: ")


def test_memory_is_checked_before_it_is_allocated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(name: object, needed: int, content: str) -> None:
        raise InputError(f"{content}: {needed}")

    monkeypatch.setattr(radiance_hdr, "check_memory", refuse)
    with pytest.raises(InputError, match=f"an image of 12 × 6 pixels: {36 * 72}"):
        read_radiance(written(tmp_path, CODED))
