"""Flattened transforms against products of 4 × 4 matrices, and moving a node."""

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene, set_node_transform
from depthwalk.walk.controls import direction

PLACEMENT = {
    "position": st.lists(st.floats(-20, 20), min_size=3, max_size=3),
    "yaw": st.floats(-720, 720),
    "pitch": st.floats(-720, 720),
    "roll": st.floats(-720, 720),
    "scale": st.floats(0.25, 4),
}
ANGLES = "yaw", "pitch", "roll"
OBJECT = st.fixed_dictionaries({"asset": st.just("box")}, optional=PLACEMENT)
GRID = st.fixed_dictionaries(
    {
        "asset": st.just("box"),
        "count": st.lists(st.integers(1, 3), min_size=2, max_size=2),
        "spacing": st.lists(st.floats(0.5, 5), min_size=2, max_size=2),
    },
    optional={key: value for key, value in PLACEMENT.items() if key != "scale"},
).map(lambda grid: {"grid": grid})

UPRIGHT = (0.0, 0.0, 0.0)


def group(members: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    return st.fixed_dictionaries({"objects": st.lists(members, max_size=3)}, optional=PLACEMENT).map(
        lambda group: {"group": group}
    )


ITEMS = st.lists(st.recursive(OBJECT | GRID, group, max_leaves=8), max_size=3)


def scene_of(items: list[Any]) -> Scene:
    with TemporaryDirectory() as folder:
        (Path(folder) / "box.obj").touch()
        with (Path(folder) / "scene.yaml").open("w") as file:
            yaml.safe_dump({"version": 1, "assets": {"box": {"mesh": "box.obj"}}, "objects": items}, file)
        return load_scene(Path(folder) / "scene.yaml")


def matrix(node: dict[str, Any], scaled: bool = True) -> NDArray[np.float64]:
    """World from node, written out."""
    (cy, sy), (cx, sx), (cz, sz) = (
        (math.cos(angle), math.sin(angle)) for angle in (math.radians(node.get(key, 0)) for key in ANGLES)
    )
    yaw = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    pitch = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    roll = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    result = np.eye(4)
    result[:3, :3] = yaw @ pitch @ roll * (node.get("scale", 1) if scaled else 1)
    result[:3, 3] = node.get("position", (0, 0, 0))
    return result


def matrices(items: list[Any], parent: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """World from object of every object, by recursion and matrix products."""
    result = []
    for item in items:
        if "group" in item:
            result += matrices(item["group"]["objects"], parent @ matrix(item["group"]))
        elif "grid" in item:
            grid = item["grid"]
            (nx, nz), (sx, sz) = grid["count"], grid["spacing"]
            for k in range(nz):
                for i in range(nx):
                    place = {"position": ((i - (nx - 1) / 2) * sx, 0, (k - (nz - 1) / 2) * sz)}
                    result.append(parent @ matrix(grid) @ matrix(place))
        else:
            result.append(parent @ matrix(item))
    return result


def matrices_of(scene: Scene) -> NDArray[np.float64]:
    """World from object, from the arrays by the quaternion's own formula."""
    x, y, z, w = scene.objects.rotation.astype(float).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    result = np.tile(np.eye(4), (len(scene.objects), 1, 1))
    result[:, :3, :3] = np.moveaxis(np.array(rows), 2, 0) * scene.objects.scale[:, None, None]
    result[:, :3, 3] = scene.objects.position
    return result


def assert_close(actual: NDArray[np.float64], wanted: list[NDArray[np.float64]]) -> None:
    wanted_array = np.array(wanted).reshape(-1, 4, 4)
    np.testing.assert_allclose(actual, wanted_array, rtol=1e-4, atol=1e-3)


@pytest.mark.slow
@given(ITEMS)
def test_flattened_transforms_are_the_matrix_products(items: list[Any]) -> None:
    assert_close(matrices_of(scene_of(items)), matrices(items, np.eye(4)))


@pytest.mark.slow
@given(ITEMS.filter(bool), st.fixed_dictionaries(PLACEMENT), st.data())
def test_moving_a_node_is_loading_it_there(items: list[Any], placement: dict[str, Any], data: st.DataObject) -> None:
    which = data.draw(st.integers(0, len(items) - 1))
    scene = scene_of(items)
    node = int(np.flatnonzero(scene.nodes.depth == 0)[which])
    before = scene.objects.position.copy()
    yaw, pitch, roll = (math.radians(placement[key]) for key in ANGLES)
    changed = set_node_transform(scene, node, tuple(placement["position"]), (yaw, pitch, roll), placement["scale"])
    item = items[which]
    moved = [*items]
    moved[which] = {"group": {**placement, "objects": [strip(item)]}}
    assert_close(matrices_of(scene), matrices(moved, np.eye(4)))
    untouched = np.ones(len(before), bool)
    untouched[changed] = False
    np.testing.assert_array_equal(scene.objects.position[untouched], before[untouched])


def strip(item: dict[str, Any]) -> dict[str, Any]:
    """The item without its own transform."""
    for kind in ("group", "grid"):
        if kind in item:
            return {kind: {key: value for key, value in item[kind].items() if key not in PLACEMENT}}
    return {key: value for key, value in item.items() if key not in PLACEMENT}


def test_yaw_is_counter_clockwise_seen_from_above() -> None:
    scene = scene_of([{"group": {"yaw": 90, "objects": [{"asset": "box", "position": [1, 0, 0]}]}}])
    np.testing.assert_allclose(scene.objects.position, [[0, 0, -1]], atol=1e-6)


@pytest.mark.parametrize(
    ("angles", "top", "front"),
    [
        ({"pitch": 90}, (0, 0, 1), (0, -1, 0)),
        ({"roll": 90}, (-1, 0, 0), (0, 0, 1)),
        ({"roll": 180}, (0, -1, 0), (0, 0, 1)),
        ({"pitch": 90, "yaw": 90}, (1, 0, 0), (0, -1, 0)),
        ({"roll": 90, "pitch": 90}, (-1, 0, 0), (0, -1, 0)),
    ],
)
def test_roll_comes_first_then_pitch_then_yaw(
    angles: dict[str, float], top: tuple[float, ...], front: tuple[float, ...]
) -> None:
    """Where what was above and what was in front of an object's origin goes; positions stay."""
    inner = [{"asset": "box", "position": place} for place in ([0, 1, 0], [0, 0, 1], [0, 0, 0])]
    scene = scene_of([{"group": {"position": [3, 2, 1], "objects": inner, **angles}}])
    np.testing.assert_allclose(scene.objects.position - [3, 2, 1], [top, front, (0, 0, 0)], atol=1e-6)
    np.testing.assert_allclose(matrices_of(scene)[:, :3, 1], np.tile(top, (3, 1)), atol=1e-6)


def test_objects_turn_as_cameras_do() -> None:
    scene = scene_of([{"asset": "box", "yaw": 35, "pitch": -50}])
    backward = -np.array(direction(math.radians(35), math.radians(-50)))
    np.testing.assert_allclose(matrices_of(scene)[0, :3, 2], backward, atol=1e-6)


def test_moving_a_nested_node_keeps_its_parents() -> None:
    inner = {"group": {"objects": [{"asset": "box"}]}}
    scene = scene_of([{"asset": "box"}, {"group": {"position": [5, 0, 0], "scale": 2, "objects": [inner]}}])
    assert set_node_transform(scene, 2, (1, 0, 0), UPRIGHT, 3.0) == slice(1, 2)
    assert scene.objects.position.tolist() == [[0, 0, 0], [7, 0, 0]]
    assert scene.objects.scale.tolist() == [1, 6]
    set_node_transform(scene, 1, (0, 0, 0), UPRIGHT, 1.0)
    assert scene.objects.position.tolist() == [[0, 0, 0], [1, 0, 0]]


def test_bad_transforms_are_refused() -> None:
    scene = scene_of([{"asset": "box"}])
    with pytest.raises(ValueError, match="positive"):
        set_node_transform(scene, 0, (0, 0, 0), UPRIGHT, 0.0)
    with pytest.raises(ValueError, match="finite"):
        set_node_transform(scene, 0, (math.nan, 0, 0), UPRIGHT, 1.0)
    with pytest.raises(ValueError, match="finite"):
        set_node_transform(scene, 0, (0, 0, 0), (0.0, math.inf, 0.0), 1.0)
    with pytest.raises(IndexError):
        set_node_transform(scene, 1, (0, 0, 0), UPRIGHT, 1.0)
    assert scene.objects.position.tolist() == [[0, 0, 0]]
