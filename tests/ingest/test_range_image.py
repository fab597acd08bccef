"""Range images of every format, their points, normals and tears."""

import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from depthwalk.errors import InputError
from depthwalk.ingest.depth_surface import continues, noise, tolerance
from depthwalk.ingest.range_image import Intrinsics, load_depth_image, load_range_image
from depthwalk.types import Array

LENS = Intrinsics(fx=50.0, fy=60.0, cx=30.5, cy=20.25)
HEIGHT, WIDTH = 40, 60
ONES, WIDE = np.ones((4, 4), np.float32), np.ones((1, 20000), np.float32)

MOST = "16384 a side and 67108864 pixels are allowed"


def write_exr(path: Path, **channels: Array) -> None:
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    OpenEXR.File(header, channels).write(str(path))


def store(path: Path, metres: Array) -> float | None:
    """`metres` with NaN for empty, as cameras and programs write it; gives the unit to read it with."""
    counts = np.nan_to_num(np.round(metres * 1000)).astype(np.uint16)
    floats = metres.astype(np.float32)
    match path.stem, path.suffix:
        case "floats", ".tif":
            Image.fromarray(floats).save(path)
        case "floats", ".npy":
            np.save(path, floats)
        case "empty-is-infinite", ".exr":
            write_exr(path, Z=np.where(np.isnan(floats), np.float32(np.inf), floats))
        case "empty-has-no-alpha", ".exr":
            write_exr(path, Z=np.nan_to_num(floats, nan=7.0), A=np.isfinite(floats).astype(np.float16), G=floats)
        case "depth-alone", ".exr":
            write_exr(path, depth=np.nan_to_num(floats))
        case "counts", ".npy":
            np.save(path, counts)
            return 0.001
        case "counts", _:
            Image.fromarray(counts).save(path)
            return 0.001
    return None


def camera_rays(lens: Intrinsics = LENS) -> Array:
    i, j = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    return np.stack([(i - lens.cx) / lens.fx, -(j - lens.cy) / lens.fy, -np.ones(i.shape)], -1)


FILES = (
    "counts.png", "counts.tif", "counts.npy", "floats.tif", "floats.npy",
    "empty-is-infinite.exr", "empty-has-no-alpha.exr", "depth-alone.exr",
)  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_every_format_gives_the_same_points(tmp_path: Path, name: str) -> None:
    metres = np.round(np.random.default_rng(1).uniform(0.5, 3, (HEIGHT, WIDTH)), 3)
    metres[3, 5:9] = np.nan
    unit = store(tmp_path / name, metres)
    image = load_range_image(tmp_path / name, lens=LENS, unit=unit)
    expected = (metres[..., None] * camera_rays())[::-1]  # memory has the lowest row first
    seen = np.isfinite(metres)[::-1]
    assert np.isfinite(image.points).all(-1).tolist() == seen.tolist()
    np.testing.assert_allclose(image.points[seen], expected[seen], atol=1e-5)
    assert image.depth.dtype == np.float32 and (image.depth[~seen] == np.inf).all()


def plane_seen(normal: Array, distance: float) -> Array:
    """Depth (H, W), row 0 at the top, of the plane normal · P = −distance."""
    return -distance / (camera_rays() @ normal)


@pytest.mark.parametrize("normal", [(0, 0, 1), (0.5, 0.1, 0.86), (-0.4, -0.5, 0.77)])
def test_normals_of_a_plane_are_exact(tmp_path: Path, normal: tuple[float, float, float]) -> None:
    unit = np.asarray(normal) / np.linalg.norm(normal)
    metres = plane_seen(unit, 1.2)
    metres[10:14, 20:24] = np.nan
    np.save(tmp_path / "d.npy", metres)
    image = load_range_image(tmp_path / "d.npy", lens=LENS)
    np.testing.assert_allclose(image.normal[np.isfinite(image.depth)], unit[None].repeat(2384, 0), atol=1e-4)


def test_normals_withstand_noise_and_edges(tmp_path: Path) -> None:
    """A tilted plate before a wall, a camera's noise on both: no normal mixes the two, not even beside the edge."""
    rng = np.random.default_rng(2)
    tilted = np.array([0.3, 0.0, 0.954])
    near, wall = plane_seen(tilted, 1.0), plane_seen(np.array([0.0, 0, 1]), 2.0)
    plate = np.zeros((HEIGHT, WIDTH), bool)
    plate[10:30, 15:45] = True
    metres = np.where(plate, near, wall) * (1 + 0.001 * rng.normal(size=plate.shape))
    np.save(tmp_path / "d.npy", metres)
    image = load_range_image(tmp_path / "d.npy", lens=LENS)
    expected = np.where(plate[::-1, :, None], tilted, [0, 0, 1])
    degrees = np.degrees(np.arccos(np.clip((image.normal * expected).sum(-1), -1, 1)))
    assert np.median(degrees) < 2 and degrees.max() < 15
    neighbours = np.gradient(metres, axis=1)[::-1] * LENS.fx / metres[::-1]  # what one pixel's neighbours would give
    plain = np.degrees(np.arctan(np.abs(neighbours[2:8])))
    assert np.median(degrees[2:8]) < 0.5 * np.median(plain)


def test_colour_is_optional_and_of_any_size(tmp_path: Path) -> None:
    np.save(tmp_path / "d.npy", np.ones((HEIGHT, WIDTH)))
    Image.new("RGB", (7, 9), (10, 200, 30)).save(tmp_path / "c.png")
    plain = load_range_image(tmp_path / "d.npy", lens=LENS)
    assert plain.colour.shape == (HEIGHT, WIDTH, 3) and (plain.colour == 204).all()
    coloured = load_range_image(tmp_path / "d.npy", lens=LENS, colour=tmp_path / "c.png")
    assert (coloured.colour == [10, 200, 30]).all()


def test_zero_is_the_plane_of_a_relief_in_metres_but_empty_in_counts(tmp_path: Path) -> None:
    np.save(tmp_path / "f.npy", np.array([[0, 0.5], [0.25, 1]]))
    np.save(tmp_path / "u.npy", np.array([[0, 500], [250, 1000]], np.uint16))
    metres = load_depth_image(tmp_path / "f.npy", size=(1, 1)).depth
    counts = load_depth_image(tmp_path / "u.npy", size=(1, 1), unit=0.001).depth
    assert metres.tolist() == [[0.25, 1], [0, 0.5]]
    np.testing.assert_allclose(counts, [[0.25, 1], [np.inf, 0.5]])


def row(*depths: int) -> Array:
    return np.tile(np.asarray(depths, float), (8, 1))


@pytest.mark.parametrize(
    ("depths", "torn"),
    [
        ((1, 1, 1, 1, 3, 3, 3, 3), [3]),  # an edge
        ((1, 1, 1, 2, 3, 3, 3, 3), [2, 3]),  # with a pixel between foreground and background
        ((1, 2, 1, 2, 1, 2, 1, 1), [0, 1, 2, 3, 4, 5]),  # along a ragged edge
        ((1, 2, 3, 4, 5, 6, 7, 8), []),  # a slope, however steep
        ((1, 1, 1, 2, 3, 4, 4, 4), []),  # that begins and ends
        ((1, 1, 1, np.nan, 1, 1, 1, 1), [2, 3]),
        ((1, np.nan, 5, 7, np.nan, 5, 5, 5), [0, 1, 2, 3, 4]),  # two pixels alone are no slope
    ],
)
def test_tears_are_judged_by_the_steps_around(depths: tuple[int, ...], torn: Sequence[int]) -> None:
    for values, axis in ((row(*depths), 1), (row(*depths).T, 0)):
        kept = continues(values, np.full(values.shape, 0.1), axis)
        kept = kept if axis else kept.T
        assert (np.flatnonzero(~kept[0]) == torn).all() and (kept == kept[0]).all()


def test_noise_is_measured_and_allowed_for() -> None:
    rng = np.random.default_rng(3)
    values = 2 + 0.3 * np.arange(100)[None] / 100 + 0.01 * rng.normal(size=(80, 100))
    values[:, 50:] += 5
    assert noise(values) == pytest.approx(0.01, rel=0.1)
    kept = continues(values, tolerance(values, 1e-6), 1)
    assert not kept[:, 49].any() and np.delete(kept, 49, axis=1).mean() > 0.999


def sixteen_bit_alpha(path: Path) -> None:
    """A PNG of 16-bit grey with alpha: the header says so, whatever follows."""
    Image.new("LA", (4, 4)).save(path)
    data = bytearray(path.read_bytes())
    data[24:26] = 16, 4
    data[29:33] = zlib.crc32(data[12:29]).to_bytes(4, "big")
    path.write_bytes(data)


def whole_numbers(path: Path) -> None:
    Image.fromarray(np.ones((4, 4), np.uint16)).save(path)


def broken(path: Path) -> None:
    path.write_bytes(b"v/1\x01 and no more")


@pytest.mark.parametrize(
    ("name", "write", "options", "defect"),
    [
        ("d.png", whole_numbers, {}, "whole numbers need 'unit' to become metres"),
        ("d.npy", lambda p: np.save(p, np.zeros((4, 4))), {}, "no pixel holds a depth"),
        ("d.npy", lambda p: np.save(p, np.full((4, 4), -2.0)), {}, "16 depths are negative (in front of the camera)"),
        ("d.npy", lambda p: np.save(p, np.ones((4, 4))), {"unit": 0.0}, "unit must be positive and finite, not 0"),
        ("d.exr", broken, {}, "cannot be read as an OpenEXR image"),
        ("d.exr", lambda p: None, {}, "no such file"),
        ("d.exr", lambda p: write_exr(p, U=ONES, V=ONES), {}, "no channel Z; it has U, V"),
        (
            "d.exr",
            lambda p: write_exr(p, Z=WIDE),
            {},
            "depth image of 20000 × 1 pixels; at most 16384 a side and 67108864 pixels are allowed",
        ),
        ("d.png", sixteen_bit_alpha, {}, "16-bit grey with alpha is not supported; mark empty pixels otherwise"),
    ],
)
def test_bad_range_images(
    tmp_path: Path, name: str, write: Callable[[Path], None], options: dict[str, Any], defect: str
) -> None:
    path = tmp_path / name
    write(path)
    with pytest.raises(InputError) as caught:
        load_range_image(path, lens=LENS, **options)
    assert str(caught.value) == f"{path}: {defect}"
