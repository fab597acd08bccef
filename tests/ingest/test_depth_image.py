"""Textures of every kind, and planar depth images."""

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from depthwalk.errors import InputError
from depthwalk.ingest.image import load_texture
from depthwalk.ingest.range_image import load_depth_image
from depthwalk.types import Array, Picture, Rows


def saved(path: Path, array: Picture | Rows, **options: Any) -> Path:
    Image.fromarray(array).save(path, **options)
    return path


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA", "CMYK", "I;16", "I", "F"])
def test_texture_of_any_mode_is_rgba(tmp_path: Path, mode: str) -> None:
    values: dict[str, float | tuple[int, ...]] = {"I;16": 65535, "I": 65535, "F": 1.0, "CMYK": (0, 0, 0, 0)}
    image = Image.new(mode, (3, 2), values.get(mode, "white"))
    path = tmp_path / "p.tif"
    image.save(path)
    texture = load_texture(path)
    assert texture.shape == (2, 3, 4) and texture.dtype == np.uint8
    assert (texture == 255).all()


def test_sixteen_bits_are_scaled_not_clipped(tmp_path: Path) -> None:
    texture = load_texture(saved(tmp_path / "p.png", np.array([[0, 32768, 65535]], np.uint16)))
    assert texture[0, :, 0].tolist() == [0, 128, 255]


def png_header(width: int, height: int) -> bytes:
    chunk = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    start = b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + chunk + struct.pack(">I", zlib.crc32(chunk))
    return start + struct.pack(">I", 1000) + b"IDAT" + b"cut short"


@pytest.mark.parametrize(
    ("content", "defect"),
    [
        (png_header(60000, 60000), "image has more pixels than can be used safely"),
        (png_header(20000, 100), "image of 20000 × 100 pixels is larger than 16384 a side"),
        (png_header(10, 10), "image data is damaged or of an unsupported kind"),
        (b"", "cannot be read as an image"),
        (b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n", "cannot be read as an image"),
    ],
)
def test_bad_textures(tmp_path: Path, content: bytes, defect: str) -> None:
    path = tmp_path / "p.png"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        load_texture(path)
    assert str(caught.value) == f"{path}: {defect}"


def test_depth_of_png_white_is_the_plane_and_black_is_deep(tmp_path: Path) -> None:
    path = saved(tmp_path / "d.png", np.array([[65535, 65535], [0, 13107]], np.uint16))
    image = load_depth_image(path, size=(2.0, 1.0), depth_range=0.5)
    np.testing.assert_allclose(image.depth, [[0.5, 0.4], [0.0, 0.0]], atol=1e-5)  # the file's last row is row 0
    assert image.depth.dtype == np.float32 and image.size == (2.0, 1.0)
    assert image.colour.shape == (2, 2, 3) and image.normal.dtype == np.float32


def test_transparent_texels_are_empty(tmp_path: Path) -> None:
    grey = np.array([[[255, 255], [0, 0]], [[0, 255], [0, 255]]], np.uint8)
    image = load_depth_image(saved(tmp_path / "d.png", grey), size=(1, 1), depth_range=2)
    np.testing.assert_allclose(image.depth, [[2.0, 2.0], [0.0, np.inf]])
    assert np.isfinite(image.normal).all()


def test_normals_of_a_ramp_are_exact_even_beside_empty_texels(tmp_path: Path) -> None:
    columns, rows = np.meshgrid(np.arange(6), np.arange(6))
    metres = (0.5 + 0.1 * columns + 0.2 * (5 - rows)).astype(np.float32)  # deeper to the right and toward the top
    metres[2, 2] = np.nan
    np.save(tmp_path / "d.npy", metres)
    image = load_depth_image(tmp_path / "d.npy", size=(3.0, 3.0), depth_range=5)
    assert image.depth[3, 2] == np.inf and image.depth[0, 0] == np.float32(0.5)
    expected = np.array([0.1 / 0.5, 0.2 / 0.5, 1.0]) / np.linalg.norm([0.2, 0.4, 1.0])
    filled = np.isfinite(image.depth)
    np.testing.assert_allclose(image.normal[filled], np.broadcast_to(expected, (35, 3)), atol=1e-5)


def test_colour_and_normal_maps_are_resampled_and_turned_up(tmp_path: Path) -> None:
    np.save(tmp_path / "d.npy", np.zeros((4, 4), np.float32))
    colour = saved(tmp_path / "c.png", np.array([[[255, 0, 0]] * 8] * 4 + [[[0, 0, 255]] * 8] * 4, np.uint8))
    normal = saved(tmp_path / "n.png", np.full((2, 2, 3), (128, 255, 128), np.uint8))
    image = load_depth_image(tmp_path / "d.npy", size=(1, 1), depth_range=1, colour=colour, normal=normal)
    assert image.colour.shape == image.normal.shape == (4, 4, 3)
    assert image.colour[0, 0].tolist() == [0, 0, 255] and image.colour[3, 0].tolist() == [255, 0, 0]
    np.testing.assert_allclose(image.normal, np.broadcast_to([0, 1, 0], (4, 4, 3)), atol=0.01)


@pytest.mark.parametrize(
    ("array", "defect"),
    [
        (np.zeros((2, 2), np.int32), "depth must be floats or unsigned integers of shape (H, W), not int32 of (2, 2)"),
        (
            np.zeros((2, 2, 3), np.float32),
            "depth must be floats or unsigned integers of shape (H, W), not float32 of (2, 2, 3)",
        ),
        (np.full((2, 2), -1.0, np.float32), "4 depths are negative (in front of the plane)"),
        (np.full((2, 2), np.nan, np.float32), "no pixel holds a depth"),
        (np.full((2, 2), 1e10), "no pixel holds a depth"),
        (np.zeros((1, 5), np.float32), "a depth image needs at least 2 × 2 pixels"),
        (np.array([[{}]], object), "cannot be read as an NPY array"),
    ],
)
def test_bad_npy_depth(tmp_path: Path, array: Array | Rows, defect: str) -> None:
    path = tmp_path / "d.npy"
    np.save(path, array, allow_pickle=True)
    with pytest.raises(InputError) as caught:
        load_depth_image(path, size=(1, 1), depth_range=1)
    assert str(caught.value) == f"{path}: {defect}"


def test_bad_depth_arguments(tmp_path: Path) -> None:
    path = saved(tmp_path / "d.png", np.zeros((2, 2, 3), np.uint8))
    with pytest.raises(InputError, match=r"d\.png: a depth image must be grey, not RGB$"):
        load_depth_image(path, size=(1, 1), depth_range=1)
    with pytest.raises(InputError, match=r"d\.png: size must be positive and finite, not 0$"):
        load_depth_image(path, size=(1, 0), depth_range=1)
    with pytest.raises(InputError, match=r"gone\.npy: no such file$"):
        load_depth_image(tmp_path / "gone.npy", size=(1, 1), depth_range=1)
