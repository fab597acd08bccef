"""Laser scans in LAS and LAZ files."""

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from depthwalk.errors import InputError
from depthwalk.ingest import watched_process
from depthwalk.ingest.las import decoder
from depthwalk.ingest.las.decoder import read_las
from depthwalk.ingest.loader import load_mesh, measure_mesh
from las_files import OFFSET, write_las

COUNT = 600
_TURN = np.pi * (1 + np.sqrt(5)) * np.arange(COUNT)
_Z = 1 - (2 * np.arange(COUNT) + 1) / COUNT
BALL = np.column_stack([np.sqrt(1 - _Z * _Z) * np.cos(_TURN), np.sqrt(1 - _Z * _Z) * np.sin(_TURN), _Z]) * (1, 2, 3)
SIXTEEN = np.column_stack([np.full(COUNT, 51_400), np.full(COUNT, 257), np.arange(COUNT) * 100])
FILES = [("ball.las", "1.2"), ("ball.las", "1.4"), ("ball.laz", "1.2"), ("ball.laz", "1.4")]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "version"), FILES)
def test_points_stand_upright_with_their_colours(tmp_path: Path, name: str, version: str) -> None:
    path = write_las(tmp_path / name, BALL, SIXTEEN, version=version)
    cloud = read_las(path.read_bytes(), path)
    x, y, z = (BALL + OFFSET).T
    np.testing.assert_allclose(cloud.positions, np.column_stack([x, z, -y]), atol=1e-4)
    np.testing.assert_array_equal(cloud.colours, SIXTEEN // 256)
    assert np.isnan(cloud.normals).all()


@pytest.mark.slow
def test_a_scan_is_a_surface_at_the_origin(tmp_path: Path) -> None:
    mesh = load_mesh(write_las(tmp_path / "ball.laz", BALL))
    assert len(mesh.faces) > 1.8 * COUNT
    np.testing.assert_allclose(mesh.bounds, [[-1, 0, -2], [1, 6, 2]], atol=0.02)
    extent = measure_mesh(tmp_path / "ball.laz")
    assert extent.is_bakeable and extent.low[1] == pytest.approx(OFFSET[2] - 3, abs=0.02)


@pytest.mark.slow
def test_colours_of_eight_bits_are_taken_as_they_are_and_black_for_none(tmp_path: Path) -> None:
    path = write_las(tmp_path / "small.las", BALL, SIXTEEN // 257)
    np.testing.assert_array_equal(read_las(path.read_bytes(), path).colours, SIXTEEN // 257)
    path = write_las(tmp_path / "black.las", BALL, 0 * SIXTEEN)
    assert read_las(path.read_bytes(), path).colours is None


@pytest.mark.slow
def test_noise_and_what_is_withheld_is_left_out(tmp_path: Path) -> None:
    kinds = np.full(COUNT, 2)
    kinds[:5], kinds[5:9] = 7, 18
    path = write_las(tmp_path / "a.las", BALL, classification=kinds, withheld=np.arange(COUNT) >= COUNT - 3)
    assert len(read_las(path.read_bytes(), path).positions) == COUNT - 12


def test_without_the_library_it_is_told_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_las(tmp_path / "a.las", BALL)
    monkeypatch.setattr(decoder, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r'a\.las: `pip install -e "\S+\[las\]"` installs'):
        load_mesh(path)


def changed(data: bytes, at: int, form: str, value: int) -> bytes:
    size = struct.calcsize(form)
    return data[:at] + struct.pack(form, value) + data[at + size :]


def test_headers_that_cannot_be_right_are_told_before_anything_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(decoder, "run_watched", lambda *_, **__: pytest.fail("a process was started"))
    data = write_las(path := tmp_path / "a.las", BALL).read_bytes()
    for damaged, defect in (
        (b"PK" + data, "not a LAS file"),
        (data[:200], "truncated in its header"),
        (changed(data, 96, "<I", len(data) + 1), "does not fit"),
        (changed(data, 100, "<I", 0xFFFFFFFF), "does not fit"),
        (changed(data, 247, "<Q", 1 << 60), "at most"),
    ):
        with pytest.raises(InputError, match=rf"^{path}: .*{defect}"):
            read_las(damaged, path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_truncated_files_are_told(tmp_path: Path, name: str) -> None:
    data = write_las(path := tmp_path / name, BALL, SIXTEEN).read_bytes()
    with pytest.raises(InputError, match="damaged, truncated or an unsupported kind of LAS"):
        read_las(data[: len(data) // 2], path)


@pytest.mark.slow
def test_a_file_that_takes_too_much_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = write_las(path := tmp_path / "a.las", BALL).read_bytes()
    for name, value, excess in (("_BYTES", 1 << 20, "memory"), ("_SECONDS", 0.0, "time")):
        with monkeypatch.context() as patch:
            patch.setattr(decoder, name, value)
            patch.setattr(watched_process, "_INTERVAL", 0.005)
            with pytest.raises(InputError, match=f"it takes too much {excess} to read"):
                read_las(data, path)


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(at=st.integers(227, 2500), value=st.binary(min_size=1, max_size=8), length=st.integers(230, 4000))
def test_damaged_data_is_read_or_told(
    tmp_path_factory: pytest.TempPathFactory, at: int, value: bytes, length: int
) -> None:
    """Whatever it does to the process that reads it: one such file has it allocate 47 GB."""
    path = tmp_path_factory.mktemp("las") / "a.laz"
    data = write_las(path, BALL, SIXTEEN).read_bytes()
    damaged = (data[:at] + value + data[at + len(value) :])[:length]
    try:
        assert len(read_las(damaged, path).positions) == COUNT
    except InputError as error:
        assert str(error).startswith(f"{path}: ")


@pytest.mark.slow
def test_files_without_points_to_show_say_so(tmp_path: Path) -> None:
    path = write_las(tmp_path / "none.las", BALL[:0])
    with pytest.raises(InputError, match=r"none\.las: holds no points$"):
        load_mesh(path)
    path = write_las(tmp_path / "noise.las", BALL[:5], classification=np.full(5, 7))
    with pytest.raises(InputError, match=r"noise\.las: all of its 5 points are noise or withheld$"):
        load_mesh(path)
    path = write_las(tmp_path / "few.las", BALL[:2])
    with pytest.raises(InputError, match=r"few\.las: fewer than three points, through which no surface passes$"):
        load_mesh(path)
