"""Cooked objects in files: read back as they were, apart by their options, and gone where damaged."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthwalk.array_file import SMALLEST, read_arrays, write_arrays
from depthwalk.cook import colour_pca
from depthwalk.cook.cook import COOK_VERSION, CookedObject, CookOptions, cook_object
from depthwalk.cook.cooked_file import cooked_key, find_cooked, keep_cooked, read_cooked, write_cooked
from depthwalk.errors import InputError
from shapes import bake, box, checkers, globe, joined, sphere


@pytest.fixture(scope="module")
def made() -> tuple[CookedObject, ...]:
    return tuple(cook_object(bake(mesh, 16, 1), CookOptions()) for mesh in (sphere(columns=32, rows=16), box(1, 1, 1)))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path


def test_objects_are_read_as_they_were(made: tuple[CookedObject, ...], folder: Path) -> None:
    kept = keep_cooked("abc", CookOptions(), made)
    found = find_cooked("abc", CookOptions())
    assert found is not None and len(found) == len(kept) == 2
    for before, after in zip(made, found, strict=True):
        np.testing.assert_array_equal(before.hull, after.hull)
        assert before.bytes == after.bytes and before.outline.cylinder == after.outline.cylinder
        for one, other in zip(before.load(), after.load(), strict=True):
            for name, value in vars(one).items():
                np.testing.assert_array_equal(value, getattr(other, name), err_msg=name)
                assert type(value) is type(getattr(other, name))


def test_how_many_triangles_the_mesh_has_is_kept(made: tuple[CookedObject, ...], folder: Path) -> None:
    """Of an object that tells it; any other number than one above 0 is damage."""

    def found(triangles: int | None) -> tuple[CookedObject, ...] | None:
        told = replace(made[0], outline=replace(made[0].outline, mesh_triangles=triangles))
        keep_cooked("abc", CookOptions(), (told,))
        return find_cooked("abc", CookOptions())

    for triangles in 12, None:
        objects = found(triangles)
        assert objects is not None and objects[0].outline.mesh_triangles == triangles
    assert found(0) is None


@pytest.mark.parametrize("interior", [False, True])
def test_whether_the_mesh_has_an_interior_is_kept(made: tuple[CookedObject, ...], folder: Path, interior: bool) -> None:
    told = replace(made[0], outline=replace(made[0].outline, has_interior=interior, keeps_normals=interior))
    keep_cooked("abc", CookOptions(), (told,))
    objects = find_cooked("abc", CookOptions())
    assert objects is not None and objects[0].outline.has_interior is interior
    assert objects[0].outline.keeps_normals is interior


def test_other_options_are_another_file(made: tuple[CookedObject, ...], folder: Path) -> None:
    keep_cooked("abc", CookOptions(), made)
    assert find_cooked("abc", CookOptions(stepped=True)) is None and find_cooked("abd", CookOptions()) is None
    (path,) = folder.rglob("*.npz")
    assert f"abc-cook{COOK_VERSION}" in path.name


def test_a_file_that_has_gone_cannot_be_loaded(made: tuple[CookedObject, ...], folder: Path) -> None:
    (kept, _) = keep_cooked("abc", CookOptions(), made)
    (path,) = folder.rglob("*.npz")
    path.unlink()
    assert find_cooked("abc", CookOptions()) is None
    with pytest.raises(OSError):
        kept.load()


def test_a_damaged_file_is_none(made: tuple[CookedObject, ...], folder: Path) -> None:
    keep_cooked("abc", CookOptions(), made)
    (path,) = folder.rglob("*.npz")
    path.write_bytes(b"PK\x03\x04")
    assert find_cooked("abc", CookOptions()) is None


@pytest.mark.parametrize("document", ["[" * 100_000 + "]" * 100_000, '{"version": ' + "[" * 900 + "]" * 900 + "}"])
def test_documents_nested_deeply_are_refused(tmp_path: Path, document: str) -> None:
    """Deeper in a stack of calls, fewer levels suffice for what the first document does."""
    path = tmp_path / "a.dpci.npz"
    write_arrays(path, {"made_of": document}, SMALLEST)
    assert cooked_key(path) is None
    with pytest.raises(InputError) as caught:
        read_cooked(path)
    assert len(str(caught.value)) < 300 and str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("hull", [[10**400, 0, 0]]),
        ("hull", [[1, 2], [3]]),
        ("hull", None),
        ("footprint", []),
        ("footprint", [1.0, 1.0]),
        ("footprint", [float("inf")] * 32),
        ("footprint", [[1.0, 2.0], [3.0, 4.0]]),
        ("cylinder", ["wide"] * 5),
        ("cylinder", [float("nan")] * 5),
        ("cylinder", [1.0]),
    ],
)
def test_damaged_extents_are_refused(made: tuple[CookedObject, ...], tmp_path: Path, name: str, value: object) -> None:
    path = tmp_path / "a.dpci.npz"
    write_cooked(path, "abc", made[:1])
    arrays = dict(np.load(path))
    (header,) = json.loads(str(arrays["objects"]))
    if name == "footprint":  # files of earlier layouts have it in place of a hull
        del header["hull"]
    write_arrays(path, arrays | {"objects": json.dumps([header | {name: value}])}, SMALLEST)
    with pytest.raises(InputError, match="damaged cooked depth images"):
        read_cooked(path)


def test_texture_coordinates_are_stored_only_where_there_are_any(folder: Path) -> None:
    textured = cook_object(bake(globe(checkers(256, 16)), 64, 1), CookOptions())
    plain = cook_object(bake(box(1, 1, 1), 16, 1), CookOptions())
    keep_cooked("abc", CookOptions(), (textured, plain))
    (path,) = folder.rglob("*.npz")
    columns = {
        name for name in np.load(path).files if name.rpartition(".")[2] in ("coordinates", "texture", "colour_level")
    }
    assert columns == {f"0.VirtualTexture.{name}" for name in ("coordinates", "texture", "colour_level")}
    found = find_cooked("abc", CookOptions())
    assert found is not None
    for before, after in zip((textured, plain), found, strict=True):
        for name, value in vars(before.load()[1]).items():
            np.testing.assert_array_equal(value, getattr(after.load()[1], name), err_msg=name)
            assert type(value) is type(getattr(after.load()[1], name)), name
    assert [cooked.load()[1].has_coordinates for cooked in found] == [True, False]


def test_files_of_their_own_hold_them_too(tmp_path: Path) -> None:
    textured = cook_object(bake(globe(checkers(256, 16)), 64, 1), CookOptions())
    write_cooked(tmp_path / "globe.dpci.npz", "abc", (textured,))
    (read,) = read_cooked(tmp_path / "globe.dpci.npz")
    for name, value in vars(textured.load()[1]).items():
        np.testing.assert_array_equal(value, getattr(read.load()[1], name), err_msg=name)


def test_two_components_of_colours_are_another_layout(
    made: tuple[CookedObject, ...], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Programs that know one component only would draw them wrongly."""
    for name, value in ("_OWN", (2,)), ("_SMALL", 0), ("_RMS_ERROR", 255), ("_MAX_ERROR", 255):
        monkeypatch.setattr(colour_pca, name, value)
    ball = joined(sphere(columns=32, rows=16), box(1.6, 0.2, 1.0, colour=(105, 95, 80)))
    paired = cook_object(bake(ball, 16, 1), CookOptions())
    assert paired.load()[1].colours.shape[2] == 2
    for objects, layout in (made, 4), ((paired,), 5):
        write_cooked(folder / "x.npz", "abc", objects)
        assert json.loads(str(read_arrays(folder / "x.npz", ["made_of"])["made_of"]))["version"] == layout
        assert cooked_key(folder / "x.npz") == "abc"
        for before, after in zip(objects, read_cooked(folder / "x.npz"), strict=True):
            np.testing.assert_array_equal(before.load()[1].colours, after.load()[1].colours)
