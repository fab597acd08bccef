"""What a scene needs of its assets, before anything is read."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from depthwalk.assets.demand import AssetCapabilities, cook_options, nearest_first, requested_representations
from depthwalk.cook.cook import CookOptions
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.scene.render_settings import RenderSettings


def objects(assets: list[int], places: list[float]) -> Objects:
    """Objects along the x axis, drawn by depth images."""
    count = len(assets)
    return Objects(
        asset=np.array(assets, np.int32),
        position=np.array([(x, 0, 0) for x in places], np.float32).reshape(count, 3),
        rotation=np.tile(np.array([0, 0, 0, 1], np.float32), (count, 1)),
        scale=np.ones(count, np.float32),
        representation=np.full(count, Representation.DPCI, np.uint8),
    )


class MeshesAlone:
    """Two assets, of which only the second has a mesh."""

    def __len__(self) -> int:
        return 2

    def has_baked(self, asset: int) -> bool:
        return True

    def has_height_field(self, asset: int) -> bool:
        return asset == 0

    def has_mesh(self, asset: int) -> bool:
        return asset == 1


def test_assets_come_by_their_nearest_object_each_once() -> None:
    placed = objects([2, 0, 2, 1], [9, 5, 1, 7])
    assert nearest_first(placed, np.zeros(3)) == [2, 0, 1]
    assert nearest_first(placed, np.array([8.5, 0, 0])) == [2, 1, 0]
    assert nearest_first(placed, None) == [0, 1, 2]
    assert nearest_first(objects([], []), np.zeros(3)) == []


def test_a_representation_is_forced_on_what_has_it() -> None:
    placed, assets = objects([0, 1], [0, 1]), cast(AssetCapabilities, MeshesAlone())
    assert requested_representations(placed, assets, Representation.MESH).tolist() == [
        Representation.DPCI,
        Representation.MESH,
    ]
    assert requested_representations(placed, assets, Representation.RELIEF).tolist() == [
        Representation.RELIEF,
        Representation.DPCI,
    ]
    assert (requested_representations(placed, assets, None) == placed.representation).all()


@pytest.mark.parametrize(
    ("changes", "options"),
    [
        ({}, CookOptions()),
        ({"lod": {"mode": "paper"}}, CookOptions(stepped=True)),
        ({"warp": {"order": "epipole"}}, CookOptions(stepped=True)),
        ({"lod": {"cases": "paper"}}, CookOptions(stepped=True, paper_cases=True)),
    ],
)
def test_the_papers_mechanisms_need_grids_by_step(changes: dict[str, Any], options: CookOptions) -> None:
    defaults = RenderSettings()
    settings = SimpleNamespace(lod=defaults.lod, warp=defaults.warp)
    for group, values in changes.items():
        setattr(settings, group, getattr(defaults, group).model_copy(update=values))
    assert cook_options(cast(RenderSettings, settings)) == options
