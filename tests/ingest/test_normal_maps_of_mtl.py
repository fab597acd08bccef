"""Normal maps and height maps of MTL files."""

import logging
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from depthwalk.errors import InputError
from depthwalk.ingest.loader import load_mesh
from depthwalk.ingest.mesh import Material
from depthwalk.ingest.mesh_head import read_head
from depthwalk.ingest.normal_maps import bump_scale, is_height_map, normals_from_heights

BLUE = np.full((2, 2, 3), (128, 128, 255), np.uint8)
RAMP = np.tile((np.arange(16) * 4).astype(np.uint8), (16, 1))  # rises to the right


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    Image.fromarray(BLUE).save(tmp_path / "blue.png")
    Image.fromarray(RAMP).save(tmp_path / "ramp.png")
    (tmp_path / "broken.png").write_bytes(b"no picture")
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n")
    return tmp_path


def read(folder: Path, lines: str) -> Material:
    (folder / "a.mtl").write_text(f"newmtl m\n{lines}\n")
    (material,) = load_mesh(folder / "a.obj").materials
    return material


@pytest.mark.parametrize("key", ["norm", "Norm", "map_Bump", "map_bump", "bump"])
def test_normal_maps_are_taken_as_they_are(folder: Path, key: str) -> None:
    material = read(folder, f"{key} -bm 0.5 blue.png")
    assert material.normal_map is not None and material.normal_scale == 0.5
    assert (material.normal_map[..., :3] == BLUE).all()
    assert [path.name for path in read_head(folder / "a.obj").files] == ["a.obj", "a.mtl", "blue.png"]
    assert read_head(folder / "a.obj").has_normal_maps


def test_height_maps_become_normal_maps(folder: Path) -> None:
    """Of slope 4/255 per texel; where the picture repeats it falls steeply."""
    material = read(folder, "map_Bump -bm 3 ramp.png")
    assert material.normal_map is not None and material.normal_scale == 3
    inner = material.normal_map[:, 1:-1, :3] / 127.5 - 1
    assert inner == pytest.approx(np.tile([-4 / 255, 0, 1], (16, 14, 1)), abs=0.005)
    assert read(folder, "norm blue.png\nbump ramp.png").normal_map is not None
    assert read(folder, "map_Kd ramp.png").normal_map is None


def test_heights_that_rise_upward() -> None:
    heights = np.repeat(np.rot90(RAMP)[..., None], 4, -1)  # the left column becomes the bottom row
    found = normals_from_heights(heights)[1:-1, :, :3] / 127.5 - 1
    assert found == pytest.approx(np.tile([0, -4 / 255, 1], (14, 16, 1)), abs=0.005)


def test_normals_are_blue_and_heights_are_grey() -> None:
    steep = np.zeros((4, 4, 4), np.uint8)
    steep[..., :3] = (240, 128, 190)
    steep[:, 2:, 0] = 15  # the other way
    assert not is_height_map(steep)
    assert is_height_map(np.full((4, 4, 4), 255, np.uint8)) and is_height_map(np.zeros((4, 4, 4), np.uint8))


@pytest.mark.parametrize(
    ("argument", "expected"),
    [
        ("a.png", 1),
        ("-bm 0.25 a.png", 0.25),
        ("-o 0 0 0 -BM -2 a.png", -2),
        ("-bm 1e9 a.png", 100),
        ("-bm nan a.png", 1),
        ("-bm a.png", 1),
        ("-bm", 1),
        ("", 1),
        ("a -bm 5.png", 1),
    ],
)
def test_factors(argument: str, expected: float) -> None:
    assert bump_scale(argument) == expected


def test_a_broken_picture_is_refused_and_a_missing_one_ignored(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    with pytest.raises(InputError, match=r"broken\.png: cannot be read as an image$"):
        read(folder, "norm broken.png")
    with caplog.at_level(logging.WARNING):
        assert read(folder, "norm gone.png").normal_map is None
    assert "'gone.png' is missing" in caplog.text
