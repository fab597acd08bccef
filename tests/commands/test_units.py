"""Models that seem to be in millimetres are told of, others are not."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import shapes
from depthwalk.ingest.units import unit_hint
from depthwalk.render.up_axis import ModelTurn, stand_upright
from files import write_ply

HINT = "2,000 m large; if its unit is the millimetre, give its height in metres: "


@pytest.mark.parametrize(("name", "extent", "expected"), [
    ("a.obj", (1, 2000, 3), HINT + "X"), ("a.stl", (2000, 1, 0), HINT + "X"),
    ("a.ply", (99, 100, 99), ""), ("a.glb", (1, 2000, 3), ""), ("a.GLTF", (1, 2000, 3), ""),
    ("a.laz", (1, 2000, 3), ""),
])  # fmt: skip
def test_only_what_is_large_and_says_nothing_of_its_unit(
    name: str, extent: tuple[int, int, int], expected: str
) -> None:
    assert unit_hint(Path(name), np.array(extent), "X") == expected


def test_bake_and_info_tell_of_it_once(run: Callable[..., Any], tmp_path: Path) -> None:
    mesh = write_ply(tmp_path / "bust.ply", shapes.box(500.0, 2000.0, 500.0))
    assert (
        f"\nunit                     {HINT}--height of `bake`, `height` in a scene file\n" in run("info", mesh).stdout
    )
    options = "--dpci-resolution", 16, "--layers", 1, "--force"
    assert run("bake", mesh, *options).stderr == f"{mesh}: {HINT}--height\n"
    assert run("bake", mesh, *options, "--height", 2).stderr == ""


@pytest.mark.parametrize("height", [None, 150.0])
def test_a_model_without_a_scene_is_told_of(height: float | None) -> None:
    """Unless its height is given, however large that is."""
    points = shapes.box(500.0, 2000.0, 500.0).positions
    rotation = np.array([[0, 0, 0, 1.0]])
    objects = SimpleNamespace(asset=np.zeros(1, int), rotation=rotation, position=np.zeros((1, 3)), scale=np.ones(1))
    world = SimpleNamespace(
        objects=lambda: objects, owners=lambda: np.zeros(1, int), scene_objects=objects, points=lambda asset: points
    )
    assets = [SimpleNamespace(name="model", up="y", up_is_given=True, height=height)]
    file = Path("a.obj")
    scene = SimpleNamespace(path=file, files=(file,), beside=(), objects=[None], assets=assets)
    renderer: Any = SimpleNamespace(world=world)
    hint = "" if height else f"{HINT}--set assets.model.height=…"
    assert ModelTurn(scene, renderer).message == (hint and f"The model is {hint}")  # type: ignore[arg-type]
    assert stand_upright(scene, renderer) == ([f"a.obj: {hint}"] if hint else [])  # type: ignore[arg-type]
