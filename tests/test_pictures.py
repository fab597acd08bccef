"""Pictures come back from their files as they went in."""

import errno
import io
import os
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from depthwalk.pictures import LinearImage, jpeg_bytes, png_bytes, webp_bytes, write_exr

RNG = np.random.default_rng(1)


@pytest.mark.parametrize("channels", [3, 4])
def test_png_keeps_every_pixel(channels: int) -> None:
    pixels = RNG.integers(0, 256, (5, 7, channels), dtype=np.uint8)
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(png_bytes(pixels)))), pixels)


def test_a_picture_upside_down_in_memory_is_written_as_it_is_seen() -> None:
    pixels = RNG.integers(0, 256, (5, 7, 3), dtype=np.uint8)
    assert png_bytes(pixels[::-1]) == png_bytes(np.ascontiguousarray(pixels[::-1]))


def test_jpeg_is_nearly_the_picture() -> None:
    y, x = np.mgrid[:32, :48]
    pixels = np.stack([8 * y, 5 * x, 100 + 0 * x], -1).astype(np.uint8)
    found = np.asarray(Image.open(io.BytesIO(jpeg_bytes(pixels)))).astype(int)
    assert np.abs(found - pixels).max() <= 8 and np.abs(found - pixels).mean() < 2


def test_webp_is_nearly_the_picture_and_keeps_alpha() -> None:
    y, x = np.mgrid[:32, :48]
    pixels = np.stack([8 * y, 5 * x, 100 + 0 * x, np.where(x < 24, 255, 40)], -1).astype(np.uint8)
    found = np.asarray(Image.open(io.BytesIO(webp_bytes(pixels)))).astype(int)
    assert np.abs(found - pixels)[..., :3].mean() < 3
    np.testing.assert_array_equal(found[..., 3], pixels[..., 3])


def test_exr_keeps_light_and_distance(tmp_path: Path) -> None:
    colour = RNG.normal(0, 5, (6, 9, 4)).astype(np.float32)
    distance = np.full((6, 9), np.inf, np.float32)
    distance[2, 3] = 7.25
    write_exr(tmp_path / "a.exr", LinearImage(colour, distance))
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        channels = file.channels()
        found = {name: channels[name].pixels.copy() for name in "RGBAZ"}
    for index, name in enumerate("RGBA"):
        np.testing.assert_array_equal(found[name], colour[..., index])
    np.testing.assert_array_equal(found["Z"], distance)


def test_an_exr_that_cannot_be_written_names_its_file(tmp_path: Path) -> None:
    image = LinearImage(np.zeros((2, 2, 4), np.float32), np.ones((2, 2), np.float32))
    with pytest.raises(OSError, match="missing"):
        write_exr(tmp_path / "missing" / "a.exr", image)


def test_an_exr_on_a_full_disk_is_told_as_such(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The library raises its own error, which quotes that of the system without its number."""

    def full(file: object, name: str) -> None:
        raise RuntimeError(f'Cannot write "{name}". {os.strerror(errno.ENOSPC)}.')

    monkeypatch.setattr(OpenEXR.File, "write", full)
    image = LinearImage(np.zeros((2, 2, 4), np.float32), np.zeros((2, 2), np.float32))
    with pytest.raises(OSError) as error:
        write_exr(tmp_path / "a.exr", image)
    assert (error.value.errno, error.value.filename) == (errno.ENOSPC, str(tmp_path / "a.exr"))


@pytest.mark.parametrize("missing", [1, 100, 10_000])
def test_an_exr_whose_end_did_not_reach_the_disk_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, missing: int
) -> None:
    write = OpenEXR.File.write

    def cut(file: OpenEXR.File, name: str) -> None:  # as the library does, which swallows errors when it closes a file
        write(file, name)
        with open(name, "rb+") as written:
            written.truncate(max(0, written.seek(0, 2) - missing))

    image = LinearImage(RNG.random((9, 20, 4), np.float32), np.ones((9, 20), np.float32))
    write_exr(tmp_path / "a.exr", image)
    before = (tmp_path / "a.exr").read_bytes()
    monkeypatch.setattr(OpenEXR.File, "write", cut)
    with pytest.raises(OSError, match=r"a\.exr"):
        write_exr(tmp_path / "a.exr", image)
    assert (tmp_path / "a.exr").read_bytes() == before and len(list(tmp_path.iterdir())) == 1
