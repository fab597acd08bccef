"""What the shipped scenes are made of: found from every scene, cooked, and drawn by depth images."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tools.make_models.catalogue import MODELS
from tools.make_models.ship import ship, shipped_name, with_plain_normals, without_levels
from tools.vitals import share, walks

from depthwalk.commands.info import describe_file
from depthwalk.cook.cooked_file import cooked_key, read_cooked
from depthwalk.cook.texel_encoding import encode_normals
from depthwalk.errors import InputError
from depthwalk.resources import asset_root, scene_root
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import BakedAsset, MeshAsset

COOKED = sorted(asset_root().glob("*.npz"))
SCENE = "version: 1\nassets:\n  {asset}\nobjects: []\n"
LIGHT = {"room", "table", "teapot"}  # what stays polygons


def write_scene(folder: Path, *assets: str, name: str = "scene.yaml") -> Path:
    file = folder / name
    file.write_text(SCENE.format(asset="\n  ".join(assets)), "utf-8")
    return file


def test_any_scene_may_name_a_shipped_asset(tmp_path: Path) -> None:
    table, plinth = load_scene(
        write_scene(tmp_path, "table: {mesh: table.ply}", "plinth: {baked: pedestal.dpci.npz, mesh: pedestal.ply}")
    ).assets
    assert isinstance(table, MeshAsset) and table.mesh == asset_root() / "table.ply"
    assert isinstance(plinth, BakedAsset) and plinth.baked == asset_root() / "pedestal.dpci.npz"
    assert plinth.source is None


def test_a_file_beside_the_scene_or_in_an_asset_root_comes_before_a_shipped_one(tmp_path: Path) -> None:
    models = tmp_path / "models"
    models.mkdir()
    own, added = tmp_path / "table.ply", models / "table.ply"
    scene = write_scene(tmp_path, "table: {mesh: table.ply}")
    for file in (added, own):
        file.touch()
        asset = load_scene(scene, [models]).assets[0]
        assert isinstance(asset, MeshAsset) and asset.mesh == file.resolve()


@pytest.mark.parametrize("file", COOKED, ids=lambda file: file.name)
def test_shipped_depth_images_are_of_this_version(file: Path) -> None:
    assert cooked_key(file) is not None, "run python -m tools.make_models.ship"


def test_what_is_heavy_ships_as_depth_images_of_which_each_is_used() -> None:
    heavy = {shipped_name(name) for name, entry in MODELS.items() if entry.images is not None}
    scenes = [load_scene(file) for file in scene_root().glob("*.yaml")]
    used = {asset.baked.name for scene in scenes for asset in scene.assets if isinstance(asset, BakedAsset)}
    assert {file.name for file in COOKED} == heavy == used


def test_levels_finer_than_asked_for_do_not_ship() -> None:
    (cooked,) = read_cooked(asset_root() / "pedestal.dpci.npz")
    finest, texture = cooked.load()
    (coarser, same) = without_levels(cooked, float(cooked.error[1])).load()
    assert without_levels(cooked, 0.0).load()[0] is not None and (texture.colours == same.colours).all()
    left_out = int((finest.error <= cooked.error[1]).sum()) - 1  # of equal errors the last is kept
    assert left_out >= 1 and len(coarser.error) == len(finest.error) - left_out
    for level in range(len(coarser.error)):
        corners = coarser.positions[coarser.drawn(level)], finest.positions[finest.drawn(level + left_out)]
        assert (corners[0] == corners[1]).all()
    assert len(coarser.vertices) < len(finest.vertices) and len(coarser.texels) == len(coarser.vertices)


def test_normals_of_fewer_bits_point_nearly_the_same_way() -> None:
    (cooked,) = read_cooked(asset_root() / "statue.dpci.npz")
    geometry, texture = cooked.load()
    rng = np.random.default_rng(1)
    normal = rng.normal(size=(1000, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    code = np.dstack([encode_normals(normal).reshape(-1, 1, 3), np.zeros((1000, 1, 1), np.uint8)])
    _, plain = with_plain_normals(replace(cooked, load=lambda: (geometry, replace(texture, normals=code)))).load()
    decoded = plain.normals[:, 0, :3] - 127.5
    cosine = (decoded * normal).sum(axis=1) / np.linalg.norm(decoded, axis=1)
    assert np.degrees(np.arccos(cosine.clip(-1, 1))).max() < 1
    assert (plain.normals[..., 3] == code[..., 3]).all()


def test_an_unknown_model_does_not_ship(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no demo file is called 'pedestel'; did you mean 'pedestal'"):
        ship(["pedestel"], tmp_path, tmp_path)


def test_polygons_and_textures_ship_as_they_are_made(tmp_path: Path) -> None:
    models, assets = tmp_path / "models", tmp_path / "assets"
    assets.mkdir()
    ship(["teapot", "bark_height"], models, assets)
    for name in ("teapot.ply", "bark_height.png"):
        assert (assets / name).read_bytes() == (models / name).read_bytes() == (asset_root() / name).read_bytes()
        assert f"| {name} |" in (assets / "SOURCES.md").read_text("utf-8")


@pytest.mark.parametrize(("name", "least"), [("garden", 500), ("room", 5), ("night", 90)])
def test_all_but_a_few_light_objects_are_depth_images(name: str, least: int) -> None:
    scene = load_scene(scene_root() / f"{name}.yaml")
    baked = [isinstance(asset, BakedAsset) for asset in scene.assets]
    assert sum(baked[asset] for asset in scene.objects.asset) >= least
    assert {asset.mesh.stem for asset in scene.assets if isinstance(asset, MeshAsset)} <= LIGHT


def test_readme_says_of_what_the_garden_is_made() -> None:
    rows = dict(describe_file(scene_root() / "garden.yaml"))
    millions = round(int(rows["made of"].removesuffix(" triangles").replace(",", "")) / 1e6)
    readme = " ".join((Path(__file__).parents[2] / "README.md").read_text("utf-8").split())
    assert f"{rows['objects']} statues, trees, hedges and stones of {millions} million triangles" in readme


@pytest.mark.gl
@pytest.mark.parametrize(("name", "least"), [("garden", 0.99), ("room", 0.05)])
def test_depth_images_draw_most_of_what_a_tour_shows(name: str, least: int) -> None:
    """Of the pixels that show objects, at five views along the path. The room's shell and table are polygons."""
    (walk,) = (walk for walk in walks(None) if walk.name == name)
    assert share(walk) >= least
    baked = [asset for asset in load_scene(walk.scene).assets if isinstance(asset, BakedAsset)]
    assert all(
        asset.source is None for asset in baked
    )  # no mesh is there that could be drawn instead, of heads above all
