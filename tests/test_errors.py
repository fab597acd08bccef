"""Help with misspelt words."""

import pickle
from pathlib import Path

import pytest

from depthwalk.errors import InputError, UnbakableError, counted, missing_file, suggest, suggest_file
from depthwalk.scene.loader import load_scene


def test_the_closest_word_is_suggested() -> None:
    assert suggest("colour_", ["colour", "collar", "floor"]) == "; did you mean 'colour'?"


def test_nothing_is_suggested_where_nothing_is_close() -> None:
    assert suggest("xyz", ["colour", "floor"]) == suggest("colour", []) == ""


def test_a_misspelt_file_is_told_which_one_is_meant(tmp_path: Path) -> None:
    """The file of the same ending that is spelt much like it is named; a folder or a lone name is told as it is."""
    for name in ("garden.yaml", "guarded.ply", "room.yaml"):
        (tmp_path / name).touch()
    assert "download it" in str(missing_file(Path("https://example.com/a.glb")))
    assert str(missing_file(tmp_path / "gardn.yaml")) == (
        f"{tmp_path / 'gardn.yaml'}: no such file; did you mean 'garden.yaml'?"
    )
    assert str(missing_file(tmp_path / "night.yaml")) == f"{tmp_path / 'night.yaml'}: no such file"
    assert str(missing_file(tmp_path / "room.yml")).endswith("room.yml: no such file; did you mean 'room.yaml'?")
    assert str(missing_file(tmp_path / "room.ply")).endswith("room.ply: no such file")
    assert str(missing_file(tmp_path / "no" / "gardn.yaml")) == f"{tmp_path / 'no' / 'gardn.yaml'}: no such file"
    assert str(missing_file(tmp_path)) == f"{tmp_path}: is a folder"
    (link := tmp_path / "link.ply").symlink_to("gone.ply")
    assert str(missing_file(link)) == f"{link}: a link to 'gone.ply', which does not exist"


def test_neither_a_folder_nor_the_name_itself_is_meant(tmp_path: Path) -> None:
    (tmp_path / "tests").mkdir()
    (tmp_path / "gardens.yaml").mkdir()
    (tmp_path / "rooms").touch()
    assert suggest_file(tmp_path / "tests") == suggest_file(tmp_path / "test") == ""
    assert suggest_file(tmp_path / "garden.yaml") == suggest_file(tmp_path / "rooms") == ""
    assert suggest_file(tmp_path / "room") == "; did you mean 'rooms'?"


def test_numbers_have_the_noun_that_fits() -> None:
    assert [counted(number, "model") for number in (0, 1, 12000)] == ["0 models", "1 model", "12,000 models"]


def test_a_scene_is_told_which_of_its_files_is_meant(tmp_path: Path) -> None:
    (tmp_path / "bust.ply").touch()
    scene = tmp_path / "scene.yaml"
    scene.write_text("version: 1\nassets: {a: {mesh: bsut.ply}}\nobjects: [{asset: a}]\n")
    with pytest.raises(InputError, match=r"file 'bsut\.ply' not found; did you mean 'bust\.ply'\?"):
        load_scene(scene)


def test_messages_hold_nothing_that_a_terminal_obeys() -> None:
    error = InputError("a\x1b[31m.yaml: bad\n/etc/passwd: ok", "grün\u202e.obj: cannot be read")
    assert str(error) == "a\\x1b[31m.yaml: bad\\n/etc/passwd: ok\ngrün\\u202e.obj: cannot be read"
    assert str(pickle.loads(pickle.dumps(error))) == str(error)  # from one process to another


def test_the_reason_without_advice_survives_another_process() -> None:
    error = UnbakableError("a\x1b.obj: is flat", "draw polygons")
    for copy in (error, pickle.loads(pickle.dumps(error))):
        assert (str(copy), copy.reason) == ("a\\x1b.obj: is flat; draw polygons", "a\\x1b.obj: is flat")


def test_another_ending_of_the_same_kind_is_suggested(tmp_path: Path) -> None:
    """The same ending comes first; that of something else never comes. Without one, a scene is meant before a mesh."""
    for name in ("court.yaml", "court.ply", "leaf.jpeg"):
        (tmp_path / name).touch()
    for wrong, meant in (
        ("court.yml", "court.yaml"),
        ("leaf.jpg", "leaf.jpeg"),
        ("cuort.PLY", "court.ply"),
        ("court", "court.yaml"),
    ):
        assert str(missing_file(tmp_path / wrong)).endswith(f": no such file; did you mean {meant!r}?")
    for wrong in ("court.png", "cuort"):
        assert str(missing_file(tmp_path / wrong)) == f"{tmp_path / wrong}: no such file"
