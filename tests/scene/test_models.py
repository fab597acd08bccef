"""Several models that are shown together without a scene file."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest

from depthwalk.errors import InputError
from depthwalk.scene.loader import load_scene
from depthwalk.scene.models import load_files
from depthwalk.scene.scene import MeshAsset


def box(file: Path, size: tuple[float, float, float], base: tuple[float, float, float]) -> Path:
    """A box whose base has its centre at `base` in the file."""
    corners = np.array(base) + (np.array(list(product((0, 1), repeat=3))) - [0.5, 0, 0.5]) * size
    faces = "1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"
    file.write_text("".join([f"v {x} {y} {z}\n" for x, y, z in corners.tolist()] + [f"f {face}\n" for face in faces]))
    return file


@pytest.fixture
def parts(tmp_path: Path) -> list[Path]:
    (tmp_path / "a").mkdir()
    return [
        box(tmp_path / "leg.obj", (1, 2, 1), (5e5, 0, 0)),
        box(tmp_path / "a" / "top.x.obj", (4, 1, 4), (5e5 + 1, 2, 3)),
        box(tmp_path / "a" / "leg.obj", (1, 2, 1), (5e5 + 2, 0, 0)),
    ]


def test_one_file_is_loaded_as_ever(tiny_scene: Path) -> None:
    scene = load_files([tiny_scene])
    assert (scene.files, scene.title) == ((tiny_scene,), "scene.yaml")
    assert len(scene.objects) == len(load_scene(tiny_scene).objects)
    with pytest.raises(InputError, match=r"^--side-by-side: needs several models$"):
        load_files([tiny_scene], side_by_side=True)


def test_parts_keep_their_places_and_together_stand_on_the_origin(parts: list[Path]) -> None:
    scene = load_files(parts)
    assert [asset.name for asset in scene.assets] == ["leg", "top_x", "leg-2"]
    assert [asset.mesh for asset in scene.assets if isinstance(asset, MeshAsset)] == [part.resolve() for part in parts]
    np.testing.assert_allclose(scene.objects.position, [[-1, 0, -2.25], [0, 2, 0.75], [1, 0, -2.25]], atol=1e-6)
    assert (scene.path, scene.files, scene.title) == (parts[0], tuple(parts), "leg.obj and 2 more")
    assert scene.camera is None and not scene.side_by_side


def test_in_a_row_none_touches_another(parts: list[Path]) -> None:
    """The widest is 4 m wide, so that 0.8 m are between two."""
    scene = load_files(parts, side_by_side=True)
    np.testing.assert_allclose(scene.objects.position, [[-3.3, 0.0, 0.0], [0.0, 0.0, 0.0], [3.3, 0.0, 0.0]], atol=1e-6)
    assert scene.side_by_side


def test_parts_too_far_apart_for_a_scene(tmp_path: Path) -> None:
    """Scans in coordinates of two zones, say: the message names the files, not the scene made of them."""
    files = [box(tmp_path / f"{x}.obj", (1, 1, 1), (x, 0, 0)) for x in (0, 3, 3_000_003)]
    with pytest.raises(InputError) as error:
        load_files(files)
    apart = f"{files[0]} and {files[2]}: 3,000 km apart by their coordinates; --side-by-side shows them in a row"
    assert error.value.lines == (apart,)
    assert load_files(files, side_by_side=True).side_by_side


def test_settings_reach_each_of_them(parts: list[Path]) -> None:
    """A part whose z points upward by its setting has its place turned with it."""
    scene = load_files(parts, overrides={"assets.top_x.up": "z", "render.aa": "fxaa"})
    assert [asset.up for asset in scene.assets if isinstance(asset, MeshAsset)] == ["y", "z", "y"]
    assert scene.render.aa == "fxaa"
    step = scene.objects.position[1] - scene.objects.position[0]
    np.testing.assert_allclose(step, [1, 1, -2.5], atol=1e-6)


def test_what_is_no_mesh_is_told_all_at_once(parts: list[Path], tiny_scene: Path, tmp_path: Path) -> None:
    (broken := tmp_path / "broken.obj").write_text("v 0 0 0\n")
    images = tmp_path / "a.dpci.npz"
    images.touch()
    with pytest.raises(InputError) as raised:
        load_files([parts[0], tiny_scene, tmp_path / "gone.ply", broken, images, Path("x.fbx")])
    scene, gone, empty, baked, other = raised.value.lines
    assert scene == f"{tiny_scene}: is no mesh; a scene is shown by itself, a camera path is given as --path"
    assert gone.startswith(f"{tmp_path / 'gone.ply'}: no such file")
    assert empty.startswith(f"{broken}: no faces") and baked.startswith(f"{images}: depth images do not say where")
    assert other.startswith("x.fbx: no such file")


def test_a_picture_becomes_the_texture_of_all(parts: list[Path], tiny_scene: Path, tmp_path: Path) -> None:
    """Not one of the same name beside them."""
    wood, other = tmp_path / "wood.png", tmp_path / "a" / "wood.png"
    wood.touch()
    other.touch()
    for files in parts, parts[1:2]:
        scene = load_files(files, texture=wood)
        assert {asset.texture for asset in scene.assets if isinstance(asset, MeshAsset)} == {wood.resolve()}
        assert scene.files == tuple(files)
    with pytest.raises(InputError, match=r"gone\.png: no such file"):
        load_files(parts, texture=tmp_path / "gone.png")
    with pytest.raises(InputError, match=r"^--texture: needs a mesh; in a scene file, an asset has the key 'texture'$"):
        load_files([tiny_scene], texture=wood)
    with pytest.raises(InputError, match=r"wood\.png: a picture, no mesh; --sky"):
        load_files([parts[0], wood])
