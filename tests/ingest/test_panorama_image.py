"""Cylindrical panoramas: where their pixels look, and what normals their depths have."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from depthwalk.errors import InputError
from depthwalk.ingest.range_image import PanoramaLens, RangeImage, load_panorama
from depthwalk.types import Array

WIDTH, HEIGHT, HORIZON = 96, 40, 14.0  # the horizon from the top


def plane_depth(normal: Array, offset: float) -> Array:
    """Level distance (H, W), row 0 at the top, to the plane n · P = −offset; NaN where it is not in sight."""
    turn = 2 * np.pi * ((np.arange(WIDTH) + 0.5) / WIDTH - 0.5)
    rise = (HORIZON - np.arange(HEIGHT)) / (WIDTH / (2 * np.pi))
    ray = np.stack(np.broadcast_arrays(np.sin(turn)[None], rise[:, None], -np.cos(turn)[None]), -1)
    with np.errstate(divide="ignore"):
        depth = -offset / (ray @ normal)
    return np.where((depth > 0) & (depth < 20), depth, np.nan)


def load(path: Path, depth: Array) -> RangeImage:
    np.save(path / "d.npy", depth.astype(np.float32))
    return load_panorama(path / "d.npy", horizon=HORIZON)


def test_pixels_look_all_round_from_one_point() -> None:
    lens = PanoramaLens(width=8, horizon=1.0)
    rays = lens.rays((3, 8))
    assert np.hypot(rays[..., 0], rays[..., 2]) == pytest.approx(np.ones((3, 8)))
    rise = rays[:, 0, 1]
    assert rise == pytest.approx(np.array([-1, 0, 1]) / lens.focal) and (rays[..., 1] == rise[:, None]).all()
    turn = np.degrees(np.arctan2(rays[0, :, 0], -rays[0, :, 2]))
    assert turn == pytest.approx(np.arange(8) * 45 - 157.5)  # the middle of the picture looks along −z, right is +x


@pytest.mark.parametrize(
    "normal", [(0, 1.0, 0), (0, 0, 1.0), (0, 0, -1.0), (-0.6, 0, 0.8), (-0.48, 0.6, 0.64)], ids=str
)
def test_points_lie_on_the_plane_and_normals_are_its(tmp_path: Path, normal: tuple[float, ...]) -> None:
    """Whatever way the plane faces; across the seam too (the third)."""
    n = np.array(normal)
    image = load(tmp_path, plane_depth(n, 1.5))
    known = np.isfinite(image.depth)
    assert image.points[known] @ n == pytest.approx(-1.5, abs=1e-5)
    assert (image.normal[known] @ n).min() > 0.999 and known.sum() > 500
    if normal[2] < 0:
        assert known[:, 0].any() and known[:, -1].any()


def test_the_horizon_is_in_the_middle_where_nothing_is_said(tmp_path: Path) -> None:
    np.save(tmp_path / "d.npy", np.ones((5, 16), np.float32))
    image = load_panorama(tmp_path / "d.npy")
    assert image.points[2, :, 1] == pytest.approx(0) and image.points[4, :, 1].min() > 0


def test_counts_and_colours_are_read(tmp_path: Path) -> None:
    counts = np.full((6, 12), 1500, np.uint16)
    counts[0, 3] = 0
    Image.fromarray(counts).save(tmp_path / "d.png")
    picture = np.zeros((6, 12, 3), np.uint8)
    picture[0] = 200  # the top row
    Image.fromarray(picture).save(tmp_path / "c.png")
    image = load_panorama(tmp_path / "d.png", unit=0.002, colour=tmp_path / "c.png")
    assert np.isinf(image.depth[5, 3]) and image.depth[0, 0] == pytest.approx(3.0)
    assert (image.colour[5] == 200).all() and (image.colour[0] == 0).all()


def test_bad_files_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "d.npy", np.zeros((5, 16), np.float32))
    with pytest.raises(InputError, match=r"d.npy: no pixel holds a depth"):
        load_panorama(tmp_path / "d.npy")
    with pytest.raises(InputError, match="unit must be positive"):
        load_panorama(tmp_path / "d.npy", unit=0.0)
