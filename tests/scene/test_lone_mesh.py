"""A mesh file where a scene file is expected."""

from pathlib import Path

import numpy as np
import pytest

from depthwalk.errors import InputError
from depthwalk.ingest.loader import load_mesh
from depthwalk.render.lighting.harmonics import polynomials
from depthwalk.render.lighting.irradiance import lighting, sphere_directions
from depthwalk.scene.arrays import Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.models import load_files
from depthwalk.scene.scene import MeshAsset
from depthwalk.scene.schema import DpciParams


@pytest.fixture
def ball(tiny_scene: Path) -> Path:
    return tiny_scene.with_name("ball.ply")


def test_stands_on_the_origin_with_the_depth_images_that_bake_makes(ball: Path) -> None:
    scene = load_scene(ball)
    (asset,) = scene.assets
    assert isinstance(asset, MeshAsset)
    assert (scene.path, asset.name, asset.mesh, asset.dpci) == (ball, "model", ball, DpciParams())
    assert scene.objects.position.tolist() == [[0, 0, 0]]
    assert scene.objects.representation.tolist() == [Representation.AUTO]
    assert scene.camera is None and scene.environment.ground is None


def test_its_light_burns_nothing_out_and_shows_all_sides_alike(ball: Path) -> None:
    """Of a white ball, the brightest point is just below white, and no side is half as bright as another."""
    light = lighting(load_scene(ball).environment)
    normal, _ = sphere_directions()
    shown = polynomials(normal) @ light.ambient + np.maximum(normal @ light.to_sun, 0)[:, None] * light.sun
    assert (shown.max(0) < 1).all() and shown.max() > 0.95
    assert shown.min() > 0.05
    around = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    facing = np.maximum(normal @ np.stack([np.sin(around), 0 * around, np.cos(around)]), 0)
    means = (facing.T @ shown / facing.sum(0)[:, None]).mean(1)
    assert means.max() / means.min() < 1.5
    assert load_files([ball, ball]).environment == load_scene(ball).environment


def test_its_light_can_be_set(ball: Path) -> None:
    values = {"environment.sun.intensity": "2", "environment.ambient.contrast": "0"}
    environment = load_scene(ball, (), values).environment
    assert (environment.sun.intensity, environment.ambient.contrast) == (2, 0)
    assert environment.ambient.intensity == load_scene(ball).environment.ambient.intensity


def test_set_reaches_the_mesh(ball: Path) -> None:
    (asset,) = load_scene(ball, (), {"assets.model.up": "z", "assets.model.height": "3"}).assets
    assert isinstance(asset, MeshAsset)
    assert (asset.up, asset.height) == ("z", 3.0)
    with pytest.raises(InputError, match=r"^--set assets\.model\.heigth: unknown key; did you mean 'height'\?$"):
        load_scene(ball, (), {"assets.model.heigth": "3"})


def test_what_it_lacks_is_told_in_the_words_of_its_reader(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The command line prints equal warnings once, so a relative path must not make them differ."""
    (tmp_path / "a.obj").write_text("mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    monkeypatch.chdir(tmp_path)
    (asset,) = load_scene("a.obj").assets
    assert isinstance(asset, MeshAsset)
    load_mesh(asset.mesh)
    path = tmp_path.resolve() / "a.obj"
    assert set(caplog.messages) == {f"{path}: 'gone.mtl' is missing or outside the folder; ignored"}


def test_a_mesh_format_that_is_not_read_is_no_scene(tmp_path: Path) -> None:
    file = tmp_path / "model.LWO"
    file.write_text("FORM")
    with pytest.raises(InputError, match=r"model\.LWO: '\.lwo' is not a mesh format \(use \.obj, .* in Blender$"):
        load_scene(file)


@pytest.mark.parametrize("name", ["it's: #1.ply", 'a "b" {c}.PLY', "köper.ply"])
def test_any_name_will_do(ball: Path, name: str) -> None:
    named = ball.rename(ball.with_name(name))
    (asset,) = load_scene(named).assets
    assert isinstance(asset, MeshAsset) and asset.mesh == named


def test_a_link_is_followed(ball: Path, tmp_path: Path) -> None:
    link = tmp_path / "link.ply"
    link.symlink_to(ball)
    (asset,) = load_scene(link).assets
    assert isinstance(asset, MeshAsset) and asset.mesh == ball


def test_says_what_is_not_there(tmp_path: Path) -> None:
    folder = tmp_path / "folder.obj"
    folder.mkdir()
    for file, defect in ((folder, "is a folder"), (tmp_path / "none.stl", "no such file")):
        with pytest.raises(InputError) as caught:
            load_scene(file)
        assert str(caught.value) == f"{file}: {defect}"
