"""Points in glTF files: read with all that they have, and told of where they are not drawn."""

import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.ingest.gltf import read_header
from depthwalk.ingest.gltf_unread import unread
from depthwalk.ingest.point_cloud import PointCloud
from depthwalk.ingest.reader import read_geometry, read_soup
from depthwalk.ingest.soup import Soup
from glb_files import Glb

COUNT = 200
_TURN = np.pi * (1 + np.sqrt(5)) * np.arange(COUNT)
_Z = 1 - (2 * np.arange(COUNT) + 1) / COUNT
BALL = np.column_stack([np.sqrt(1 - _Z * _Z) * np.cos(_TURN), np.sqrt(1 - _Z * _Z) * np.sin(_TURN), _Z])
HALF_TURN_UP = {"rotation": [0, 1, 0, 0], "translation": [0, 5, 0], "scale": [1, 2, 1]}  # about y


def points_of(glb: Glb, path: Path, *nodes: dict[str, Any]) -> PointCloud:
    cloud = read_geometry(glb.write(path / "ball.glb", *nodes))
    assert isinstance(cloud, PointCloud)
    return cloud


def ball(glb: Glb, *, indices: NDArray[Any] | None = None, **attributes: int) -> int:
    return glb.mesh({"POSITION": glb.accessor(BALL), **attributes}, indices, mode=0)


def test_normals_are_read_and_turned_with_their_node(tmp_path: Path) -> None:
    glb = Glb()
    ball(glb, NORMAL=glb.accessor(-BALL))
    cloud = points_of(glb, tmp_path, {"mesh": 0} | HALF_TURN_UP)
    np.testing.assert_allclose(cloud.positions, BALL * [-1, 2, -1] + [0, 5, 0], atol=1e-6)
    expected = -BALL * [-1, 0.5, -1]
    np.testing.assert_allclose(cloud.normals, expected / np.linalg.norm(expected, axis=1)[:, None], atol=1e-6)
    assert cloud.colours is None
    soup = read_soup(tmp_path / "ball.glb")  # the surface keeps them: it is seen from inside
    np.testing.assert_allclose(soup.normals, cloud.normals, atol=1e-6)


@pytest.mark.parametrize(
    ("values", "kind", "normalised"),
    [((0.5, 0.25, 1, 0.1), "f4", False), ((128, 64, 255, 0), "u1", True), ((32768, 16384, 65535), "u2", True)],
)
def test_colours_of_every_type_are_linear_and_multiply_the_material(
    tmp_path: Path, values: tuple[float, ...], kind: str, normalised: bool
) -> None:
    glb = Glb()
    glb.header["materials"] = [{"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 0.5, 1]}}]
    ball(glb, COLOR_0=glb.accessor(np.tile(values, (COUNT, 1)), kind, normalized=normalised))
    glb.header["meshes"][0]["primitives"][0]["material"] = 0
    colours = points_of(glb, tmp_path).colours
    assert colours is not None
    assert np.abs(colours.astype(int) - (188, 137, 188)).max() <= 1


def test_the_colour_of_a_material_alone_and_of_several_clouds(tmp_path: Path) -> None:
    glb = Glb()
    glb.header["materials"] = [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}]
    ball(glb)
    glb.header["meshes"][0]["primitives"][0]["material"] = 0
    ball(glb)
    cloud = points_of(glb, tmp_path, {"mesh": 0}, {"mesh": 1, "translation": [9, 0, 0]})
    assert cloud.colours is not None and len(cloud.colours) == 2 * COUNT
    assert (cloud.colours[:COUNT] == (255, 0, 0)).all() and (cloud.colours[COUNT:] == 255).all()
    assert cloud.positions[COUNT:, 0].min() > 7


def test_indices_choose_points(tmp_path: Path) -> None:
    glb = Glb()
    ball(glb, indices=np.array([3, 5, 5, 9]), NORMAL=glb.accessor(BALL))
    cloud = points_of(glb, tmp_path)
    np.testing.assert_allclose(cloud.positions, BALL[[3, 5, 9]], atol=1e-6)
    np.testing.assert_allclose(cloud.normals, BALL[[3, 5, 9]], atol=1e-6)


def test_points_that_no_node_shows_count_for_nothing(tmp_path: Path) -> None:
    glb = Glb()
    ball(glb)
    glb.mesh({})
    assert isinstance(read_geometry(glb.write(tmp_path / "a.glb", {"mesh": 1})), Soup)
    assert isinstance(read_geometry(glb.write(tmp_path / "b.glb", {"mesh": 0})), PointCloud)


def test_points_and_lines_beside_triangles_are_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    glb = Glb()
    glb.mesh({})
    ball(glb)
    glb.mesh({}, None, mode=3)
    glb.mesh({}, (0, 1, 2, 3), mode=1)
    path = glb.write(tmp_path / "a.glb", {"mesh": 0}, {"mesh": 1}, {"mesh": 2})
    with caplog.at_level(logging.WARNING):
        soup = read_geometry(path)
    assert isinstance(soup, Soup) and len(soup.faces) == 2
    assert caplog.messages == [f"{path}: not drawn: 200 points and 2 sets of lines, since the file has triangles"]
    assert unread(read_header(path.read_bytes(), path)) == ["200 points", "2 sets of lines"]


def test_a_scene_of_nothing_is_told(tmp_path: Path) -> None:
    glb = Glb()
    ball(glb)
    path = glb.write(tmp_path / "a.glb", {})
    with pytest.raises(InputError, match=rf"^{path}: no faces; its scene shows neither triangles nor points$"):
        read_geometry(path)


def test_a_scan_alone_is_told_nothing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    glb = Glb()
    ball(glb)
    points_of(glb, tmp_path)
    path = tmp_path / "ball.glb"
    assert not caplog.messages and unread(read_header(path.read_bytes(), path)) == []


@pytest.mark.parametrize(
    "damage",
    [
        {"accessors": [{"bufferView": 7, "componentType": 5126, "count": 200, "type": "VEC3"}]},
        {"accessors": [{"bufferView": 0, "componentType": 5126, "count": 201, "type": "VEC3"}]},
        {"nodes": [{"mesh": 4}]},
        {"meshes": [{"primitives": [{"mode": 0, "attributes": {}}]}]},
        {"meshes": [{"primitives": [{"mode": 0, "attributes": {"POSITION": 0}, "material": 3}]}]},
        {"meshes": [{"primitives": [{"mode": 0, "attributes": {"POSITION": 0, "NORMAL": 5}}]}]},
        {"scenes": [{"nodes": [12]}]},
    ],
)
def test_damaged_files_are_told(tmp_path: Path, damage: dict[str, Any]) -> None:
    glb = Glb()
    ball(glb)
    glb.write(tmp_path / "a.glb")
    glb.header |= damage
    if "scenes" in damage:
        glb.header["nodes"] = [{"mesh": 0}]
    path = glb.write(tmp_path / "a.glb") if "nodes" in glb.header else glb.write(tmp_path / "a.glb", {"mesh": 0})
    with pytest.raises(InputError, match=rf"^{path}: "):
        read_geometry(path)


def test_copies_of_points_without_end_are_refused(tmp_path: Path) -> None:
    glb = Glb()
    ball(glb)
    path = glb.write(tmp_path / "a.glb", *[{"mesh": 0}] * 30_000)
    with pytest.raises(InputError, match=r"nodes and primitives make 6000000 triangles of the same data"):
        read_geometry(path)
