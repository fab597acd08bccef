"""Scenes of glTF files as scene files."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from typer.testing import CliRunner

from converted import difference, of_file, of_scene
from depthwalk.commands.cli import app
from depthwalk.conversion import gltf, models
from depthwalk.conversion.gltf import convert_gltf
from depthwalk.errors import InputError
from depthwalk.ingest.gltf import read_header
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset
from glb_files import Glb

# No two of its corners and edges are alike, so that no turn or mirror maps it to itself.
WEDGE = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)], float)
FACES = (0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3)


def wedge(glb: Glb, size: float = 1.0, **more: Any) -> int:
    return glb.mesh({"POSITION": glb.accessor(WEDGE * size)}, FACES, **more)


@pytest.fixture(autouse=True)
def _all_heavy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four triangles are enough for a model of its own."""
    for module in (models, gltf):
        monkeypatch.setattr(module, "HEAVY", 4)


@pytest.fixture
def copies(tmp_path: Path) -> Path:
    """Three wedges, one of them with its node hung below another and mirrored, and a smaller one."""
    glb = Glb()
    wedge(glb)
    wedge(glb, 0.5)
    return glb.write(
        tmp_path / "scene.glb",
        {"mesh": 0, "name": "a", "translation": [5, 0, 0], "children": [1]},
        {"mesh": 0, "name": "b", "rotation": [0, math.sin(0.4), 0, math.cos(0.4)], "scale": [2, 2, 2]},
        {"mesh": 0, "name": "c", "translation": [0, 1, 7], "scale": [-1, 1, 1]},
        {"mesh": 1, "translation": [0, 0, -9]},
        roots=[0, 2, 3],
    )


def test_copies_become_objects_of_one_asset_where_the_file_shows_them(copies: Path, tmp_path: Path) -> None:
    made = convert_gltf(copies, tmp_path / "made")
    assert (made.models, made.objects, made.triangles) == (3, 4, 16)  # the mirrored one has a mesh of its own
    assert difference(of_scene(made.scene), of_file(copies)) < 1e-4
    scene = load_scene(made.scene)
    assert sorted(np.bincount(scene.objects.asset)) == [1, 1, 2]


NUMBERS = st.floats(-5, 5, width=32).map(lambda value: round(value, 3))
FACTORS = st.floats(0.25, 4).flatmap(lambda value: st.sampled_from([value, -value]))
TURNS = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda turn: math.hypot(*turn) > 0.1)


@st.composite
def nodes(draw: st.DrawFn) -> list[dict[str, Any]]:
    """Nodes of two meshes, each hung below an earlier one or from the root, with any transform but singular ones."""
    made: list[dict[str, Any]] = []
    for number in range(draw(st.integers(1, 6))):
        turn = np.array(draw(TURNS))
        node = {
            "translation": draw(st.lists(NUMBERS, min_size=3, max_size=3)),
            "rotation": (turn / np.linalg.norm(turn)).tolist(),
            "scale": draw(st.one_of(FACTORS.map(lambda one: [one] * 3), st.lists(FACTORS, min_size=3, max_size=3))),
        }
        if draw(st.booleans()) or number == 0:
            node["mesh"] = draw(st.integers(0, 1))
        if number and draw(st.booleans()):
            made[draw(st.integers(0, number - 1))].setdefault("children", []).append(number)
        made.append(node)
    return made


@given(nodes())
def test_any_tree_of_nodes_shows_the_same_triangles(tmp_path_factory: pytest.TempPathFactory, tree: Any) -> None:
    folder = tmp_path_factory.mktemp("tree")
    glb = Glb()
    wedge(glb)
    wedge(glb, 0.5)
    children = {child for node in tree for child in node.get("children", [])}
    path = glb.write(folder / "a.glb", *tree, roots=[number for number in range(len(tree)) if number not in children])
    shown, wanted = of_scene(convert_gltf(path, folder / "made").scene), of_file(path)
    assert shown.shape == wanted.shape
    size = float(np.abs(wanted).max())
    assert difference(shown, wanted) < 2e-3 * size * max(size, 1)


def test_turns_of_exporters_go_into_the_mesh(tmp_path: Path) -> None:
    glb = Glb()
    wedge(glb)
    upright = [-math.sqrt(0.5), 0, 0, math.sqrt(0.5)]  # z becomes y
    path = glb.write(
        tmp_path / "a.glb",
        {"mesh": 0, "rotation": upright},
        {"translation": [4, 0, 0], "rotation": [0, math.sin(0.3), 0, math.cos(0.3)], "children": [2]},
        {"mesh": 0, "rotation": upright, "scale": [2, 2, 2]},
        roots=[0, 1],
    )
    made = convert_gltf(path, tmp_path / "made")
    scene = load_scene(made.scene)
    assert made.models == 1 and difference(of_scene(made.scene), of_file(path)) < 1e-4
    assert scene.objects.rotation[:, [0, 2]] == pytest.approx(np.zeros((2, 2)), abs=1e-6)  # all upright


def test_meshes_that_are_listed_again_are_one_model(tmp_path: Path) -> None:
    glb = Glb()
    wedge(glb, material=0)
    wedge(glb, material=1)  # the same data a second time, and a material that differs by its name alone
    wedge(glb, material=2)
    glb.header["materials"] = [{"name": "a"}, {"name": "b"}, {"doubleSided": True}]
    path = glb.write(tmp_path / "a.glb", *({"mesh": mesh, "translation": [9 * mesh, 0, 0]} for mesh in range(3)))
    made = convert_gltf(path, tmp_path / "made")
    assert sorted(np.bincount(load_scene(made.scene).objects.asset)) == [1, 2]


def car(first: int) -> list[dict[str, Any]]:
    """A body with two wheels below it, as nodes from the number `first` on."""
    wheels = [{"mesh": 1, "translation": [side, 0, 0]} for side in (-2, 2)]
    return [{"mesh": 0, "name": f"car.{first}", "children": [first + 1, first + 2]}, *wheels]


def test_copies_of_nodes_with_all_below_them_are_one_model(tmp_path: Path) -> None:
    glb = Glb()
    wedge(glb)
    wedge(glb, 0.5)
    cars = [node for number in range(3) for node in car(3 * number)]
    for number in range(3):
        cars[3 * number] |= {"translation": [0, 0, 10 * number], "scale": [1 + number] * 3}
    path = glb.write(tmp_path / "a.glb", *cars, roots=[0, 3, 6])
    made = convert_gltf(path, tmp_path / "made")
    assert (made.models, made.objects, made.triangles) == (1, 3, 36)
    assert difference(of_scene(made.scene), of_file(path)) < 1e-4


def test_groups_that_repeat_what_they_hold_are_no_models(tmp_path: Path) -> None:
    glb = Glb()
    wedge(glb)
    rows = [
        {"translation": [0, 0, 10 * number], "children": list(range(2 + 9 * number, 11 + 9 * number))}
        for number in (0, 1)
    ]
    trees = [{"mesh": 0, "translation": [3 * number, 0, 0]} for number in range(9)]
    made = convert_gltf(glb.write(tmp_path / "a.glb", *rows, *trees, *trees, roots=[0, 1]), tmp_path / "made")
    assert (made.models, made.objects) == (1, 18)


def test_instances_are_placements(tmp_path: Path) -> None:
    count = 30  # more than the scene file lists
    glb = Glb()
    wedge(glb)
    places = {
        "TRANSLATION": glb.accessor(np.arange(3 * count).reshape(count, 3)),
        "ROTATION": glb.accessor([[0, 127, 0, 0]] * count, "i1", normalized=True),  # half a turn about y
        "SCALE": glb.accessor(np.repeat(np.linspace(1, 3, count)[:, None], 3, 1)),
    }
    glb.header |= {"extensionsRequired": ["EXT_mesh_gpu_instancing"]}
    instancing = {"extensions": {"EXT_mesh_gpu_instancing": {"attributes": places}}}
    path = glb.write(tmp_path / "a.glb", {"mesh": 0, "translation": [0, 50, 0]} | instancing)
    made = convert_gltf(path, tmp_path / "made")
    objects = load_scene(made.scene).objects
    assert (made.models, len(objects)) == (1, count) and (made.scene.parent / "places").is_dir()
    # The mesh stands half a metre from its origin, which half a turn puts to the other side; its base is at its origin.
    base = np.array([-0.5, 0, -1.5]) * np.linspace(1, 3, count)[:, None]
    assert objects.position == pytest.approx(base + np.arange(3 * count).reshape(count, 3) + (0, 50, 0), abs=1e-4)
    assert objects.scale / objects.scale[0] == pytest.approx(np.linspace(1, 3, count), rel=1e-5)


def test_shape_keys_and_skins_are_converted_in_their_pose(tmp_path: Path) -> None:
    glb = Glb()
    moved = glb.accessor(np.tile([0.0, 4.0, 0.0], (4, 1)))
    wedge(glb, targets=[{"POSITION": moved}])
    joints = {"JOINTS_0": glb.accessor([(0, 0, 0, 0)] * 4, "u1"), "WEIGHTS_0": glb.accessor([(1, 0, 0, 0)] * 4)}
    glb.mesh({"POSITION": glb.accessor(WEDGE)} | joints, FACES)
    glb.header["skins"] = [{"joints": [2]}]
    nodes: list[dict[str, Any]] = [{"mesh": 0, "weights": [0.5]}, {"mesh": 1, "skin": 0}, {"translation": [9, 0, 0]}]
    path = glb.write(tmp_path / "a.glb", *nodes)
    made = convert_gltf(path, tmp_path / "made")
    assert difference(of_scene(made.scene), of_file(path)) < 1e-4


def test_light_things_are_merged_and_heavy_ones_are_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(models, "HEAVY", 10)
    glb = Glb()
    wedge(glb)
    wedge(glb, 0.5)
    often = [{"mesh": 0, "translation": [3 * number, 0, 0]} for number in range(3)]
    rarely = [{"mesh": 1, "translation": [3 * number, 0, 5]} for number in range(2)]
    path = glb.write(tmp_path / "a.glb", *often, *rarely)
    made = convert_gltf(path, tmp_path / "made")
    assert (made.models, made.objects, made.triangles) == (2, 4, 20)
    assert difference(of_scene(made.scene), of_file(path)) < 1e-4


def test_copies_that_are_merged_for_their_shapes_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Four wedges are enough for a model if they are alike, and each alone is not."""
    monkeypatch.setattr(models, "HEAVY", 16)
    glb = Glb()
    wedge(glb)
    alike = [{"mesh": 0, "translation": [3 * number, 0, 0]} for number in range(4)]
    made = convert_gltf(glb.write(tmp_path / "a.glb", *alike), tmp_path / "made")
    assert (made.objects, made.notes) == (4, ())
    for number, node in enumerate(alike):
        node["scale"] = [1, 1 + number, 1]
    made = convert_gltf(glb.write(tmp_path / "b.glb", *alike), tmp_path / "other")
    assert made.objects == 1 and made.notes[0].startswith("4 objects merged with the surroundings")


def test_cameras_and_lights_are_kept(tmp_path: Path) -> None:
    glb = Glb()
    wedge(glb)
    lights = [
        {"type": "directional", "intensity": 4 * math.pi, "color": [1, 0.5, 0]},
        {"type": "spot", "intensity": math.pi, "range": 7.0, "spot": {"outerConeAngle": math.radians(20)}},
    ]
    glb.header["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    glb.header["cameras"] = [{"type": "perspective", "perspective": {"yfov": math.radians(40), "znear": 0.1}}]
    down = [-math.sqrt(0.5), 0, 0, math.sqrt(0.5)]  # −z becomes −y
    path = glb.write(
        tmp_path / "a.glb",
        {"mesh": 0},
        {"camera": 0, "translation": [1, 2, 3]},
        {"extensions": {"KHR_lights_punctual": {"light": 0}}, "rotation": down},
        {"extensions": {"KHR_lights_punctual": {"light": 1}}, "translation": [0, 5, 0]},
    )
    scene = load_scene(convert_gltf(path, tmp_path / "made").scene)
    camera, (lamp,), sun = scene.camera, scene.environment.lights, scene.environment.sun
    assert camera is not None and camera.fov == pytest.approx(math.radians(40))
    assert camera.position == (1, 2, 3) and camera.target == pytest.approx((1, 2, -2))
    assert sun.direction == pytest.approx((0, -1, 0), abs=1e-5) and sun.intensity == pytest.approx(1)
    assert sun.colour == pytest.approx((1, 0.7354, 0), abs=1e-4)  # linear 0.5 in sRGB
    assert (lamp.intensity, lamp.range, lamp.angle) == pytest.approx((0.25, 7, 40))
    assert lamp.direction == pytest.approx((0, 0, -1))


def test_only_used_materials_and_pictures_go_with_a_mesh(tmp_path: Path) -> None:
    glb = Glb()
    uv = [(0, 0), (1, 0), (0, 1), (1, 1)]
    for number in range(2):
        attributes = {"POSITION": glb.accessor(WEDGE * (1 + number)), "TEXCOORD_0": glb.accessor(uv)}
        glb.mesh(attributes, FACES, material=number)
    picture = tmp_path / "red paint.png"
    Image.new("RGB", (4, 4), (200, 30, 20)).save(picture)
    glb.header["images"] = [
        {"bufferView": glb.view(picture.read_bytes()), "mimeType": "image/png", "name": "wood"},
        {"uri": "red%20paint.png"},
    ]
    glb.header["textures"] = [{"source": 0}, {"source": 1}]
    glb.header["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": number}}} for number in (1, 0)]
    made = convert_gltf(glb.write(tmp_path / "a.glb", {"mesh": 0}, {"mesh": 1}), tmp_path / "made")
    scene = load_scene(made.scene)
    pictures = []
    for asset in scene.assets:
        assert isinstance(asset, MeshAsset)
        header = read_header(asset.mesh.read_bytes(), asset.mesh)
        pictures += [image["uri"] for image in header["images"]]
        assert len(header["materials"]) == len(header["textures"]) == len(header["images"]) == 1
    assert sorted(pictures) == ["textures/red-paint-1.png", "textures/wood-0.png"]
    assert all((made.scene.parent / name).read_bytes() == picture.read_bytes() for name in pictures)


def test_a_missing_picture_is_told_with_the_file_that_names_it(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    glb = Glb()
    wedge(glb, material=0)
    glb.header["images"] = [{"uri": "gone.png"}]
    glb.header["textures"] = [{"source": 0}]
    glb.header["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    path = glb.write(tmp_path / "a.glb")
    convert_gltf(path, tmp_path / "made")
    assert f"{path}: picture 'gone.png' is missing; ignored" in caplog.messages


def test_what_surrounds_the_viewer_has_no_depth_images(tmp_path: Path) -> None:
    glb = Glb()
    wedge(glb, 100)
    wedge(glb)
    glb.header["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]
    path = glb.write(
        tmp_path / "a.glb",
        {"mesh": 0},
        {"mesh": 1, "translation": [500, 0, 0]},
        {"camera": 0, "translation": [9, 9, 9]},
    )
    by_size = sorted(load_scene(convert_gltf(path, tmp_path / "made").scene).assets, key=lambda asset: asset.name)
    assert [isinstance(asset, MeshAsset) and asset.dpci is not None for asset in by_size] == [False, True]


def test_a_folder_with_files_is_left_alone(copies: Path, tmp_path: Path) -> None:
    made = tmp_path / "made"
    made.mkdir()
    (made / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match="made: is not empty; name another folder with -o"):
        convert_gltf(copies, made)
    assert [file.name for file in made.iterdir()] == ["mine.txt"]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda header: header["nodes"][0].update(mesh=7), "list index out of range"),
        (lambda header: header["nodes"][1].update(children=[0]), "node 0 hangs from 2 nodes"),
        (lambda header: header["nodes"][0].update(translation=[1e300, 0, 0]), "node 0 is out of reach"),
        (lambda header: header["meshes"][0]["primitives"][0].update(attributes={}), "KeyError"),
        (lambda header: header["accessors"][0].update(bufferView=99), "IndexError"),
        (lambda header: header.update(extensionsRequired=["KHR_audio_emitter"]), "is not supported"),
        (lambda header: header.update(nodes=[]), "."),
        (lambda header: header["nodes"][0].update(scale=[0, 0, 0]), "its scene shows no triangles"),
    ],
)
def test_damaged_files_make_nothing(tmp_path: Path, change: Any, reason: str) -> None:
    glb = Glb()
    wedge(glb)
    glb.header |= {"nodes": [{"mesh": 0}, {}], "scenes": [{"nodes": [0, 1]}]}
    change(glb.header)
    path = glb.write(tmp_path / "a.glb")
    with pytest.raises(InputError, match=reason):
        convert_gltf(path, tmp_path / "made")
    assert [file.name for file in tmp_path.iterdir()] == ["a.glb"]


def test_the_command_makes_a_folder_beside_the_file(copies: Path) -> None:
    run = CliRunner().invoke(app, ["convert", str(copies)])
    assert run.exit_code == 0 and "scene.yaml: 3 models, 4 objects, 16 triangles" in run.stdout
    assert (copies.parent / "scene" / "scene.yaml").is_file()
    again = CliRunner().invoke(app, ["convert", str(copies)])
    assert again.exit_code == 2 and again.stderr.count("\n") == 1 and "is not empty" in again.stderr


def test_messages_name_files_as_they_will_be(tmp_path: Path) -> None:
    """Not by the temporary folder in which they are made: its name would mean nothing, and it is gone."""
    glb = Glb()
    wedge(glb, material=0)
    glb.header["images"] = [{"bufferView": glb.view(b"no picture at all"), "mimeType": "image/png"}]
    glb.header["textures"] = [{"source": 0}]
    glb.header["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    path = glb.write(tmp_path / "unread.glb", {"mesh": 0, "name": "chair"})
    failed = CliRunner().invoke(app, ["convert", str(path)])
    assert (failed.exit_code, failed.stderr) == (
        2,
        f"{path}: {tmp_path / 'unread' / 'textures' / 'picture-0.png'}: cannot be read as an image\n",
    )

    glb = Glb()
    wedge(glb)
    glb.mesh({"POSITION": glb.accessor(WEDGE * (1, 1, 0) * (1, 0, 1))}, FACES)
    path = glb.write(tmp_path / "flat.glb", {"mesh": 0}, {"mesh": 1, "name": "line"})
    failed = CliRunner().invoke(app, ["convert", str(path)])
    assert (failed.exit_code, failed.stderr) == (
        2,
        f"{path}: {tmp_path / 'flat' / 'line'}.glb: flat: none of its 4 faces has an area\n",
    )
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["flat.glb", "unread.glb"]


def test_the_file_is_looked_for_before_a_folder_for_its_scene(tmp_path: Path) -> None:
    run = CliRunner().invoke(app, ["convert", str(tmp_path / "none" / "a.glb")])
    assert (run.exit_code, run.stderr) == (2, f"{tmp_path / 'none' / 'a.glb'}: no such file\n")


def test_points_and_lines_that_are_not_converted_are_told(tmp_path: Path) -> None:
    glb = Glb()
    wedge(glb)
    points = glb.mesh({}, None, mode=0)
    lines = glb.mesh({}, None, mode=3)
    path = glb.write(tmp_path / "a.glb", {"mesh": 0}, {"mesh": points}, {"mesh": lines})
    assert convert_gltf(path, tmp_path / "made").notes == (
        "4 points and 1 set of lines left out: only triangles are converted",
    )
    path = glb.write(tmp_path / "b.glb", {"mesh": points})
    wanted = "its scene shows no triangles; a scan of points needs no conversion: `depthwalk view` shows it$"
    with pytest.raises(InputError, match=wanted):
        convert_gltf(path, tmp_path / "scan")


def test_one_is_no_plural(tmp_path: Path) -> None:
    glb = Glb()
    wedge(glb)
    run = CliRunner().invoke(app, ["convert", str(glb.write(tmp_path / "a.glb"))])
    assert "a.yaml: 1 model, 1 object, 4 triangles" in run.stdout
    one = Glb()
    one.mesh({"POSITION": one.accessor(WEDGE[1:])}, None)
    run = CliRunner().invoke(app, ["info", str(one.write(tmp_path / "b.glb"))])
    assert "1 triangle, " in run.stdout


def test_other_files_hold_no_scenes(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\n")
    run = CliRunner().invoke(app, ["convert", str(tmp_path / "a.obj")])
    assert run.exit_code == 2 and "only glTF, GLB and USD files" in run.stderr
