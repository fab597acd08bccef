"""Files of places: both kinds, their units, and every way in which they may be wrong."""

import time
from pathlib import Path

import numpy as np
import pytest

import depthwalk.scene.places as places
from depthwalk.errors import InputError
from depthwalk.scene.loader import load_scene
from depthwalk.scene.places import read_places
from depthwalk.scene.scene import Scene
from depthwalk.scene.similarity import from_yaw
from depthwalk.types import Array

RULE = ": the first line must name the columns x, y, z, and may name yaw, scale, pitch, roll, once each"
SCENE = "version: 1\nassets: {baked: {mesh: box.obj, dpci: {}}}\nobjects:\n  - "


def scene_of(folder: Path, item: str) -> Scene:
    (folder / "box.obj").touch()
    (folder / "scene.yaml").write_text(SCENE + item + "\n")
    return load_scene(folder / "scene.yaml")


def test_text_names_its_columns_in_any_order(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("\ufeffyaw, z,x,y\r\n90,3,1,2\r\n-45,6,4,5e0\r\n\r\n", "utf-8")
    read = read_places(tmp_path / "a.csv")
    np.testing.assert_array_equal(read.position, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_allclose(read.rotation, from_yaw(np.radians([90, -45])), atol=1e-6)
    np.testing.assert_array_equal(read.scale, [1, 1])
    assert {array.dtype for array in (read.position, read.rotation, read.scale)} == {np.dtype(np.float32)}


@pytest.mark.parametrize("separator", [",", ";", "\t", " ; "])
def test_spreadsheets_may_separate_by_semicolons_or_tabs(tmp_path: Path, separator: str) -> None:
    """And name columns in capitals."""
    (tmp_path / "a.csv").write_text("\n".join(separator.join(row) for row in (["X", "Z", "Yaw", "Y"], list("1392"))))
    read = read_places(tmp_path / "a.csv")
    np.testing.assert_array_equal(read.position, [[1, 2, 3]])
    np.testing.assert_allclose(read.rotation, from_yaw(np.radians([9])), atol=1e-6)


@pytest.mark.parametrize("columns", [3, 4, 5, 6, 7])
def test_arrays_are_read_as_text_is(tmp_path: Path, columns: int) -> None:
    names = ["x", "y", "z", "yaw", "scale", "pitch", "roll"][:columns]
    values = np.random.default_rng(columns).uniform(0.5, 9, (7, columns))
    np.save(tmp_path / "a.npy", values)
    rows = [",".join(names), *(",".join(f"{value:.17g}" for value in row) for row in values)]
    (tmp_path / "a.csv").write_text("\n".join(rows))
    read, same = read_places(tmp_path / "a.npy"), read_places(tmp_path / "a.csv")
    assert read.rotation[:, 0].any() == (columns > 5)
    for name in ("position", "rotation", "scale"):
        np.testing.assert_array_equal(getattr(read, name), getattr(same, name))


def test_a_node_moves_turns_and_scales_its_places(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x,y,z,yaw,scale\n1,0,0,0,2\n0,1,0,90,1\n")
    scene = scene_of(tmp_path, "places: {asset: baked, file: a.csv, position: [10, 0, 0], yaw: 90, scale: 3}")
    np.testing.assert_allclose(scene.objects.position, [[10, 0, -1], [10, 1, 0]], atol=1e-6)
    np.testing.assert_allclose(scene.objects.scale, [6, 3])


def test_places_turn_as_objects_do(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x,y,z,roll,yaw,pitch\n0,0,0,30,-70,200\n")
    listed = scene_of(tmp_path, "places: {asset: baked, file: a.csv}")
    written = scene_of(tmp_path, "{asset: baked, yaw: -70, pitch: 200, roll: 30}")
    np.testing.assert_allclose(listed.objects.rotation, written.objects.rotation, atol=1e-6)


def test_a_file_may_hold_no_places(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x,y,z\n")
    assert len(scene_of(tmp_path, "places: {asset: baked, file: a.csv}").objects) == 0


@pytest.mark.slow
def test_a_hundred_thousand_places_load_in_seconds(tmp_path: Path) -> None:
    values = np.random.default_rng(0).uniform(-99, 99, (100_000, 5)).clip(0.1)
    np.savetxt(tmp_path / "a.csv", values, "%.6g", ",", header="x,y,z,yaw,scale", comments="")
    start = time.process_time()
    assert len(scene_of(tmp_path, "places: {asset: baked, file: a.csv}").objects) == 100_000
    assert time.process_time() - start < 5


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", f":1{RULE}"),
        (
            "1,2,3\n",
            f":1: unknown column '1'{RULE}",
        ),
        ("x,y,z,yaws\n", ":1: unknown column 'yaws'; did you mean 'yaw'?"),
        (
            "x,y,x,z\n",
            f":1{RULE}",
        ),
        ("x;y;z\n1;2\n", ":2: has 2 columns, the first line 3"),
        ("x;y;z\n1;2,5;3\n", ":2: '2,5' is not a number; write 2.5"),
        ("x,y,z\n1,2,3\n\n4,5,6\n", ":3: has 0 columns, the first line 3"),
        ("x,y,z\n1,2,3\n4,5\n", ":3: has 2 columns, the first line 3"),
        ("x,y,z\n1,2,3,4\n", ":2: has 4 columns, the first line 3"),
        ("x,y,z\n1,2,three\n", ":2: 'three' is not a number"),
        ("x,y,z\n1,2,\n", ":2: '' is not a number"),
        ("x,y,z\n1,2,3\n1,nan,3\n", ":3: y is nan; it must be -1e+06 to 1e+06"),
        ("x,y,z\n1,2,1e9\n", ":2: z is 1e+09; it must be -1e+06 to 1e+06"),
        ("x,y,z,scale\n1,2,3,0\n", ":2: scale is 0; it must be 0.0001 to 10000"),
    ],
)
def test_wrong_text_is_told_by_its_line(tmp_path: Path, text: str, complaint: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError) as caught:
        read_places(tmp_path / "a.csv")
    assert str(caught.value) == f"{tmp_path / 'a.csv'}{complaint}"


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        (np.zeros((4, 2)), ": must be numbers of shape (n, 3 to 7), not float64 of (4, 2)"),
        (np.zeros(3), ": must be numbers of shape (n, 3 to 7), not float64 of (3,)"),
        (np.full((2, 3), "a"), ": must be numbers of shape (n, 3 to 7), not <U1 of (2, 3)"),
        (np.array([[0.0, 0, 0], [0, 0, np.inf]]), ":1: z is inf; it must be -1e+06 to 1e+06"),
    ],
)
def test_wrong_arrays_are_told_by_their_row(tmp_path: Path, values: Array, complaint: str) -> None:
    np.save(tmp_path / "a.npy", values)
    with pytest.raises(InputError) as caught:
        read_places(tmp_path / "a.npy")
    assert str(caught.value) == f"{tmp_path / 'a.npy'}{complaint}"


@pytest.mark.parametrize("name", ["a.npy", "a.csv"])
def test_garbage_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"\x93NUMPY\xff\xfe garbage")
    with pytest.raises(InputError, match=r"cannot be read as"):
        read_places(tmp_path / name)


@pytest.mark.parametrize("name", ["a.npy", "a.csv"])
def test_too_many_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setattr(places, "MAX_INSTANCES", 3)
    if name == "a.npy":
        np.save(tmp_path / name, np.zeros((4, 3)))
    else:
        (tmp_path / name).write_text("x,y,z\n" + "0,0,0\n" * 4)
    with pytest.raises(InputError, match="holds 4 places; the limit is 3"):
        read_places(tmp_path / name)
    monkeypatch.setattr(places, "MAX_PLACES_BYTES", 3)
    with pytest.raises(InputError, match="too large: the limit is 3 bytes"):
        read_places(tmp_path / name)


def test_a_missing_file_is_told_where_it_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"4:34: objects\[0\]\.places\.file: file 'a\.csv' not found"):
        scene_of(tmp_path, "places: {asset: baked, file: a.csv}")
