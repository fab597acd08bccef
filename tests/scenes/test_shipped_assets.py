"""What the shipped scenes are made of: found from every scene, baked and up to date."""

from pathlib import Path

import pytest
from tools.make_models.bake import bake_asset, baked_assets, baked_key, demo_scenes

from depthwalk.bake.cache import sidecar
from depthwalk.bake.file import read_header
from depthwalk.errors import InputError
from depthwalk.resources import asset_root, scene_root
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset

BAKED = baked_assets(demo_scenes())
MAX_BAKED_BYTES = 9_500_000  # of all depth images together: they travel in the repository and in the wheel
SCENE = "version: 1\nassets:\n  {asset}\nobjects: []\n"


def write_scene(folder: Path, *assets: str, name: str = "scene.yaml") -> Path:
    file = folder / name
    file.write_text(SCENE.format(asset="\n  ".join(assets)), "utf-8")
    return file


def test_any_scene_may_name_a_shipped_asset(tmp_path: Path) -> None:
    asset = load_scene(write_scene(tmp_path, "plinth: {mesh: pedestal.ply}")).assets[0]
    assert isinstance(asset, MeshAsset) and asset.mesh == asset_root() / "pedestal.ply"


def test_a_file_beside_the_scene_or_in_an_asset_root_comes_before_a_shipped_one(tmp_path: Path) -> None:
    models = tmp_path / "models"
    models.mkdir()
    own, added = tmp_path / "pedestal.ply", models / "pedestal.ply"
    scene = write_scene(tmp_path, "plinth: {mesh: pedestal.ply}")
    for file in (added, own):
        file.touch()
        asset = load_scene(scene, [models]).assets[0]
        assert isinstance(asset, MeshAsset) and asset.mesh == file.resolve()


@pytest.mark.parametrize("asset", BAKED, ids=lambda asset: asset.mesh.stem)
def test_the_depth_images_beside_a_shipped_mesh_are_up_to_date(asset: MeshAsset) -> None:
    file = sidecar(asset.mesh)
    assert file.is_file(), "run python -m tools.make_models.bake"
    assert read_header(file)["depthwalk.key"] == baked_key(asset), "run python -m tools.make_models.bake"


def test_the_depth_images_are_small_enough_to_ship() -> None:
    assert BAKED
    assert sum(sidecar(asset.mesh).stat().st_size for asset in BAKED) <= MAX_BAKED_BYTES


def test_no_depth_images_are_shipped_that_no_scene_uses() -> None:
    used = {sidecar(asset.mesh).name for asset in BAKED}
    assert {file.name for file in asset_root().glob("*.exr")} <= used


def test_an_asset_is_baked_under_the_key_that_the_library_looks_for(tmp_path: Path) -> None:
    asset = next(asset for asset in BAKED if asset.mesh.stem == "rock_slab")
    file = bake_asset(asset, tmp_path)
    assert file == tmp_path / "rock_slab.dpci.exr"
    assert read_header(file)["depthwalk.key"] == baked_key(asset)


def test_one_mesh_baked_in_two_ways_is_refused(tmp_path: Path) -> None:
    write_scene(tmp_path, "stone: {mesh: rock_slab.ply, dpci: {resolution: 64}}", name="a.yaml")
    write_scene(tmp_path, "slab: {mesh: rock_slab.ply, dpci: {resolution: 32}}", name="b.yaml")
    with pytest.raises(InputError, match=r"b\.yaml: assets\.slab: another scene bakes rock_slab\.ply differently$"):
        baked_assets(sorted(tmp_path.glob("*.yaml")))


@pytest.mark.parametrize(("name", "least"), [("garden", 300), ("room", 1)])
def test_what_is_heavy_is_drawn_by_depth_images(name: str, least: int) -> None:
    scene = load_scene(scene_root() / f"{name}.yaml")
    heavy = [isinstance(asset, MeshAsset) and asset.dpci is not None for asset in scene.assets]
    assert sum(heavy[asset] for asset in scene.objects.asset) >= least
    assert all(
        heavy[number] or asset.mesh.stat().st_size < 200_000
        for number, asset in enumerate(scene.assets)
        if isinstance(asset, MeshAsset)
    )
