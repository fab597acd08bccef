"""The scenes of the papers' figures: they open, say what they are, and are drawn by one word."""

from pathlib import Path

import numpy as np
import pytest
from tools.make_panorama import HORIZON, UNIT, make_panorama
from tools.make_reliefs import RELIEFS, SIDE, make_relief

from depthwalk.resources import scene_root
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import DepthImageAsset, MeshAsset

SCENES = sorted((scene_root() / "paper").glob("*.yaml"))
FIGURES = [file for file in SCENES if file.name.startswith("figure-")]


def test_there_is_one_for_each_figure() -> None:
    assert [file.name[:9] for file in FIGURES] == [f"figure-{n}" for n in ("01", "06", "12", "14", "16", "18")]
    assert "focus.yaml" in [file.name for file in SCENES]


@pytest.mark.parametrize("file", SCENES, ids=lambda file: file.stem)
def test_they_load_and_name_their_command(file: Path) -> None:
    assert len(load_scene(file).objects)
    assert f"scenes/paper/{file.name}" in file.read_text(encoding="utf-8")


@pytest.mark.parametrize("file", FIGURES, ids=lambda file: file.stem)
def test_figures_are_the_papers_whole(file: Path) -> None:
    scene = load_scene(file)
    assert scene.render.preset == "paper"
    for asset in scene.assets:
        if isinstance(asset, MeshAsset):
            assert asset.dpci is not None and (asset.dpci.method, asset.dpci.layers) == ("paper", 1)
        else:
            assert isinstance(asset, DepthImageAsset) and asset.method == "paper"


def test_the_panorama_is_made_of_the_shipped_models() -> None:
    from PIL import Image

    folder = scene_root() / "paper" / "panorama"
    assert {file.name for file in folder.iterdir()} == {"room_depth.png", "room_colour.jpg"}
    depth, colour = make_panorama()
    with Image.open(folder / "room_depth.png") as shipped:
        assert np.abs(np.asarray(shipped).astype(int) - np.asarray(depth)).max() <= 1
    with Image.open(folder / "room_colour.jpg") as shipped:
        assert np.abs(np.asarray(shipped).astype(int) - np.asarray(colour)).mean() < 3
    (asset,) = load_scene(scene_root() / "paper" / "figure-06a-panorama.yaml").assets
    assert isinstance(asset, DepthImageAsset) and asset.panorama is not None
    assert (asset.panorama.horizon, asset.unit) == (HORIZON, UNIT)


def test_reliefs_are_made_of_the_shipped_models() -> None:
    from PIL import Image, ImageChops

    folder = scene_root() / "paper" / "reliefs"
    assert {file.name for file in folder.iterdir()} == {
        f"{n}_{kind}.png" for n in RELIEFS for kind in ("depth", "colour")
    }
    depth, colour = make_relief(RELIEFS["teapot"])
    assert depth.size == (SIDE, SIDE) and depth.mode == "I;16"
    with Image.open(folder / "teapot_colour.png") as shipped:
        assert np.asarray(ImageChops.difference(shipped.convert("RGB"), colour)).max() <= 1
