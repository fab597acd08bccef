"""Whatever a file holds, the loaders either load it or raise InputError."""

from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from depthwalk.errors import InputError
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.scene.schema import SceneFile

SCENE = (
    b"version: 1\nassets: {box: {mesh: box.obj, dpci: {resolution: 64}}}\nobjects:\n"
    b"- {asset: box, position: [0, 1, 0], yaw: 30}\n- {grid: {asset: box, count: [2, 3], spacing: [1, 2]}}\n"
    b"- {group: {objects: [{scatter: {asset: box, count: 9, area: [9, 9], seed: 1}}]}}\n"
    b"environment: {background: '#202020', sky: {}, sun: {direction: [0, -1, 0]}}\n"
    b"camera: &c {position: [0, 1, 2], target: [0, 0, 0]}\nrender: {lod: {bias: 1.5}}\n"
)
WORDS = sorted(
    {key for node in SceneFile.model_json_schema()["$defs"].values() for key in node.get("properties", {})}
    | set(SceneFile.model_fields)
    | {"box", "box.obj", "dpci", "#ffffff", "keyframes", "fps", "time", "\x1fgrid", "<<"}
)
PLAIN = st.none() | st.booleans() | st.integers() | st.floats() | st.sampled_from(WORDS) | st.text(max_size=5)
VALUES = st.recursive(
    PLAIN,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(WORDS), inner, max_size=5),
    max_leaves=25,
)
YAML_PIECES = st.lists(
    st.sampled_from([*"[]{}:,-?&*!|>'\"%@`#\n \t~", "&a", "*a", "!!int", "!!float", "!!binary", "- ", ": ", "---\n",
                     "...\n", "%YAML 1.1\n", "%TAG ! x\n", "0x", "0b", "0o8", ".inf", "1e999", "1_", "<<", "2001-01-01",
                     '"\\ud800"', '"\\x00"', '"\\U00110000"', "version: 1\n", "\ufeff", "\x85"]),
    max_size=20,
).map("".join)  # fmt: skip


def load_all(folder: Path, data: bytes) -> None:
    """Load as a scene and as a path: InputError with one line per mistake is the only way to fail."""
    (folder / "box.obj").touch()
    path = folder / "x.yaml"
    path.write_bytes(data)
    for load in (load_scene, load_path):
        try:
            load(path)
        except InputError as error:
            for line in str(error).split("\n"):
                assert line.startswith((str(path), "... and")), line
                assert line.isprintable(), line


def test_the_seed_scene_loads(tmp_path: Path) -> None:
    (tmp_path / "box.obj").touch()
    (tmp_path / "x.yaml").write_bytes(SCENE)
    assert len(load_scene(tmp_path / "x.yaml").objects) == 1 + 6 + 9


@given(data=st.binary(max_size=60))
def test_random_bytes(tmp_path: Path, data: bytes) -> None:
    load_all(tmp_path, data)


@given(text=YAML_PIECES)
def test_random_yaml_pieces(tmp_path: Path, text: str) -> None:
    load_all(tmp_path, text.encode())


@pytest.mark.slow
@given(edits=st.lists(st.tuples(st.integers(0, len(SCENE) - 1), st.binary(max_size=2)), min_size=1, max_size=3))
def test_a_scene_with_bytes_changed(tmp_path: Path, edits: list[tuple[int, bytes]]) -> None:
    data = SCENE
    for place, replacement in edits:
        data = data[:place] + replacement + data[place + 1 :]
    load_all(tmp_path, data)


@pytest.mark.slow
@given(values=st.dictionaries(st.sampled_from([*sorted(SceneFile.model_fields), "keyframes", "fps"]), VALUES))
def test_random_values_under_known_keys(tmp_path: Path, values: dict[str, Any]) -> None:
    path = tmp_path / "dump.yaml"
    with path.open("w", encoding="utf-8", errors="replace") as file:
        yaml.safe_dump({**values, "version": 1}, file)
    load_all(tmp_path, path.read_bytes())


@pytest.mark.slow
@given(key=st.lists(st.sampled_from([*WORDS, "0", "1", "-1", "", "x[0]"]), max_size=4).map(".".join), text=YAML_PIECES)
def test_random_overrides(tmp_path: Path, key: str, text: str) -> None:
    (tmp_path / "box.obj").touch()
    path = tmp_path / "x.yaml"
    path.write_bytes(SCENE)
    try:
        load_scene(path, overrides={key: text})
    except InputError as error:
        assert "--set" in str(error)


def test_a_long_list_of_mistakes_is_cut(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.write_text("version: 1\nobjects:\n" + "- 1\n" * 50)
    with pytest.raises(InputError) as caught:
        load_scene(path)
    lines = str(caught.value).splitlines()
    assert len(lines) == 21
    assert lines[-1] == "... and 30 more"
