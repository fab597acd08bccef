"""Files told apart by the ends of their names."""

from pathlib import Path

import pytest

from depthwalk.errors import InputError
from depthwalk.ingest.formats import (
    MESH_SUFFIXES,
    OTHER_MESH_SUFFIXES,
    OTHER_POINT_SUFFIXES,
    check_suffix,
    is_mesh_file,
)


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_meshes(suffix: str) -> None:
    for path in (Path(f"a{suffix}"), Path(f"a{suffix.upper()}")):
        assert is_mesh_file(path)
        check_suffix(path)


@pytest.mark.parametrize("name", ["scene.conf", "obj", ".obj", "model.obj.txt"])
def test_what_is_no_mesh(name: str) -> None:
    assert not is_mesh_file(Path(name))
    with pytest.raises(InputError, match=r"is not a mesh format \(use \.obj"):
        check_suffix(Path(name))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a.yml", "a scene or a camera path, no mesh; `view`, `render` and `check` take it"),
        ("a.HTML", "a web page, such as a report, no mesh; a browser opens it"),
        ("a.dpci.exr", "depth images, no mesh; `view` opens them, and a scene names them by the key 'baked'"),
        (
            "a.advice.json",
            "advice or measurements, such as `advise` writes, no mesh; a scene names advice by the key 'advice'",
        ),
        ("a.exr", "a picture, no mesh; --sky lights a scene or a model by it"),
    ],
)
def test_what_else_users_have_is_told_where_it_goes(name: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        check_suffix(Path(name))
    assert str(error.value) == f"{name}: {message}"


@pytest.mark.parametrize("suffix", OTHER_MESH_SUFFIXES)
def test_meshes_of_other_programs_are_refused_by_name(suffix: str) -> None:
    with pytest.raises(InputError, match=r"is not a mesh format .*; save it as \.glb"):
        is_mesh_file(Path(f"a{suffix}"))


@pytest.mark.parametrize("suffix", OTHER_POINT_SUFFIXES)
def test_points_of_other_programs_are_refused_by_name(suffix: str) -> None:
    with pytest.raises(InputError, match=r"is not a mesh format .*; save it as \.ply"):
        is_mesh_file(Path(f"a{suffix}"))
