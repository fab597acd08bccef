"""How deep rays go: as many layers as hold what can be seen."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from depthwalk.assets.asset_files import mesh_key
from depthwalk.bake.baker import peeled_layers
from depthwalk.bake.depth import Depth, deep_enough
from depthwalk.bake.params import BakeParams, ModelParams
from depthwalk.bake.parts import bake_model, probed_depth
from depthwalk.bake.placement import place_along
from depthwalk.bake.raycast import RayCaster
from depthwalk.ingest.mesh import Mesh
from depthwalk.scene.scene import MeshAsset
from shapes import bake, box, joined, sphere


def stack(count: int) -> Mesh:
    """Plates one above the other, as far apart as they are thick: seen from aslant, missed by rays from beside."""
    return joined(*(box(2.0, 0.2, 2.0, (0, 0.5 * number, 0)) for number in range(count)))


def depths_of(mesh: Mesh, **params: Any) -> list[Depth]:
    return probed_depth(mesh, place_along((0, 1, 0), mesh.positions), ModelParams(resolution=64, **params))


@pytest.mark.parametrize("plates", [1, 2, 4])
def test_rays_go_as_deep_as_there_are_plates(plates: int) -> None:
    """Their upper sides are layers of the top cap, their lower sides of the bottom's."""
    depths = depths_of(stack(plates))
    assert [depth.layers for depth in depths] == list(range(1, 9))
    missing = np.array([depth.missing for depth in depths])
    assert (missing[plates - 1 :] == 0).all() and (missing[: plates - 1] > 0.05).all() and (np.diff(missing) <= 0).all()
    assert deep_enough(depths).layers == plates


@pytest.mark.slow
def test_what_hides_inside_needs_no_layers() -> None:
    shells = joined(sphere(1.0, columns=48, rows=24), *(sphere(r, columns=48, rows=24) for r in (0.8, 0.6, 0.4)))
    assert deep_enough(depths_of(shells)).layers == 1


def test_a_layer_must_be_worth_it() -> None:
    depths = [
        Depth(layers=1, missing=0.1, footprint=3.0),
        Depth(layers=2, missing=0.0, footprint=1.15),
        Depth(layers=3, missing=0.0, footprint=1.1),
    ]
    assert deep_enough(depths).layers == 2
    assert deep_enough(depths[:1]).layers == 1


def test_of_a_solid_inside_out_all_counts_alike() -> None:
    cube = box(1.0, 1.0, 1.0)
    cube.faces[:] = cube.faces[:, ::-1]
    assert len(depths_of(cube)) == 8


@pytest.mark.slow
def test_auto_bakes_what_so_many_layers_do() -> None:
    mesh = stack(4)
    (auto,) = bake_model(mesh, ModelParams(resolution=32, layers="auto"), "").parts
    (four,) = bake_model(mesh, ModelParams(resolution=32, layers=4), "").parts
    assert max(image.layer for image in auto.images) == 3
    assert all(np.array_equal(a.depth, b.depth) for a, b in zip(auto.images, four.images, strict=True))


@pytest.mark.slow
def test_every_part_has_layers_of_its_own() -> None:
    """Half of the plates each, and one beside the cut."""
    parts = bake_model(stack(12), ModelParams(resolution=64, layers="auto", parts=2), "").parts
    assert [1 + max(image.layer for image in part.images) for part in parts] == [7, 7]


def test_rays_of_an_object_that_is_baked_by_itself_go_as_deep_as_may_be() -> None:
    mesh = stack(2)
    assert peeled_layers(BakeParams(resolution=32, layers="auto"), RayCaster(mesh)) == 8
    assert max(image.layer for image in bake(mesh, 32, "auto").images) == 1


def test_auto_has_a_key_of_its_own(tmp_path: Path) -> None:
    file = tmp_path / "plain.ply"
    file.write_bytes(b"")
    spec = MeshAsset(name="plain", mesh=file, texture=None, up="y", height=None, dpci=None)
    assert mesh_key(spec, ModelParams(resolution=64, layers="auto")) != mesh_key(
        spec, ModelParams(resolution=64, layers=3)
    )
