"""Assets whose depth images are a file: shown without a mesh, a bake or a cache."""

import json
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from depthwalk.api.mesh import bake_mesh
from depthwalk.api.renderer import Renderer
from depthwalk.api.scene import load_scene as load_public
from depthwalk.array_file import read_arrays, write_arrays
from depthwalk.assets.library import SceneLibrary
from depthwalk.cache import forget
from depthwalk.cook.cook import CookOptions
from depthwalk.cook.cooked_file import cooked_key, read_cooked
from depthwalk.errors import InputError
from depthwalk.scene.arrays import Camera
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import BakedAsset, MeshAsset
from depthwalk.scene.schema import DpciParams

FILES = ("ball.dpci.npz", "ball.dpci.exr")


def scene_of(folder: Path, asset: str, look: str = "") -> Path:
    scene = folder / "baked.yaml"
    scene.write_text(f"version: 1\nassets: {{ball: {{{asset}}}}}\nobjects: [{{asset: ball{look}}}]\n")
    return scene


@pytest.fixture(scope="module")
def baked_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with depth images of a ball, cooked and not, and its mesh."""
    import shapes
    from files import write_ply

    folder = tmp_path_factory.mktemp("baked")
    mesh = write_ply(folder / "ball.ply", shapes.sphere(1.0, columns=32, rows=16))
    for name in FILES:
        bake_mesh(mesh, folder / name, resolution=16, layers=1)
    return folder


@pytest.fixture
def folder(baked_files: Path, tmp_path: Path) -> Path:
    """A copy of these files, without the mesh."""
    for name in FILES:
        shutil.copy(baked_files / name, tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", FILES)
def test_depth_images_need_no_mesh(folder: Path, name: str) -> None:
    scene = load_scene(scene_of(folder, f"baked: {name}, mesh: ball.ply"))
    assert scene.assets == (BakedAsset(name="ball", baked=(folder / name).resolve(), source=None),)
    library = SceneLibrary(scene.assets)
    assert library.has_baked(0) and not library.has_mesh(0) and library.mesh(0) is None
    (cooked,) = library.cooked(0, CookOptions())
    geometry, texture = cooked.load()
    assert geometry.count[0].sum() > 0 and len(texture.normals)


def test_both_kinds_of_file_hold_the_same(folder: Path) -> None:
    libraries = [SceneLibrary(load_scene(scene_of(folder, f"baked: {name}")).assets) for name in FILES]
    shipped, made = (library.cooked(0, CookOptions())[0] for library in libraries)
    assert shipped.outline.cylinder == made.outline.cylinder and shipped.outline.key == made.outline.key
    for ours, theirs in zip(shipped.load(), made.load(), strict=True):
        for name, value in vars(ours).items():
            tolerance = 8 if name == "normals" else 0  # .exr files round normals to half precision
            np.testing.assert_allclose(value, getattr(theirs, name), rtol=0, atol=tolerance, err_msg=name)


@pytest.mark.parametrize("name", FILES)
def test_what_was_read_ahead_needs_no_file(folder: Path, name: str) -> None:
    scene = load_scene(scene_of(folder, f"baked: {name}"))
    expected = SceneLibrary(scene.assets).cooked(0, CookOptions())[0].load()  # the cache has it from here on
    libraries = [SceneLibrary(scene.assets) for _ in range(3)]
    for library, most in zip(libraries, (1e9, 10.0), strict=False):
        library.read_ahead([0], CookOptions(), most)
    libraries[2].read_ahead([0], CookOptions(stepped=True), 1e9)
    forget(libraries[0].key(0))
    (folder / name).unlink()
    (held,) = libraries[0].cooked(0, CookOptions())
    for ours, theirs in zip(held.load(), expected, strict=True):
        for field, value in vars(ours).items():
            np.testing.assert_array_equal(value, getattr(theirs, field), err_msg=field)
    for library in libraries:  # held once, within bounds, and for the options
        with pytest.raises(InputError, match=name):
            library.cooked(0, CookOptions())


def test_nothing_is_baked_ahead(baked_files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = MeshAsset(
        name="new", mesh=baked_files / "ball.ply", texture=None, up="y", height=None, dpci=DpciParams(resolution=17)
    )
    library = SceneLibrary((spec, replace(spec, dpci=None)))
    monkeypatch.setattr(library, "_bake_mesh", pytest.fail)
    library.read_ahead([0, 1], CookOptions(), 1e9)
    assert not any(library._in_memory.values())
    assert library._meshes.keys() == {1}  # of what has no depth images


def test_the_mesh_is_drawn_where_it_exists(baked_files: Path) -> None:
    scene = load_scene(scene_of(baked_files, "baked: ball.dpci.npz, mesh: ball.ply", ", representation: mesh"))
    library = SceneLibrary(scene.assets)
    mesh = library.mesh(0)
    assert library.has_mesh(0) and mesh is not None and len(mesh.faces) == 32 * 15 * 2


def test_the_mesh_cannot_be_asked_for_where_it_is_missing(folder: Path) -> None:
    with pytest.raises(InputError, match=r"baked.yaml:3:.*'mesh' needs the mesh of asset 'ball'"):
        load_scene(scene_of(folder, "baked: ball.dpci.npz, mesh: ball.ply", ", representation: mesh"))
    with pytest.raises(InputError, match=r"asset 'ball' has no mesh"):
        load_scene(scene_of(folder, "baked: ball.dpci.npz", ", representation: mesh"))


def test_a_file_is_a_scene(folder: Path) -> None:
    for name in FILES:
        scene = load_scene(folder / name)
        assert [asset.baked.name for asset in scene.assets if isinstance(asset, BakedAsset)] == [name]


def test_grids_by_step_need_depth_images(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    library = SceneLibrary(load_scene(folder / "ball.dpci.npz").assets)
    for _ in range(2):
        assert library.cooked(0, CookOptions(stepped=True))[0].error == pytest.approx(
            library.cooked(0, CookOptions())[0].error
        )
    assert caplog.text.count("ball.dpci.npz: like all cooked depth images, it is drawn as it was cooked; lod.mode") == 1
    with pytest.raises(InputError, match=r"ball.dpci.npz: holds cooked depth images; lod.mode"):
        library.baked(0)


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.parametrize("setting", ["lod.cases=paper", "lod.cases=side", "warp.order=epipole"])
def test_what_is_there_cooked_only_is_drawn_as_it_is(folder: Path, setting: str) -> None:
    key, _, value = setting.partition("=")
    pictures = []
    for overrides in ({}, {f"render.{key}": value}):
        scene = load_public(folder / "ball.dpci.npz", overrides=overrides)
        with Renderer(scene, size=(64, 48), representation="dpci") as renderer:
            pictures.append(renderer.render(Camera((0, 1, 5), (0, 0, 0), 0.8)).rgba)
    assert len(np.unique(pictures[0])) > 20
    np.testing.assert_array_equal(pictures[0], pictures[1])


@pytest.mark.parametrize("part", [0.02, 0.5, 0.97])
def test_a_damaged_file_is_named_and_kept(folder: Path, part: float) -> None:
    file = folder / "ball.dpci.npz"
    data = bytearray(file.read_bytes())
    with zipfile.ZipFile(file) as archive:
        members = archive.infolist()
    end = members[int(part * (len(members) - 1)) + 1].header_offset
    # In the data of a member; a date in its header may be wrong, and nobody minds, nor the last bits of its last byte.
    data[end - 8] ^= 0x40
    file.write_bytes(data)
    with pytest.raises(InputError, match=r"ball.dpci.npz: damaged"):
        for cooked in read_cooked(file):
            cooked.load()
    assert file.read_bytes() == data


def test_a_file_of_another_layout_says_so(folder: Path) -> None:
    file = folder / "ball.dpci.npz"
    rewrite(file, version=1)
    with pytest.raises(InputError, match="a file of layout 1"):
        read_cooked(file)


def test_a_file_of_older_cooking_is_drawn_and_baked_again(folder: Path) -> None:
    file = folder / "ball.dpci.npz"
    assert cooked_key(file)
    rewrite(file, cooked_by=0)
    assert cooked_key(file) is None and len(read_cooked(file)) == 1


def rewrite(file: Path, **made_of: int) -> None:
    """Changes what a file says of its origin."""
    arrays = read_arrays(file)
    before = json.loads(str(arrays["made_of"]))
    write_arrays(file, arrays | {"made_of": json.dumps(before | made_of)})
