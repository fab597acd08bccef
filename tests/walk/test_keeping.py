"""Copying, saving and undoing what differs from the scene's file."""

import math
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from imgui_bundle import imgui
from imgui_bundle._imgui_bundle.imgui import IO
from PIL import Image

from depthwalk.errors import InputError
from depthwalk.params import Params
from depthwalk.render.renderer import Renderer
from depthwalk.resources import scene_root
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from depthwalk.scene.saved_values import leaves
from depthwalk.walk import keeping, panel
from depthwalk.walk.controls import Walker
from depthwalk.walk.fields import controls_of
from depthwalk.walk.file_watch import state_of
from depthwalk.walk.files import opened_of, saved_to
from depthwalk.walk.keeping import keep, save_as_new
from depthwalk.walk.state import Keeping, State
from walks import FakeRenderer

SCENE = """\
version: 1
camera: {position: [0, 1, 5], target: [0, 1, 0], fov: 50}
walk: {speed: 2}
render: {aa: fxaa}  # fast
"""


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    return path


@pytest.fixture
def copied(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    texts: list[str] = []
    monkeypatch.setattr(keeping, "copy_text", lambda window, text: texts.append(text))
    return texts


def walk_in(path: Path) -> Any:
    """A walk through a scene, without a window, which collects the changes that its file watch is told of."""
    scene = load_scene(path)
    renderer = cast(Any, FakeRenderer())
    renderer.settings = scene.render
    home = scene.camera or Camera((0, 1, 5), (0, 1, 0))
    state = State(scene, cast(Renderer, renderer), Walker.at(home), home)
    state.arrive()
    own: list[object] = []
    return SimpleNamespace(window=None, state=state, own=own, note_own_change=own.append)


def test_what_differs_is_copied_as_lines_of_a_scene_file(scene_file: Path, copied: list[str]) -> None:
    walk = walk_in(scene_file)
    keep(walk, Keeping.COPY)
    assert not copied and walk.state.toast == "Nothing differs from scene.yaml"
    walk.state.scene.render.shadows.enabled = True
    walk.state.scene.render.aa = "none"
    keep(walk, Keeping.COPY)
    assert copied == ["render:\n  aa: none\n  shadows: {enabled: true}"] and "Copied 2 values" in walk.state.toast


def test_what_is_saved_is_the_files_own_from_then_on(scene_file: Path) -> None:
    walk = walk_in(scene_file)
    state, before = walk.state, state_of(scene_file)
    state.scene.render.aa = "none"
    state.set_fov(math.radians(40))
    state.set_speed(1.5)
    keep(walk, Keeping.SAVE)
    assert state.toast == "Saved 3 values in scene.yaml" and state.changed == {}
    text = scene_file.read_text()
    assert text == SCENE.replace("fov: 50", "fov: 40").replace("speed: 2", "speed: 1.5").replace("aa: fxaa", "aa: none")
    (own,) = walk.own
    assert (own.file, own.before, own.after) == (scene_file, before, state_of(scene_file))
    state.go_home()  # as the file has it now
    assert state.camera.fov == pytest.approx(math.radians(40)) and state.changed == {}
    keep(walk, Keeping.UNDO)
    assert state.scene.render.aa == "none" and "Nothing differs" in state.toast


def test_undoing_returns_to_the_file(scene_file: Path) -> None:
    walk = walk_in(scene_file)
    state = walk.state
    state.scene.render.aa = "none"
    state.set_fov(math.radians(40))
    state.set_speed(1.5)
    keep(walk, Keeping.UNDO)
    assert state.scene.render.aa == "fxaa" and state.walker.speed == state.scene.walk.speed == 2
    assert state.camera.fov == pytest.approx(math.radians(50)) and state.changed == {}
    assert state.toast.startswith("Undone: 3 values") and scene_file.read_text() == SCENE


def test_the_wheel_and_home_change_nothing_that_is_kept(scene_file: Path) -> None:
    state = walk_in(scene_file).state
    state.wheel(2)
    assert state.walker.speed > 2 and state.changed == {}
    state.set_fov(math.radians(40))
    assert state.changed == {"camera": {"fov": 40.0}}
    state.go_home()
    assert state.changed == {}


@pytest.mark.parametrize(
    ("text", "message"),
    [("version: 1\nrender: {aa: fxaaa}\n", "render.aa"), ("version: 1\nrender: {", "YAML"), (None, "no such file")],
)
def test_a_file_that_became_useless_is_told_and_left(scene_file: Path, text: str | None, message: str) -> None:
    walk = walk_in(scene_file)
    walk.state.scene.render.aa = "none"
    scene_file.unlink()
    if text is not None:
        scene_file.write_text(text)
    keep(walk, Keeping.SAVE)
    assert "Nothing was saved" in walk.state.toast and message in walk.state.toast and not walk.own
    assert walk.state.changed and (scene_file.read_text() if text is not None else None) == text


def test_where_values_are_saved(scene_file: Path, tmp_path: Path) -> None:
    assert saved_to(scene_file) == "file"
    scene_file.chmod(0o444)
    assert saved_to(scene_file) == "new file"
    assert saved_to(scene_root() / "room.yaml") == "new file"
    assert saved_to(tmp_path / "bust.ply") == saved_to(tmp_path / "bust.dpci.npz") == "nowhere"


def test_a_read_only_file_is_copied_beside_it(
    scene_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (elsewhere := tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(elsewhere)
    scene_file.chmod(0o444)
    walk = walk_in(scene_file)
    walk.state.scene.render.aa = "none"
    keep(walk, Keeping.SAVE)
    (copy,) = tmp_path.glob("depthwalk-*.yaml")
    assert copy.read_text() == SCENE.replace("aa: fxaa", "aa: none") and str(copy) in walk.state.toast
    assert scene_file.read_text() == SCENE and walk.state.changed and not walk.own


def test_a_shipped_scene_is_copied_to_the_working_directory_with_its_models(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    scene = load_scene(scene_root() / "room.yaml")
    shipped = scene.path.read_bytes()
    copy = save_as_new(scene, {"render": {"aa": "fxaa"}})
    assert copy.parent == tmp_path and [file.name for file in tmp_path.iterdir()] == [copy.name]
    again = load_scene(copy)
    assert again.assets == scene.assets and again.render.aa == "fxaa" and scene.path.read_bytes() == shipped


def test_a_copy_that_would_show_other_models_is_refused(
    tmp_path: Path, scene_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    models = tmp_path / "models"
    models.mkdir()
    (models / "ball.ply").write_bytes(b"ply")
    scene_file.write_text("version: 1\nassets: {ball: {mesh: ball.ply}}\n")
    scene = load_scene(scene_file, [models])
    files = sorted(os.listdir(tmp_path))
    with pytest.raises(InputError, match=r"ball\.ply"):  # found by an option only
        save_as_new(scene, {"render": {"aa": "none"}})
    (tmp_path / "ball.ply").write_bytes(b"another")
    with pytest.raises(InputError, match="other models"):
        save_as_new(scene, {"render": {"aa": "none"}})
    assert sorted(os.listdir(tmp_path)) == sorted([*files, "ball.ply"])


@pytest.mark.parametrize("part", ["sky: {model: image, image: picture.png}", "ground: {texture: picture.png, tile: 1}"])
def test_a_copy_that_would_show_another_sky_or_ground_is_refused(tmp_path: Path, scene_file: Path, part: str) -> None:
    models = tmp_path / "models"
    models.mkdir()
    for folder, grey in (models, 10), (tmp_path, 200):
        Image.new("RGB", (4, 2), (grey, grey, grey)).save(folder / "picture.png")
    scene_file.write_text(f"version: 1\nenvironment: {{{part}}}\n")
    (tmp_path / "picture.png").rename(tmp_path / "later.png")
    scene = load_scene(scene_file, [models])
    (tmp_path / "later.png").rename(tmp_path / "picture.png")
    with pytest.raises(InputError, match="other models"):
        save_as_new(scene, {"render": {"aa": "none"}})


def rows_of(io: IO, state: State, width: int) -> dict[str, tuple[float, float, float, float]]:
    """The places of the row of changed values: of its buttons, and "end", where the next row begins."""
    places = {}
    button = imgui.button

    def noted(label: str, *values: Any) -> bool:
        pressed = button(label, *values)
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        places[label] = low.x, low.y, high.x, high.y
        return pressed

    io.display_size = imgui.ImVec2(width, 600)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("depthwalk.walk.panel.imgui.button", noted)
        for _ in range(2):
            imgui.new_frame()
            imgui.set_next_window_pos((0, 0))
            imgui.set_next_window_size((min(width, 340), 300))
            imgui.begin("Settings")
            panel._draw_changes(state, narrow=width < 340)
            y = imgui.get_cursor_screen_pos().y
            imgui.end()
            imgui.render()
    return places | {"end": (0, y, 0, y)}


def vary(group: Params) -> None:
    """Change a number of a group, if it has any."""
    for control in controls_of(type(group)):
        if control.kind == "number" and getattr(group, control.name) != control.high:
            setattr(group, control.name, control.high)
            return


@pytest.mark.parametrize("width", [220, 340])
def test_the_row_has_the_same_height_with_and_without_changes(overlay_io: IO, scene_file: Path, width: int) -> None:
    state = walk_in(scene_file).state
    before = rows_of(overlay_io, state, width)
    state.scene.render.aa = "none"
    after = rows_of(overlay_io, state, width)
    assert list(before) == ["end"] and before["end"] == after["end"]
    assert list(after) == ["Copy", "Save", "Undo", "end"]
    scene_file.chmod(0o444)
    state = walk_in(scene_file).state
    for name, group in state.scene.render:  # the widest that it gets, but for three digits
        if isinstance(group, Params) and name not in ("parallax", "distance", "light", "inspection"):
            vary(group)
    assert len(list(leaves(state.changed))) in range(10, 100)
    row = rows_of(overlay_io, state, width)
    assert list(row) == ["Copy", "Save copy", "Undo", "end"] and row["Undo"][2] <= width - 12 - 14  # and a scroll bar


def test_a_model_by_itself_can_be_copied_only(overlay_io: IO, tmp_path: Path, scene_file: Path) -> None:
    walk = walk_in(scene_file)
    walk.state.saved_to = "nowhere"
    walk.state.scene.render.aa = "none"
    assert list(rows_of(overlay_io, walk.state, 340)) == ["Copy", "Undo", "end"]
    keep(walk, Keeping.SAVE)
    assert "without a scene file" in walk.state.toast and scene_file.read_text() == SCENE


@pytest.mark.parametrize("model", ["gradient", "preetham"])
def test_a_sky_without_its_picture_is_saved(tmp_path: Path, scene_file: Path, model: Any) -> None:
    """What the file says of the picture gets its default; the picture is kept for the rest of the walk."""
    Image.new("RGB", (4, 2)).save(tmp_path / "picture.png")
    sky_text = "sky: {model: image, image: picture.png, turn: 30, sun: true, light: true}  # ours"
    scene_file.write_text(f"version: 1\nenvironment:\n  {sky_text}\n")
    walk = walk_in(scene_file)
    sky = walk.state.scene.environment.sky
    sky.model = model
    keep(walk, Keeping.SAVE)
    assert walk.state.toast.startswith("Saved 4 values"), walk.state.toast
    saved = f"sky: {{model: {model}, image: null, turn: 0, sun: false, light: true}}  # ours"
    assert scene_file.read_text() == f"version: 1\nenvironment:\n  {saved}\n"
    read = load_scene(scene_file).environment.sky
    assert read is not None and read.model == model and walk.state.changed == {}
    sky.model = "image"
    assert sky.image.name == "picture.png" and walk.state.changed["environment"]["sky"]["model"] == "image"
    walk.state.undo_changes()
    assert sky.model == model and walk.state.changed == {}


@pytest.mark.parametrize(
    ("files", "opened", "left_out"),
    [
        ("a.ply", "a.ply", ""),
        ("a.yaml", "a.yaml", ""),
        ("a.txt", "a.txt", ""),  # which is told when it is read
        ("a.ply b.OBJ", "a.ply b.OBJ", ""),
        ("a.mtl a.obj a.png", "a.obj", ""),
        ("a.bin a.gltf b.ply a.jpg", "a.gltf b.ply", ""),
        ("a.ply b.yaml c.txt", "a.ply", "b.yaml and 1 more"),
        ("a.yaml b.yaml", "a.yaml", "b.yaml"),
        ("a.yaml b.ply", "a.yaml", "b.ply"),
        ("a.png b.yaml", "b.yaml", "a.png"),
        ("a.txt b.ply", "b.ply", "a.txt"),
    ],
)
def test_of_several_dropped_files_what_can_be_shown_is_opened_and_the_rest_told(
    files: str, opened: str, left_out: str
) -> None:
    shown, told = opened_of([Path(file) for file in files.split()])
    assert shown == tuple(map(Path, opened.split()))
    assert told == (f"Not opened: {left_out}. A window shows one scene, or several meshes" if left_out else "")
