"""Which way up a model stands, and how it is turned."""

from pathlib import Path
from types import SimpleNamespace
from typing import Literal

import numpy as np
import pytest

import shapes
from depthwalk.assets.library import SceneLibrary
from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.ingest.loader import load_mesh
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.up_axis import Body, ModelTurn, guess_up, turn_body
from depthwalk.resources import asset_root
from depthwalk.scene.arrays import Representation
from depthwalk.scene.models import load_files
from depthwalk.scene.similarity import Similarity, from_angles, identities
from depthwalk.types import Array

STANDING = ["teapot", "table", "man_of_the_paper", "venus_of_the_paper"]


def z_upward(points: Array) -> Array:
    """The same model from a program whose z points upward."""
    return np.stack([points[:, 0], -points[:, 2], points[:, 1]], 1)


@pytest.mark.parametrize("name", STANDING)
def test_what_stands_is_recognised(name: str) -> None:
    points = load_mesh(asset_root() / f"{name}.ply").positions
    assert (guess_up(points), guess_up(z_upward(points))) == ("y", "z")


def test_what_stands_in_no_way_keeps_y() -> None:
    for points in (shapes.sphere(1.0, columns=32, rows=16).positions, np.zeros((1, 3)), np.eye(3)):
        assert guess_up(points) == "y"


def test_a_picture_hangs_and_a_floor_lies() -> None:
    picture = np.array([[-1.0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 1, 0]])
    assert guess_up(picture) == guess_up(picture[:, [0, 2, 1]]) == "y"


def test_a_terrain_lies_and_an_upright_relief_hangs() -> None:
    """The lower end of a terrain's edge is as long as it is, which a standing thing's is, too."""
    x, z = (grid.ravel() for grid in np.meshgrid(np.linspace(-1, 1, 40), np.linspace(-1, 1, 30)))
    terrain = np.stack([x, 0.1 * np.sin(4 * x) * np.cos(3 * z), z], 1)
    assert guess_up(terrain) == guess_up(z_upward(terrain)) == "y"
    house = np.concatenate([z_upward(shapes.box(1.0, 2.0, 1.0).positions), [[0.0, 0.0, 3.0]]])
    assert guess_up(house) == "z"


@pytest.mark.parametrize(
    ("file", "turns"),
    [("a.obj", True), ("a.ply", True), ("a.glb", False), ("a.GLTF", False), ("a.las", False)]
    + [(f"a.dpci.{suffix}", False) for suffix in ("exr", "npz")],
)
def test_files_that_define_their_axis_are_not_guessed(file: str, turns: bool) -> None:
    points = z_upward(load_mesh(asset_root() / "man_of_the_paper.ply").positions)
    one = {"rotation": np.array([[0, 0, 0, 1.0]]), "position": np.zeros((1, 3)), "scale": np.ones(1)}
    objects = Named(asset=np.zeros(1, int), **one)
    world = SimpleNamespace(
        objects=lambda: objects,
        owners=lambda: np.zeros(1, int),
        scene_objects=objects,
        points=lambda asset: points,
        moved=lambda: None,
    )
    nodes = SimpleNamespace(world=identities(1))
    assets = [SimpleNamespace(name="model", up="y", up_is_given=False)]
    path = Path(file)
    scene = SimpleNamespace(path=path, files=(path,), beside=(), objects=objects, nodes=nodes, assets=assets)
    turn = ModelTurn(scene, SimpleNamespace(world=world))  # type: ignore[arg-type]
    assert bool(turn.guess) == turns
    up = "y" if turns else "z"
    how = "bake with --up" if ".dpci." in file else "in a scene file: up:"
    assert turn.turn() == f"{up} points upward; {how} {up}"


class Named(SimpleNamespace):
    """One object, whose arrays are its attributes."""

    def __len__(self) -> int:
        return 1


@pytest.mark.slow
@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("roll", [0.0, 0.5])
def test_a_turned_model_stands_on_its_place(up: Literal["y", "z"], roll: float) -> None:
    """And leans there, if its node says so."""
    points: Array = load_mesh(Path(asset_root() / "man_of_the_paper.ply")).positions + np.array([1.0, 2.0, 3.0])
    if up == "z":
        points = z_upward(points)
    objects = SimpleNamespace(
        rotation=np.zeros((1, 4), np.float32), position=np.ones((1, 3), np.float32), scale=np.array([2.0], np.float32)
    )
    lean = from_angles(np.zeros(1), np.zeros(1), np.array([roll]))
    nodes = SimpleNamespace(world=Similarity(np.array([[5.0, 0.5, -2.0]]), lean, np.array([2.0])))
    body = Body(rows=slice(0, 1), points=points)
    turn_body(SimpleNamespace(objects=objects, nodes=nodes), body, up)  # type: ignore[arg-type]
    placed = 2.0 * rotate(objects.rotation[0], points) + objects.position[0]
    placed = rotate(conjugate(lean[0]), placed - [5.0, 0.5, -2.0])
    low, high = placed.min(0), placed.max(0)
    np.testing.assert_allclose([low[1], *(low + high)[[0, 2]]], 0, atol=1e-5)
    assert (high - low).argmax() == 1  # a head is tallest upright


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.parametrize("side_by_side", [False, True])
def test_several_models_are_turned_together_or_each_for_itself(tmp_path: Path, side_by_side: bool) -> None:
    """Two halves of a bust that lies: turned upright they still make one, or stand in a row; and again, they lie."""
    bust = z_upward(load_mesh(asset_root() / "man_of_the_paper.ply").positions)
    faces = load_mesh(asset_root() / "man_of_the_paper.ply").faces
    left = bust[faces].mean(1)[:, 0] < 0
    files = []
    for name, half in ("left", left), ("right", ~left):
        used, corners = np.unique(faces[half], return_inverse=True)
        rows = [f"v {x} {y} {z}" for x, y, z in bust[used].tolist()]
        rows += [f"f {a} {b} {c}" for a, b, c in (corners.reshape(-1, 3) + 1).tolist()]
        files.append(tmp_path / f"{name}.obj")
        files[-1].write_text("\n".join(rows))
    scene = load_files(files, side_by_side=side_by_side)
    lying = scene.objects.position.copy()
    with HeadlessRenderer(scene, SceneLibrary(scene.assets), (32, 24), Representation.MESH) as headless:
        turn = ModelTurn(scene, headless.renderer)
        assert turn.guess == "Models seem to be z-up and were turned upright; U turns them back"
        assert ("--side-by-side" in turn.message) == (not side_by_side)
        points = [
            rotate(rotation, headless.renderer.world.points(asset)) + place
            for asset, (rotation, place) in enumerate(zip(scene.objects.rotation, scene.objects.position, strict=True))
        ]
        assert turn.turn() == "y points upward; in a scene file: up: y"
    np.testing.assert_allclose(scene.objects.position, lying, atol=1e-5)
    upright = bust[:, [0, 2, 1]] * [1, 1, -1]
    if side_by_side:
        assert [half[:, 1].min() for half in points] == pytest.approx([0, 0], abs=1e-5)
        assert points[0][:, 0].max() < points[1][:, 0].min()
    else:
        both = np.concatenate(points)
        np.testing.assert_allclose(np.ptp(both, axis=0), np.ptp(upright, axis=0), atol=1e-4)
        assert both[:, 1].min() == pytest.approx(0, abs=1e-5)
        assert points[0][:, 0].max() - points[1][:, 0].min() < 0.05
