"""Help with misspelt words."""

import pickle
from pathlib import Path

import pytest

from depthwalk.errors import (
    InputError,
    UnbakableError,
    counted,
    foreign_name,
    missing_file,
    suggest,
    suggest_file,
)
from depthwalk.files import check_folder
from depthwalk.scene.loader import load_scene


def test_the_closest_word_is_suggested() -> None:
    assert suggest("colour_", ["colour", "collar", "floor"]) == "; did you mean 'colour'?"


def test_nothing_is_suggested_where_nothing_is_close() -> None:
    assert suggest("xyz", ["colour", "floor"]) == suggest("colour", []) == ""


def test_a_misspelt_file_is_told_which_one_is_meant(tmp_path: Path) -> None:
    """The file of the same ending that is spelt much like it is named; a folder or a lone name is told as it is."""
    for name in ("garden.yaml", "guarded.ply", "room.yaml"):
        (tmp_path / name).touch()
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


ADDRESS = "addresses are not opened: name a file on this machine"
HOME = "'~' means the home folder only to a shell: write the folder's name"
FOREIGN = [
    ("https://example.org/a.ply", ADDRESS),
    ("S3://store/models/a.ply", ADDRESS),
    ("file:///home/ada/a.ply", "addresses are not opened: leave out 'file://'"),
    ("~/a.ply", HOME),
    ("~ada/models/a.ply", HOME),
    ("models\\a.ply", "write 'models/a.ply': folders are separated by '/'"),
]


@pytest.mark.parametrize(("name", "hint"), FOREIGN)
def test_names_for_other_programs_are_told_as_they_were_given(
    name: str, hint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same hint is given for files that the user names, that a scene names, and that are to be written."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.ply").touch()  # is not what is meant
    assert str(missing_file(Path(name))) == f"{name}: no such file; {hint}"
    scene = tmp_path / "scene.yaml"
    scene.write_text(f"version: 1\nassets: {{a: {{mesh: '{name}'}}}}\nobjects: [{{asset: a}}]\n")
    with pytest.raises(InputError) as found:
        load_scene(scene)
    assert str(found.value).endswith(f": assets.a.mesh: file {name!r} not found; {hint}")
    if "\\" not in name:  # which is a letter like others in the name of a new file
        with pytest.raises(InputError) as found:
            check_folder(Path(name))
        folder = name.rpartition("/")[0]
        assert str(found.value) == f"{name}: the folder {folder!r} does not exist; {hint}"
    with pytest.raises(InputError) as found:
        load_scene(scene, [name])
    assert str(found.value) == f"--asset-root {name}: no such folder; {hint}"


def test_names_that_only_resemble_those_are_told_as_missing(tmp_path: Path) -> None:
    """A backup `~a.ply` is in no home folder, `C:a` is on a drive, and a folder may have a backslash in its name."""
    for name in ("~a.ply", "a~/b.ply", "C:a.ply", "a:b.ply", "odd\\folder/a.ply"):
        assert str(missing_file(tmp_path / name)) == f"{tmp_path / name}: no such file"
        assert foreign_name(Path(name)) == ""


def test_a_file_may_have_the_name_of_a_home_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "~").mkdir()
    check_folder(Path("~/a.png"))
    (tmp_path / "~" / "a.ply").touch()
    (tmp_path / "models\\b.ply").touch()
    scene = tmp_path / "scene.yaml"
    scene.write_text("version: 1\nassets: {a: {mesh: ~/a.ply}, b: {mesh: 'models\\b.ply'}}\nobjects: [{asset: a}]\n")
    assert len(load_scene(scene).assets) == 2


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
