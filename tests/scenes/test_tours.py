"""The shipped camera paths walk through nothing."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.cook.cooked_file import read_cooked
from depthwalk.ingest.loader import load_mesh
from depthwalk.resources import scene_root
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.scene.scene import Asset, BakedAsset, MeshAsset, Scene

CLEARANCE = 0.3  # metres to the side of the camera
BODY = (-1.4, 0.3)  # metres from the camera's height down to the shins and up to the hat
SURROUNDING = {"room"}  # assets that are walked inside of


@cache
def read_points(file: Path) -> NDArray[np.float64]:
    """Vertices (n, 3) of a mesh, or of the finest level of depth images, in the asset's frame."""
    if file.suffix == ".ply":
        return load_mesh(file).positions.astype(np.float64)
    (cooked,) = read_cooked(file)
    geometry, _ = cooked.load()
    return geometry.positions[np.unique(geometry.drawn(0))] + cooked.outline.position


def read_all_points(scene: Scene) -> list[NDArray[np.float64]]:
    return [read_points(file_of(asset)) for asset in scene.assets]


def file_of(asset: Asset) -> Path:
    """The mesh of an asset, or its depth images."""
    if isinstance(asset, MeshAsset):
        return asset.mesh
    assert isinstance(asset, BakedAsset)
    return asset.baked


@cache
def shipped(name: str) -> Scene:
    return load_scene(scene_root() / f"{name}.yaml")


@cache
def walked(name: str) -> tuple[Scene, NDArray[np.float64]]:
    """The scene and its tour: (k, 6) position and target, ten a second."""
    scene = shipped(name)
    path = load_path(scene_root() / "paths" / f"{name}.yaml")
    cameras = [path.sample(time) for time in path.frames()[::3]]
    return scene, np.array([(*camera.position, *camera.target) for camera in cameras])


def gap(points: NDArray[np.float64], scale: float, turn: float, offsets: NDArray[np.float64]) -> float:
    """Least level distance from points (k, 3), relative to an object, to the box round what a walker would meet."""
    heights = points[:, 1] * scale
    low, high = offsets[:, 1].min() + BODY[0], offsets[:, 1].max() + BODY[1]
    met = points[(heights > low) & (heights < high)][:, [0, 2]] * scale
    if not len(met):
        return np.inf
    c, s = np.cos(turn), np.sin(turn)
    walker = offsets[:, [0, 2]] @ np.array([[c, s], [-s, c]])  # in the object's frame
    outside = np.maximum(np.maximum(met.min(axis=0) - walker, walker - met.max(axis=0)), 0)
    return float(np.hypot(*outside.T).min())


def gaps(scene: Scene, eyes: NDArray[np.float64]) -> dict[str, float]:
    """The least distance to any object of each asset, where that is under 2 m."""
    shapes = read_all_points(scene)
    radius = np.array([np.hypot(points[:, 0], points[:, 2]).max() for points in shapes])
    objects = scene.objects
    found: dict[str, float] = {}
    away = np.hypot(*(eyes[:, None, [0, 2]] - objects.position[None, :, [0, 2]]).transpose(2, 0, 1))
    close = away < radius[objects.asset] * objects.scale + 2
    for i in np.flatnonzero(close.any(axis=0)):
        name = scene.assets[objects.asset[i]].name
        if name in SURROUNDING:
            continue
        turn = 2 * np.arctan2(objects.rotation[i, 1], objects.rotation[i, 3])
        offsets = eyes[close[:, i]] - objects.position[i]
        near = gap(shapes[objects.asset[i]], float(objects.scale[i]), float(turn), offsets)
        found[name] = min(found.get(name, np.inf), near)
    return {name: near for name, near in found.items() if near < 2}


@pytest.mark.parametrize("name", [pytest.param("garden", marks=pytest.mark.slow), "room"])
def test_a_tour_passes_close_to_objects_and_through_none(name: str) -> None:
    scene, views = walked(name)
    found = gaps(scene, views[:, :3])
    assert {asset: near for asset, near in found.items() if near < CLEARANCE} == {}
    assert len(found) >= 2  # else the walk shows nothing from near


@pytest.mark.parametrize("name", ["garden", "room"])
def test_a_tour_turns_gently_and_ends_where_it_begins(name: str) -> None:
    _, views = walked(name)
    assert np.allclose(views[0], views[-1])
    look = views[:, 3:] - views[:, :3]
    look /= np.linalg.norm(look, axis=1, keepdims=True)
    turn = np.degrees(np.arccos(np.clip((look[1:] * look[:-1]).sum(axis=1), -1, 1)))
    assert turn.max() < 10  # degrees in a tenth of a second


def test_the_room_tour_stays_in_the_room() -> None:
    scene, views = walked("room")
    room = next(file for asset in scene.assets if isinstance(asset, MeshAsset) and (file := asset.mesh).stem == "room")
    low, high = load_mesh(room).bounds
    assert (views[:, :3] > low + CLEARANCE).all() and (views[:, :3] < high - CLEARANCE).all()


def test_scenes_name_only_shipped_assets() -> None:
    for file in sorted(scene_root().glob("*.yaml")):
        assert {file_of(asset).parent.name for asset in shipped(file.stem).assets} == {"assets"}
