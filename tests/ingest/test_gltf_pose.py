"""Skins and shape keys of glTF files."""

import math
from pathlib import Path

import numpy as np
import pytest

from depthwalk.errors import InputError
from depthwalk.ingest.mesh_head import read_head
from depthwalk.ingest.reader import read_soup
from glb_files import SQUARE, Glb

NORMALS = np.tile([0.0, 0.0, 1.0], (4, 1))
QUARTER_TURN = [0, 0, math.sin(math.pi / 4), math.cos(math.pi / 4)]  # about z, x becomes y


def with_shape(weights: list[float] | None) -> Glb:
    """A square with a shape key that moves it by 1 along z, and turns its normals to x."""
    glb = Glb()
    target = {"POSITION": glb.accessor(NORMALS), "NORMAL": glb.accessor(NORMALS[:, [2, 0, 1]] - NORMALS)}
    glb.mesh({"NORMAL": glb.accessor(NORMALS)}, targets=[target])
    if weights is not None:
        glb.header["meshes"][0]["weights"] = weights
    return glb


@pytest.mark.parametrize(("weights", "height"), [(None, 0), ([0.0], 0), ([0.5], 0.5), ([1.0], 1)])
def test_shape_keys_move_what_they_weigh(tmp_path: Path, weights: list[float] | None, height: float) -> None:
    path = with_shape(weights).write(tmp_path / "a.glb")
    assert read_soup(path).positions == pytest.approx(SQUARE + np.array([0, 0, height]))
    assert read_head(path).has_other_geometry == bool(height)


def test_each_node_may_have_weights_of_its_own(tmp_path: Path) -> None:
    path = with_shape([0.0]).write(tmp_path / "a.glb", {"mesh": 0}, {"mesh": 0, "weights": [2.0]})
    found = read_soup(path)
    assert sorted(set(found.positions[:, 2])) == [0, 2] and len(found.faces) == 4


def test_shape_keys_turn_normals(tmp_path: Path) -> None:
    assert read_soup(with_shape([1.0]).write(tmp_path / "a.glb")).normals == pytest.approx(NORMALS[:, [2, 0, 1]])


def skinned(path: Path, joints: list[list[int]], weights: list[list[float]], *, bound: bool = True) -> Path:
    """A square whose upper corners hang from a joint at (0, 1, 0), turned by 90° and three times as large."""
    glb = Glb()
    attributes = {"NORMAL": glb.accessor(NORMALS), "JOINTS_0": glb.accessor(joints, "u1")}
    glb.mesh(attributes | {"WEIGHTS_0": glb.accessor(weights)})
    lowered = np.eye(4)
    lowered[:3, 3] = [0, -1, 0]
    glb.header["skins"] = [{"joints": [1, 2]}]
    if bound:
        glb.header["skins"][0]["inverseBindMatrices"] = glb.accessor(np.array([np.eye(4).T, lowered.T]))
    return glb.write(
        path,
        {"mesh": 0, "skin": 0, "translation": [50, 0, 0]},
        {"children": [2]},
        {"translation": [0, 1, 0], "rotation": QUARTER_TURN, "scale": [3, 3, 3]},
        roots=[0, 1],
    )


JOINTS = [[0, 1, 0, 0]] * 4
WEIGHTS = [[1.0, 0.0, 0.0, 0.0]] * 2 + [[0.0, 1.0, 0.0, 0.0]] * 2


def test_joints_place_the_vertices_and_the_node_does_not(tmp_path: Path) -> None:
    found = read_soup(skinned(tmp_path / "a.glb", JOINTS, WEIGHTS))
    assert found.positions == pytest.approx(np.array([(0, 0, 0), (1, 0, 0), (0, 4, 0), (0, 1, 0)]), abs=1e-6)
    assert found.normals == pytest.approx(NORMALS) and len(found.faces) == 2


def test_skins_without_matrices_are_bound_at_the_origin(tmp_path: Path) -> None:
    found = read_soup(skinned(tmp_path / "a.glb", JOINTS, WEIGHTS, bound=False))
    assert found.positions[2:] == pytest.approx(np.array([(-3, 4, 0), (-3, 1, 0)]), abs=1e-6)


def test_weights_are_relative_and_a_vertex_without_any_stays(tmp_path: Path) -> None:
    weights = [[2.0, 0, 0, 0], [0.0, 0, 0, 0], [0.5, 0.5, 0, 0], [0.0, 1, 0, 0]]
    found = read_soup(skinned(tmp_path / "a.glb", JOINTS, weights))
    assert found.positions[:3] == pytest.approx(np.array([(0, 0, 0), (1, 0, 0), (0.5, 2.5, 0)]), abs=1e-6)


def test_a_joint_that_is_none_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a\.glb: damaged, truncated or an unsupported kind of GLB"):
        read_soup(skinned(tmp_path / "a.glb", [[0, 7, 0, 0]] * 4, WEIGHTS))


def test_nodes_in_a_circle_are_reported(tmp_path: Path) -> None:
    glb = with_shape([1.0])
    path = glb.write(tmp_path / "a.glb", {"children": [1]}, {"children": [0], "mesh": 0}, roots=[0])
    with pytest.raises(InputError, match="a node that hangs from no scene"):
        read_soup(path)


def hanging(joints: list[int], weights: bool = True) -> Glb:
    """A square that hangs from the first joint of a skin."""
    glb = Glb()
    attributes = {"JOINTS_0": glb.accessor(np.zeros((4, 4), np.uint8))}
    if weights:
        attributes["WEIGHTS_0"] = glb.accessor(np.tile([1.0, 0, 0, 0], (4, 1)))
    glb.mesh(attributes)
    glb.header["skins"] = [{"joints": joints}]
    return glb


def test_a_joint_may_stand_outside_the_scene(tmp_path: Path) -> None:
    glb = hanging([1])
    glb.header["scenes"] = [{"nodes": [0]}]
    path = glb.write(tmp_path / "a.glb", {"mesh": 0, "skin": 0}, {"translation": [0, 0, 2]})
    assert read_soup(path).positions == pytest.approx(SQUARE + np.array([0, 0, 2]))


@pytest.mark.parametrize(
    ("joints", "weights", "message"),
    [
        ([], True, r"skins\[0\]: has 0 joints"),
        ([7], True, r"skins\[0\]: joint 7 is no node"),
        ([0] * 70_000, True, r"skins\[0\]: has 70000 joints, not 1 to 65536"),
        ([1], False, "JOINTS_0 has no WEIGHTS_0"),
    ],
)
def test_a_damaged_skin_is_named(tmp_path: Path, joints: list[int], weights: bool, message: str) -> None:
    path = hanging(joints, weights).write(tmp_path / "a.glb", {"mesh": 0, "skin": 0}, {})
    with pytest.raises(InputError, match=message):
        read_soup(path)
