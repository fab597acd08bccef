"""Scenes of USD files as scene files."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from converted import difference, of_file, of_scene
from depthwalk.conversion import gltf, models
from depthwalk.conversion.gltf import convert_gltf
from depthwalk.errors import InputError
from depthwalk.ingest.usd import nodes
from depthwalk.scene.loader import load_scene
from usd_files import mesh, prim, translate_here, write_usda, xform


@pytest.fixture(autouse=True)
def _here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four triangles are enough for a model of its own."""
    translate_here(monkeypatch)
    for module in (models, gltf):
        monkeypatch.setattr(module, "HEAVY", 4)


@pytest.fixture
def copies(tmp_path: Path) -> Path:
    """Three instances, one of them mirrored, with an instance within each, and three copies at points."""
    small = xform("small", terms="instanceable = true\nreferences = @./wedge.usda@", scale="(0.5, 0.5, 0.5)")
    write_usda(tmp_path / "wedge.usda", xform("World", mesh()))
    write_usda(
        tmp_path / "two.usda", xform("World", mesh("own", points="(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 4)"), small)
    )
    terms = "instanceable = true\nreferences = @./two.usda@"
    instances = [
        xform("a", terms=terms, translate="(10, 0, 0)"),
        xform("b", terms=terms, translate="(20, 1, 0)", rotateY="30"),
        xform("c", terms=terms, translate="(0, 0, 30)", scale="(-1, 1, 1)"),
    ]
    points = prim(
        "PointInstancer", "points", "rel prototypes = [</World/points/p>]", "int[] protoIndices = [0, 0, 0]",
        "point3f[] positions = [(0, 5, 0), (0, 6, 0), (0, 7, 0)]",
        "quath[] orientations = [(1, 0, 0, 0), (0.7, 0, 0.714, 0), (0.1, 0, 0.995, 0)]",
        xform("p", terms="references = @./wedge.usda@"),
    )  # fmt: skip
    return write_usda(tmp_path / "scene.usda", xform("World", *instances, points), up="Z", unit=0.1)


def test_copies_become_objects_of_one_asset_each(copies: Path) -> None:
    made = convert_gltf(copies, copies.parent / "made")
    assert (made.models, made.objects, made.notes) == (4, 9, ())  # mirrored ones have files of their own
    assert difference(of_scene(made.scene), of_file(copies)) < 1e-5


def test_instances_stand_where_nodes_do(copies: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = of_file(copies)
    monkeypatch.setattr(nodes, "_MOST_NODES", 2)
    made = convert_gltf(copies, copies.parent / "made")
    assert made.objects == 9 and difference(of_scene(made.scene), wanted) < 1e-5


def test_cameras_and_lights_are_kept(tmp_path: Path) -> None:
    camera = prim(
        "Camera", "eye", "float focalLength = 10", "float verticalAperture = 20",
        "double3 xformOp:translate = (1, 2, 30)", 'uniform token[] xformOpOrder = ["xformOp:translate"]',
    )  # fmt: skip
    lights = [
        prim("DistantLight", "sun", "float inputs:intensity = 6.2831853", "bool inputs:normalize = 1"),
        prim("SphereLight", "lamp", "float inputs:intensity = 4", "float inputs:radius = 2",
             "color3f inputs:color = (1, 0, 0)"),
        prim("SphereLight", "spot", "float inputs:intensity = 8", "float inputs:radius = 9",
             "bool inputs:normalize = 1", "float inputs:shaping:cone:angle = 20",
             terms='prepend apiSchemas = ["ShapingAPI"]'),
    ]  # fmt: skip
    path = write_usda(tmp_path / "scene.usda", xform("World", mesh(), camera, *lights))
    scene = load_scene(convert_gltf(path, tmp_path / "made").scene)
    assert (
        scene.camera is not None
        and scene.camera.position == (1, 2, 30)
        and scene.camera.fov == pytest.approx(np.pi / 2, abs=1e-5)
    )
    sun, (lamp, spot) = scene.environment.sun, scene.environment.lights
    assert sun.intensity == pytest.approx(1) and sun.direction == pytest.approx((0, 0, -1))
    assert lamp.intensity == pytest.approx(4 * np.pi * 2**2 / (2 * np.pi), abs=1e-3) and lamp.colour == (1, 0, 0)
    assert spot.intensity == pytest.approx(8 / 4 / (2 * np.pi), abs=1e-3) and spot.angle == pytest.approx(40)


def test_a_place_that_is_none_is_told_as_damage_of_a_usd_file(tmp_path: Path) -> None:
    path = write_usda(tmp_path / "scene.usda", xform("World", mesh(), translate="(nan, 0, 0)"))
    with pytest.raises(InputError, match=r"scene\.usda: damaged, truncated or an unsupported kind of USD"):
        convert_gltf(path, tmp_path / "made")


def test_a_light_whose_colour_is_no_number_is_white(tmp_path: Path) -> None:
    sun = prim("DistantLight", "sun", "color3f inputs:color = (nan, inf, 1)")
    path = write_usda(tmp_path / "scene.usda", xform("World", mesh(), sun))
    assert load_scene(convert_gltf(path, tmp_path / "made").scene).environment.sun.colour == (1, 1, 1)


def test_the_picture_of_a_dome_light_is_the_sky(tmp_path: Path) -> None:
    Image.new("RGB", (4, 2), (200, 0, 0)).save(tmp_path / "sky.png")
    dome = prim(
        "DomeLight", "dome", "asset inputs:texture:file = @./sky.png@", "float inputs:intensity = 3",
        "float xformOp:rotateY = 30", 'uniform token[] xformOpOrder = ["xformOp:rotateY"]',
    )  # fmt: skip
    path = write_usda(tmp_path / "scene.usda", xform("World", mesh(), dome))
    made = convert_gltf(path, tmp_path / "made")
    sky = load_scene(made.scene).environment.sky
    assert sky is not None and sky.model == "image" and sky.intensity == pytest.approx(3)
    assert sky.turn == pytest.approx(-150) and (tmp_path / "made" / "sky.png").is_file()
    (tmp_path / "sky.png").write_bytes(b"no picture")
    made = convert_gltf(path, tmp_path / "other")
    assert load_scene(made.scene).environment.sky is not None  # the default
    assert any("the picture of the dome light is left out" in note for note in made.notes)


def test_movement_is_kept_also_of_turns_between_few_times(tmp_path: Path) -> None:
    turns = "{0: 0, 48: 360}"
    body = xform("World", xform("arm", xform("hand", mesh(), translate="(10, 0, 0)"), rotateY=turns))
    path = write_usda(tmp_path / "scene.usda", body, head="  timeCodesPerSecond = 24")
    made = convert_gltf(path, tmp_path / "made")
    assert made.notes == ()
    still = of_file(path)
    for moment, angle in ((0.0, 0.0), (0.3, 0.3 * np.pi), (1.0, np.pi)):
        turn = np.array([(np.cos(angle), 0, np.sin(angle)), (0, 1, 0), (-np.sin(angle), 0, np.cos(angle))])
        assert difference(of_scene(made.scene, moment), still @ turn.T) < 2e-2


def test_instances_move_with_all_that_is_in_them(tmp_path: Path) -> None:
    small = xform("small", terms="instanceable = true\nreferences = @./wedge.usda@", translate="(0, 3, 0)")
    write_usda(tmp_path / "wedge.usda", xform("World", mesh()))
    write_usda(tmp_path / "two.usda", xform("World", mesh("own"), small))
    moving = xform(
        "a", terms="instanceable = true\nreferences = @./two.usda@", translate="{0: (0, 0, 0), 24: (0, 0, 12)}"
    )
    path = write_usda(tmp_path / "scene.usda", xform("World", moving), head="  timeCodesPerSecond = 24")
    made = convert_gltf(path, tmp_path / "made")
    assert difference(of_scene(made.scene, 0.5), of_file(path) + np.array([0, 0, 6])) < 5e-3
