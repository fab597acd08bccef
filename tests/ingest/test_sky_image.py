"""Pictures of skies become light of one kind, whatever their format."""

import logging
import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from depthwalk.colour import linear_from_srgb8
from depthwalk.errors import InputError
from depthwalk.ingest import sky_image
from depthwalk.ingest.sky_image import load_sky_image, shrunk
from fuzz.seeds import exr, picture, radiance

LIGHT = np.random.default_rng(1).uniform(0, 9, (8, 16, 3)).astype(np.float32)
CHANNELS = {name: np.ascontiguousarray(LIGHT[..., c]) for c, name in enumerate("RGB")}


def load(folder: Path, name: str, data: bytes) -> np.ndarray:
    (folder / name).write_bytes(data)
    return load_sky_image(folder / name)


def test_formats(tmp_path: Path) -> None:
    bytes_ = (LIGHT * 28).astype(np.uint8)
    assert (load(tmp_path, "a.exr", exr(CHANNELS)) == LIGHT).all()
    half = {name: channel.astype(np.float16) for name, channel in CHANNELS.items()}
    assert load(tmp_path, "b.EXR", exr(half | {"A": half["R"]})) == pytest.approx(LIGHT, rel=1e-3)
    assert (load(tmp_path, "c.exr", exr({"Y": CHANNELS["R"]})) == LIGHT[..., :1]).all()
    assert load(tmp_path, "d.hdr", radiance(LIGHT)) == pytest.approx(LIGHT, abs=9 / 128)
    assert (load(tmp_path, "e.png", picture("PNG", "RGB", bytes_)) == linear_from_srgb8(bytes_)).all()
    jpeg = load(tmp_path, "f.jpg", picture("JPEG", "RGB", np.full((8, 16, 3), 128, np.uint8)))
    assert jpeg == pytest.approx(np.full((8, 16, 3), 0.2159), abs=0.004)


def test_light_is_finite_and_not_negative(tmp_path: Path) -> None:
    odd = {
        "R": np.array([[np.nan, np.inf]], np.float32),
        "G": np.array([[-1, -np.inf]], np.float32),
        "B": np.array([[3e38, 0.5]], np.float32),
    }
    light = load(tmp_path, "a.exr", exr(odd))
    assert light.tolist() == [[[0, 0, 1e10], [65504, 0, 0.5]]]


def test_light_beyond_half_floats_is_their_greatest_number(tmp_path: Path) -> None:
    over = {name: np.array([[np.inf, 6e4]], np.float16) for name in "RGB"}
    assert load(tmp_path, "a.exr", exr(over)).tolist() == [[[65504] * 3, [6e4] * 3]]


@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_memory_is_checked_for_all_that_reading_takes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    bytes_ = np.random.default_rng(2).integers(0, 255, (256, 512, 3), np.uint8)
    wide = {channel: bytes_[..., c].astype(np.float32) for c, channel in enumerate("RGB")}
    data = picture("PNG", "RGB", bytes_) if name == "a.png" else exr(wide)
    load(tmp_path, name, data)  # imports what reads it
    checked = [0]
    monkeypatch.setattr(sky_image, "check_memory", lambda _path, needed, _what: checked.append(needed))
    tracemalloc.start()
    try:
        load_sky_image(tmp_path / name)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak - len(data) < max(checked)


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.hdr", radiance(LIGHT[:, :12]), "twice as wide as high; this one has 12 × 8 pixels"),
        ("a.exr", exr({n: c[:4] for n, c in CHANNELS.items()}), "twice as wide as high; this one has 16 × 4 pixels"),
        ("a.png", picture("PNG"), "twice as wide as high; this one has 9 × 8 pixels"),
        ("a.exr", exr({"Z": CHANNELS["R"]}), "no channels R, G, B of floats; it has Z"),
        ("a.exr", exr({n: c.astype(np.uint32) for n, c in CHANNELS.items()}), "no channels R, G, B of floats"),
        ("a.exr", b"no picture", "cannot be read as an OpenEXR image"),
        ("a.jpg", b"no picture", "cannot be read as an image"),
        ("a.psd", b"8BPS", "'.psd' is not a picture of a sky (use .hdr, .exr, .png, .jpg)"),
    ],
)
def test_what_is_no_sky_is_refused(tmp_path: Path, name: str, data: bytes, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        load(tmp_path, name, data)


def test_a_width_may_miss_twice_the_height_by_rounding(tmp_path: Path) -> None:
    assert load(tmp_path, "a.hdr", radiance(LIGHT[:, :14])).shape == (8, 14, 3)


def test_large_pictures_are_reduced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(sky_image, "MAX_SKY_WIDTH", 8)
    with caplog.at_level(logging.WARNING):
        light = load(tmp_path, "a.exr", exr(CHANNELS))
    assert light == pytest.approx(LIGHT.reshape(4, 2, 8, 2, 3).mean((1, 3)), rel=1e-5)
    assert f"{tmp_path / 'a.exr'}: reduced from 16 to 8 pixels across" in caplog.text


def test_shrinking_takes_means_and_keeps_even_light_whatever_the_sizes() -> None:
    assert shrunk(LIGHT, 8, 2) == pytest.approx(LIGHT.reshape(2, 4, 8, 2, 3).mean((1, 3)), rel=1e-5)
    assert shrunk(np.full((9, 18, 3), 0.3, np.float32), 7, 4) == pytest.approx(np.full((4, 7, 3), 0.3))
