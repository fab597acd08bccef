"""Saving values into scene files."""

import json
import os
import stat
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthwalk.errors import InputError
from depthwalk.scene.document import parse_document
from depthwalk.scene.saved_values import bytes_with_values, count_text, is_writable, leaves, save_values
from depthwalk.scene.schema import SceneFile
from depthwalk.scene.validate import check_model

SCENE = """\
# A court. ä
version: 1
environment:
  sun: {direction: [-0.4, -0.8, -0.6], intensity: 1.0}  # noon
  fog: {density: 0.01, colour: [0.2, 0.4, 0.6]}
render:
  aa: fxaa  # fast
  shadows:
    enabled: true

camera: {position: [0, 1, 5], target: [0, 1, 0], fov: 50}
"""
VALUES = {
    "camera": {"fov": 40.0},
    "environment": {"sun": {"intensity": 2.5}, "fog": {"colour": "#ff0000"}, "background": [0.1, 0.2, 0.3]},
    "walk": {"speed": 1.4},
    "render": {"aa": "gpaa-edge", "shadows": {"distance": 40.3}, "dof": {"mode": "gather"}},
}
SAVED = """\
# A court. ä
version: 1
environment:
  sun: {direction: [-0.4, -0.8, -0.6], intensity: 2.5}  # noon
  fog: {density: 0.01, colour: [1, 0, 0]}
  background: [0.1, 0.2, 0.3]
render:
  aa: gpaa-edge  # fast
  shadows:
    enabled: true
    distance: 40.3
  dof: {mode: gather}

camera: {position: [0, 1, 5], target: [0, 1, 0], fov: 40}

walk: {speed: 1.4}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "scene.yaml"
    path.write_bytes(SCENE.encode())
    return path


def scene_of(path: Path) -> SceneFile:
    return check_model(parse_document(path.read_text(encoding="utf-8-sig"), str(path)), SceneFile)[0]


def refused(file: Path, values: dict[str, Any]) -> str:
    """Why values cannot be saved in a file, which then stays as it is, without anything beside it."""
    before = file.read_bytes() if file.exists() else None, sorted(os.listdir(file.parent))
    with pytest.raises(InputError) as error:
        save_values(file, values)
    assert (file.read_bytes() if file.exists() else None, sorted(os.listdir(file.parent))) == before
    return str(error.value)


def test_only_the_values_change_in_the_text(file: Path) -> None:
    save_values(file, VALUES)
    assert file.read_text(encoding="utf-8") == SAVED
    scene = scene_of(file)
    assert scene.render.aa == "gpaa-edge" and scene.render.shadows.distance == 40.3
    assert scene.camera is not None and scene.camera.fov == 40
    save_values(file, VALUES)
    assert file.read_text(encoding="utf-8") == SAVED
    assert count_text(VALUES) == "8 values" and count_text({"a": {"b": 1}}) == "1 value"


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("line_break", [b"\n", b"\r\n"])
@pytest.mark.parametrize("end", [b"", b"\n\n"])
def test_mark_line_breaks_and_the_end_stay(file: Path, mark: bytes, line_break: bytes, end: bytes) -> None:
    file.write_bytes(mark + SCENE.rstrip().encode().replace(b"\n", line_break) + end.replace(b"\n", line_break))
    save_values(file, VALUES)
    saved = SAVED.rstrip().encode().replace(b"\n", line_break)
    assert file.read_bytes() == mark + saved + end.replace(b"\n", line_break)


def test_permissions_and_links_stay(file: Path, tmp_path: Path) -> None:
    file.chmod(0o640)
    link = tmp_path / "link.yaml"
    link.symlink_to(file.name)
    save_values(link, VALUES)
    assert link.is_symlink() and file.read_text(encoding="utf-8") == SAVED
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
    assert sorted(os.listdir(tmp_path)) == ["link.yaml", "scene.yaml"]


def test_former_names_of_keys_stay(file: Path) -> None:
    file.write_text("version: 1\nrender: {dof: {largest: 4}}\n")
    save_values(file, {"render": {"dof": {"max_blur": 6.0}}})
    assert file.read_text() == "version: 1\nrender: {dof: {largest: 6}}\n"


def test_a_file_that_was_broken_since_it_was_loaded_is_refused(file: Path) -> None:
    assert "render: is empty" in refused_after(file, "version: 1\nrender:\n", {"walk": {"speed": 1.0}})


def refused_after(file: Path, text: str, values: dict[str, Any]) -> str:
    file.write_text(text)
    return refused(file, values)


def test_a_preset_stays_what_the_file_does_not_say(file: Path) -> None:
    file.write_text("version: 1\nrender: {preset: paper}\n")
    save_values(file, {"render": {"culling": {"occlusion": True}}})
    render = scene_of(file).render
    assert render.culling.occlusion and render.warp.tile_mapping == "plane" and render.lod.mode == "paper"


@pytest.mark.parametrize(
    ("text", "values", "message"),
    [
        ("version: 1\nrender: {aa: fxaaa}\n", VALUES, "scene.yaml:2:14: render.aa"),
        ("version: 1\nrender: {\n", VALUES, "not valid YAML"),
        ("", VALUES, "the file is empty"),
        ("[1]", VALUES, "must be a mapping"),
        ("version: 1\n", {"environment": {"fog": {"height": 2.0}}}, "has no environment.fog: an option gave it"),
        ("version: 1\n", {"camera": {"fov": 40.0}}, "has no camera: an option gave it"),
        ("version: 1\n", {"render": {"aa": "many"}}, "the file would not be valid any more:"),
        ("version: 1\nrender: {shadows: &s {lamps: 1}}\n", {"render": {"shadows": {"distanc": 4.0}}}, "unknown key"),
        (
            "version: 1\nenvironment: {sun: {colour: &c [1, 1, 1]}, ambient: {colour: *c}}\n",
            {"environment": {"ambient": {"colour": "#ff0000"}}},
            r"2:62: environment.ambient.colour is an alias of &c",
        ),
        (
            "version: 1\nenvironment: {sun: {colour: &c [1, 1, 1]}, ambient: {colour: *c}}\n",
            {"environment": {"sun": {"colour": "#ff0000"}}},
            r"environment.sun.colour is used elsewhere as *c",
        ),
        (
            "version: 1\nenvironment: {sky: {model: image, image: sky.hdr}}\n",
            {"environment": {"sky": {"model": "gradient"}}},
            "'image' is only for 'model: image'",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_saved_is_refused(file: Path, text: str, values: dict[str, Any], message: str) -> None:
    file.write_text(text)
    assert message in refused(file, values)


def test_a_file_that_cannot_be_written_or_read_is_refused(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file.chmod(0o444)
    assert not is_writable(file) and "is read-only" in refused(file, VALUES)
    file.chmod(0o644)
    assert is_writable(file)
    file.write_bytes(b"version: 1\n# \xff\n")
    assert "not UTF-8 text" in refused(file, VALUES)

    def full(path: Path, to: Path) -> None:
        raise OSError(28, "No space left on device", str(path))

    file.write_text(SCENE, encoding="utf-8")
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        assert "No space left" in refused(file, VALUES)
    file.unlink()
    assert "no such file" in refused(file, VALUES) and not is_writable(file)


def test_the_present_text_is_edited(file: Path) -> None:
    file.write_text(SCENE.replace("# noon", "# evening").replace("aa: fxaa", "fused: false"), encoding="utf-8")
    save_values(file, VALUES)
    text = file.read_text(encoding="utf-8")
    assert "# evening" in text and "fused: false  # fast" in text and "  aa: gpaa-edge" in text


GROUPS = {
    "environment": {
        "background": st.just("#102030"),
        "sun": {"intensity": st.floats(0, 100, width=16), "direction": st.just([0.5, -0.5, 0.25])},
        "ambient": {"colour": st.sampled_from(["#a0b0c0", [0.25, 0.5, 0.75]])},
    },
    "walk": {"speed": st.one_of(st.none(), st.floats(0.5, 100, width=16)), "collide": st.booleans()},
    "render": {
        "aa": st.sampled_from(["none", "fxaa", "gpaa-edge"]),
        "shadows": {"enabled": st.booleans(), "cascades": st.integers(1, 4), "distance": st.floats(1, 500, width=16)},
        "reprojection": {"mode": st.sampled_from(["auto", "on", "off"])},
        "lod": {"bias": st.floats(-2, 2, width=16)},
    },
}


def some_of(groups: dict[str, Any]) -> st.SearchStrategy[dict[str, Any]]:
    """Mappings with any of these keys."""
    inner = {key: some_of(each) if isinstance(each, dict) else each for key, each in groups.items()}
    return st.fixed_dictionaries({}, optional=inner)


def text_of(values: dict[str, Any], indent: int, draw: st.DrawFn) -> str:
    lines = []
    for key, value in values.items():
        pad, note = " " * indent, draw(st.sampled_from(["", "  # note"]))
        if isinstance(value, dict) and value and draw(st.booleans()):
            lines.append(f"{pad}{key}:{note}\n{text_of(value, indent + 2, draw)}")
        else:  # JSON is YAML in flow style
            lines.append(f"{pad}{key}: {json.dumps(value)}{note}\n")
        lines.append(draw(st.sampled_from(["", "\n", f"{pad}# about {key}\n"])))
    return "".join(lines)


@st.composite
def scene_texts(draw: st.DrawFn) -> str:
    return "version: 1\n" + text_of(draw(some_of(GROUPS)), 0, draw)


@given(scene_texts(), some_of(GROUPS))
def test_a_scene_gets_exactly_the_values(tmp_path: Path, text: str, values: dict[str, Any]) -> None:
    path = tmp_path / "any.yaml"
    path.write_text(text, encoding="utf-8")
    before = scene_of(path).model_dump()
    path.write_bytes(bytes_with_values(path, values))
    after = scene_of(path).model_dump()
    for place, value in leaves(values):
        *groups, name = place
        old, new = before, after
        for key in groups:
            old, new = old[key], new[key]
        if place[-1] in ("background", "colour"):
            colour = value if isinstance(value, list) else [int(value[k : k + 2], 16) / 255 for k in (1, 3, 5)]
            assert new[name] == pytest.approx(colour, rel=1e-6)
        else:
            assert new[name] == (tuple(value) if isinstance(value, list) else value)
        old[name] = new[name]
    assert after == before
    saved = path.read_text(encoding="utf-8")
    assert [line for line in saved.splitlines() if line.lstrip().startswith("#")] == [
        line for line in text.splitlines() if line.lstrip().startswith("#")
    ]
    assert saved.count("# note") == text.count("# note")
