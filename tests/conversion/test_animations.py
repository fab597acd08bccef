"""Animations of glTF files as keyframes of scene files."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from typer.testing import CliRunner

from converted import difference, of_file, of_scene
from depthwalk.commands.cli import app
from depthwalk.conversion import gltf, keyframes, models
from depthwalk.conversion.gltf import Conversion, convert_gltf
from depthwalk.errors import InputError
from depthwalk.ingest import gltf_models
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene
from glb_files import Glb
from moving_nodes import FACES, WEDGE, Curves, Nodes, posed, write

WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}


@pytest.fixture(autouse=True)
def _all_heavy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four triangles are enough for a model of its own."""
    for module in (models, gltf):
        monkeypatch.setattr(module, "HEAVY", 4)


def apart(made: Conversion, nodes: Nodes, curves: Curves, moment: float) -> float:
    """How far triangles of the scene are at a moment from where the nodes have them."""
    wanted = of_file(write(made.scene.parent.parent / "posed.glb", posed(nodes, curves, moment), {}))
    shown = of_scene(made.scene, moment)
    assert shown.shape == wanted.shape
    return difference(shown, wanted)


def converted(folder: Path, nodes: Nodes, curves: Curves, **more: Any) -> Conversion:
    return convert_gltf(write(folder / "a.glb", nodes, curves, **more), folder / "made")


def count_of_keyframes(scene: Scene) -> int:
    return 0 if scene.animations is None else len(scene.animations.times)


def turn(axis: int, degrees: float) -> list[float]:
    found = [0.0, 0.0, 0.0, math.cos(math.radians(degrees) / 2)]
    found[axis] = math.sin(math.radians(degrees) / 2)
    return found


NUMBERS = st.floats(-2, 2, width=32).map(lambda value: round(value, 3))
FACTORS = st.floats(0.5, 2)
TURNS = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda turn: math.hypot(*turn) > 0.1)


@st.composite
def curve(draw: st.DrawFn, name: str) -> tuple[str, list[float], NDArray[np.float64]]:
    count = draw(st.integers(1, 4))
    times = np.cumsum([draw(st.sampled_from([0.0, 0.25]))] + [draw(st.floats(0.2, 1)) for _ in range(count - 1)])
    value = {
        "translation": st.lists(NUMBERS, min_size=3, max_size=3),
        "rotation": TURNS.map(lambda turn: (np.array(turn) / np.linalg.norm(turn)).tolist()),
        "scale": FACTORS.map(lambda factor: [factor] * 3),
    }[name]
    kind = draw(st.sampled_from(["LINEAR", "LINEAR", "STEP", "CUBICSPLINE"]))
    values = np.array([draw(value) for _ in range(count)], np.float32)
    if kind == "CUBICSPLINE":
        if name == "rotation":  # as exporters do; a spline between opposite ones would pass through 0
            for row in range(1, count):
                values[row] *= math.copysign(1, values[row] @ values[row - 1])
        slope = np.array([draw(value) for _ in range(2 * count)], np.float32) * (0.2 if name == "scale" else 0.5)
        values = np.stack([slope[:count], values, slope[count:]], 1).reshape(3 * count, -1)
    return kind, np.float32(times).astype(float).tolist(), values.astype(float)


@st.composite
def moving_trees(draw: st.DrawFn) -> tuple[Nodes, Curves]:
    """Nodes of two meshes, each hung below an earlier one or from the root, some of which move."""
    nodes: Nodes = []
    curves: Curves = {}
    for number in range(draw(st.integers(1, 5))):
        turned = np.array(draw(TURNS))
        node: dict[str, Any] = {
            "translation": draw(st.lists(NUMBERS, min_size=3, max_size=3)),
            "rotation": (turned / np.linalg.norm(turned)).tolist(),
            "scale": [draw(FACTORS)] * 3,
        }
        if draw(st.booleans()) or number == 0:
            node["mesh"] = draw(st.integers(0, 1))
        if number and draw(st.booleans()):
            nodes[draw(st.integers(0, number - 1))].setdefault("children", []).append(number)
        nodes.append(node)
        for name in draw(st.lists(st.sampled_from(sorted(WIDTHS)), unique=True, max_size=3)):
            curves[number, name] = draw(curve(name))
    return nodes, curves


@settings(max_examples=60, phases=[Phase.explicit, Phase.generate])
@given(moving_trees(), st.lists(st.floats(0, 1), min_size=3, max_size=3))
def test_any_tree_of_nodes_moves_the_same_way(
    tmp_path_factory: pytest.TempPathFactory, tree: tuple[Nodes, Curves], parts: list[float]
) -> None:
    nodes, curves = tree
    made = converted(tmp_path_factory.mktemp("tree"), nodes, curves)
    assert not made.notes
    end = max((times[-1] for _, times, _ in curves.values()), default=0.0)
    jumps = [time for kind, times, _ in curves.values() if kind == "STEP" for time in times]
    for part in parts:
        moment = part * end * 0.999
        if all(abs(moment - jump) > 0.02 for jump in jumps):
            wanted = of_file(write(made.scene.parent.parent / "posed.glb", posed(nodes, curves, moment), {}))
            shown = of_scene(made.scene, moment)
            assert shown.shape == wanted.shape
            # Angles are off by 0.1° each, of wedges a few metres large; areas weigh as lengths do.
            size = max(float(np.ptp(wanted.reshape(-1, 3), axis=0).max()), 1.0)
            assert difference(shown, wanted) < 0.01 * size**2


def test_whole_turns_are_two_keyframes_and_go_on(tmp_path: Path) -> None:
    """Quarters of a turn about y, each of which is the shorter way, are one line from 0° to 360°."""
    quarters = np.array([turn(1, 90 * number) for number in range(5)])
    curves: Curves = {(0, "rotation"): ("LINEAR", [0.0, 1.0, 2.0, 3.0, 4.0], quarters)}
    nodes: Nodes = [{"children": [1]}, {"mesh": 0, "translation": [-0.5, 0, -1.5]}]  # the wedge's base is on the axis
    made = converted(tmp_path, nodes, curves)
    assert count_of_keyframes(load_scene(made.scene)) == 2 and not made.notes
    for moment in (0.3, 1.7, 3.9):
        assert apart(made, nodes, curves, moment) < 2e-3
        assert difference(of_scene(made.scene, moment + 8), of_scene(made.scene, moment)) < 1e-3


def test_circles_are_as_many_keyframes_as_a_millimetre_takes(tmp_path: Path) -> None:
    quarters = np.array([turn(1, 90 * number) for number in range(5)])
    curves: Curves = {(0, "rotation"): ("LINEAR", [0.0, 1.0, 2.0, 3.0, 4.0], quarters)}
    nodes: Nodes = [{"children": [1]}, {"mesh": 0, "translation": [5, 0, 0]}]
    made = converted(tmp_path, nodes, curves)
    radius = math.hypot(5.5, 1.5) - 1e-9  # of the base's middle; an arc is off its chord by r (1 − cos(half of it))
    fewest = math.pi / math.acos(1 - 1e-3 / radius)
    assert fewest < count_of_keyframes(load_scene(made.scene)) < 3 * fewest
    assert max(apart(made, nodes, curves, moment) for moment in np.linspace(0, 3.99, 9)) < 6e-3


def test_all_objects_begin_again_together(tmp_path: Path) -> None:
    """What has stopped before the others stays there until the animation is over, and what begins later waits."""
    curves: Curves = {
        (0, "translation"): ("LINEAR", [0.0, 1.0], np.array([(0, 0, 0), (0, 4, 0)])),
        (1, "translation"): ("LINEAR", [2.0, 3.0], np.array([(9, 0, 0), (9, 4, 0)])),
    }
    nodes: Nodes = [{"mesh": 0}, {"mesh": 1, "translation": [9, 0, 0]}]
    made = converted(tmp_path, nodes, curves)
    for moment in (0.5, 1.5, 2.5):
        assert apart(made, nodes, curves, moment) < 2e-3
        assert difference(of_scene(made.scene, moment + 3), of_scene(made.scene, moment)) < 1e-3


@pytest.mark.parametrize("beside", [False, True])
def test_steps_jump(tmp_path: Path, beside: bool) -> None:
    """Also beside a channel that moves evenly: then there are two keyframes, 2 ms apart."""
    steps = np.array([(0, 0, 0), (0, 3, 0), (0, 3, 0), (4, 0, 0)])
    curves: Curves = {(0, "translation"): ("STEP", [0.0, 0.7, 1.1, 1.3], steps)}
    if beside:
        curves[0, "rotation"] = ("LINEAR", [0.0, 2.0], np.array([turn(1, 0), turn(1, 100)]))
    nodes: Nodes = [{"mesh": 0}]
    made = converted(tmp_path, nodes, curves)
    for moment in (0.0, 0.3, 0.69, 0.71, 1.0, 1.29):
        assert apart(made, nodes, curves, moment) < 8e-3
    if not beside:
        assert count_of_keyframes(load_scene(made.scene)) == 3 and "interpolation: step" in made.scene.read_text()


def test_a_far_jump_before_a_long_rest_is_within_reach(tmp_path: Path) -> None:
    """Only curves leave the range of their keyframes, as far as they are steep."""
    curves: Curves = {
        (0, "translation"): ("STEP", [0.0, 1.0, 5e4], np.array([(0, 0, 0), (2000, 0, 0), (2000, 0, 0)])),
        (0, "rotation"): ("LINEAR", [0.0, 5e4], np.array([turn(1, 0), turn(1, 90)])),
    }
    nodes: Nodes = [{"mesh": 0}]
    made = converted(tmp_path, nodes, curves)
    assert max(apart(made, nodes, curves, moment) for moment in (0.5, 1.5, 3e4)) < 0.02


@pytest.mark.parametrize(("turns", "notes"), [(150, 0), (250, 1)])
def test_more_turns_than_a_scene_file_counts(tmp_path: Path, turns: int, notes: int) -> None:
    """Angles reach from −100 to 100 turns."""
    times = np.arange(4 * turns + 1) / 4
    curves: Curves = {(0, "rotation"): ("LINEAR", times.tolist(), np.array([turn(1, 360 * time) for time in times]))}
    nodes: Nodes = [{"children": [1]}, {"mesh": 0, "translation": [-0.5, 0, -1.5]}]
    made = converted(tmp_path, nodes, curves)
    assert len(made.notes) == notes
    if not notes:
        assert max(apart(made, nodes, curves, moment) for moment in (0.1, 77.7, 149.9)) < 6e-3


def test_steep_pitches_are_passed(tmp_path: Path) -> None:
    """A somersault about x goes through a pitch of ±90°, where yaw and roll are the same turn."""
    quarters = np.array([turn(0, 90 * number) for number in range(5)])
    curves: Curves = {(0, "rotation"): ("LINEAR", [0.0, 1.0, 2.0, 3.0, 4.0], quarters)}
    nodes: Nodes = [{"children": [1]}, {"mesh": 0}]
    made = converted(tmp_path, nodes, curves)
    assert max(apart(made, nodes, curves, moment) for moment in np.linspace(0, 3.99, 21)) < 6e-3
    curves = {(0, "rotation"): ("LINEAR", [0.0, 1.0], np.array([turn(0, 90), turn(2, 90)]))}  # begins there
    (other := tmp_path / "other").mkdir()
    made = converted(other, nodes, curves)
    assert max(apart(made, nodes, curves, moment) for moment in np.linspace(0, 0.99, 21)) < 0.02


def test_what_appears_grows_from_nothing(tmp_path: Path) -> None:
    curves: Curves = {(0, "scale"): ("LINEAR", [0.0, 1.0, 2.0], np.array([(0, 0, 0), (0, 0, 0), (1, 1, 1)]))}
    nodes: Nodes = [{"mesh": 0, "scale": [0, 0, 0]}]
    made = converted(tmp_path, nodes, curves)
    assert made.objects == 1
    for moment in (0.5, 1.05, 1.5, 1.9):
        assert apart(made, nodes, curves, moment) < 6e-3


def test_integers_stand_for_fractions_of_turns(tmp_path: Path) -> None:
    curves: Curves = {(0, "rotation"): ("LINEAR", [0.0, 1.0], np.array([turn(1, 0), turn(1, 90)]))}
    path = write(tmp_path / "a.glb", [{"mesh": 0}], curves)
    glb = Glb()
    glb.mesh({"POSITION": glb.accessor(WEDGE)}, FACES)
    turned = glb.accessor(np.rint(np.array([turn(1, 0), turn(1, 90)]) * 32767), "i2", normalized=True)
    sampler = {"input": glb.accessor([0.0, 1.0]), "output": turned}
    channel = {"sampler": 0, "target": {"node": 0, "path": "rotation"}}
    glb.header["animations"] = [{"samplers": [sampler], "channels": [channel]}]
    other = glb.write(tmp_path / "b.glb", {"mesh": 0})
    made = [convert_gltf(file, tmp_path / file.stem) for file in (path, other)]
    assert difference(of_scene(made[0].scene, 0.6), of_scene(made[1].scene, 0.6)) < 1e-3


def test_copies_that_move_share_their_asset(tmp_path: Path) -> None:
    """Two copies of a wedge on a wheel, one of them turning itself, one beside it, which stands."""
    nodes: Nodes = [
        {"children": [1, 2], "rotation": turn(0, 20)},
        {"mesh": 0, "name": "a", "translation": [3, 0, 0]},
        {"mesh": 0, "name": "b", "translation": [-3, 0, 0], "scale": [2, 2, 2]},
        {"mesh": 0, "name": "c", "translation": [0, 0, 9]},
    ]
    curves: Curves = {
        (0, "rotation"): ("LINEAR", [0.0, 1.0], np.array([turn(1, 0), turn(1, 120)])),
        (2, "translation"): ("CUBICSPLINE", [0.0, 1.0], np.array([(0, 0, 0), (-3, 0, 0), (0, 4, 0)] * 2)),
    }
    made = converted(tmp_path, nodes, curves)
    scene = load_scene(made.scene)
    assert (made.models, made.objects) == (1, 3)
    assert scene.animations is not None and len(scene.animations.node) == 2
    assert max(apart(made, nodes, curves, moment) for moment in (0.1, 0.5, 0.9)) < 0.01


def test_light_things_that_move_are_not_merged_with_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(models, "HEAVY", 100)
    nodes: Nodes = [{"mesh": 0}, {"mesh": 0, "translation": [5, 0, 0]}, {"mesh": 1, "translation": [0, 0, 5]}]
    curves: Curves = {(1, "translation"): ("LINEAR", [0.0, 1.0], np.array([(5, 0, 0), (5, 2, 0)]))}
    made = converted(tmp_path, nodes, curves)
    assert (made.models, made.objects) == (2, 2)
    assert apart(made, nodes, curves, 0.5) < 2e-3


def test_groups_in_which_something_moves_are_no_single_things(tmp_path: Path) -> None:
    """Two cars of a body and a wheel are one model each time, unless the wheel of one turns."""
    nodes: Nodes = [
        {"mesh": 0, "children": [1]},
        {"mesh": 1, "translation": [2, 0, 0]},
        {"mesh": 0, "children": [3], "translation": [0, 0, 9]},
        {"mesh": 1, "translation": [2, 0, 0]},
    ]
    drives: Curves = {(2, "translation"): ("LINEAR", [0.0, 1.0], np.array([(0, 0, 9), (5, 0, 9)]))}
    turns: Curves = {(3, "rotation"): ("LINEAR", [0.0, 1.0], np.array([turn(2, 0), turn(2, 90)]))}
    for curves, count in ((drives, 2), (turns, 3), (drives | turns, 3)):
        (folder := tmp_path / str(len(list(tmp_path.iterdir())))).mkdir()
        made = converted(folder, nodes, curves)
        assert made.objects == count
        assert apart(made, nodes, curves, 0.6) < 6e-3


def test_instances_move_with_their_node(tmp_path: Path) -> None:
    glb = Glb()
    glb.mesh({"POSITION": glb.accessor(WEDGE)}, FACES)
    places = {"TRANSLATION": glb.accessor([(0, 0, 0), (3, 0, 0)])}
    sampler = {"input": glb.accessor([0.0, 1.0]), "output": glb.accessor([(0, 0, 0), (0, 6, 0)])}
    channel = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
    glb.header["animations"] = [{"samplers": [sampler], "channels": [channel]}]
    path = glb.write(tmp_path / "a.glb", {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": places}}})
    made = convert_gltf(path, tmp_path / "made")
    moved = of_scene(made.scene, 0.5) - of_scene(made.scene, 0.0)
    assert moved == pytest.approx(np.tile([0.0, 3.0, 0.0], (8, 3, 1)), abs=2e-3)


def test_what_a_scene_cannot_say_is_noted(tmp_path: Path) -> None:
    glb = Glb()
    glb.mesh({"POSITION": glb.accessor(WEDGE)}, FACES)
    sampler = {"input": glb.accessor([0.0, 1.0]), "output": glb.accessor([(1, 1, 1), (1, 3, 1)])}
    weights = {"input": glb.accessor([0.0, 1.0]), "output": glb.accessor([0.0, 1.0])}
    channels = [
        {"sampler": 0, "target": {"node": 0, "path": "scale"}},
        {"sampler": 1, "target": {"node": 0, "path": "weights"}},
        {"sampler": 1, "target": {"path": "pointer", "extensions": {}}},
    ]
    glb.header["animations"] = [{"samplers": [sampler, weights], "channels": channels}, {}, {}]
    glb.header["skins"] = [{"joints": [0]}]
    glb.header["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]
    light = {"extensions": {"KHR_lights_punctual": {"light": 0}}}
    glb.header["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point"}]}}
    nodes: Nodes = [{"mesh": 0, "children": [1, 2, 3]}, {"camera": 0}, light, {"mesh": 0, "skin": 0}]
    path = glb.write(tmp_path / "a.glb", *nodes, roots=[0])
    run = CliRunner().invoke(app, ["convert", str(path)])
    assert run.exit_code == 0, run.stderr
    assert run.stdout.splitlines()[:-2] == [
        "2 animations are left out, the first one stays",
        "shape keys do not move",
        "of the animation, only positions, rotations and scales of nodes are kept",
        "skinned meshes keep the pose that the file has them in",
        "cameras stand still",
        "lights stand still",
        "1 object moves without its change of shape: objects change their size alone",
    ]


def test_what_takes_too_many_keyframes_stands_still(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(keyframes, "MAX_KEYFRAMES", 3)
    moves = np.array([(0, 1, 0), (0, 5, 0)])
    nodes: Nodes = [{"mesh": 0}, {"mesh": 1, "translation": [9, 0, 0]}]
    curves: Curves = {(number, "translation"): ("LINEAR", [0.0, 1.0], moves) for number in (0, 1)}
    made = converted(tmp_path, nodes, curves)
    assert count_of_keyframes(load_scene(made.scene)) == 2
    assert [note[:38] for note in made.notes] == ["1 object that should move stands still"]
    assert apart(made, nodes, curves, 0.0) < 2e-3  # both are where they are at the beginning
    assert 3 < apart(made, nodes, curves, 0.99) < 5
    monkeypatch.setattr(gltf_models, "_MOST_MOVING", 1)
    (other := tmp_path / "other").mkdir()
    assert "1 object that should" in converted(other, nodes, curves).notes[0]


def test_nodes_held_at_one_place_stand_there(tmp_path: Path) -> None:
    """Exporters write channels for all nodes; what these keep where it is does not move, and is merged like others."""
    held = np.array([(3, 0, 0), (3, 0, 0)])
    nodes: Nodes = [{"mesh": 0}, {"mesh": 1}]
    curves: Curves = {
        (0, "translation"): ("LINEAR", [0.0, 1.0], held),
        (1, "rotation"): ("LINEAR", [0.0, 1.0], np.array([turn(1, 0), turn(1, 60)])),
    }
    made = converted(tmp_path, nodes, curves)
    scene = load_scene(made.scene)
    assert scene.animations is not None and len(scene.animations.node) == 1
    assert apart(made, nodes, curves, 0.5) < 6e-3


def _changed(**more: Any) -> Any:
    return lambda header: header["animations"][0]["samplers"][0].update(more)


@pytest.mark.parametrize(
    ("times", "values", "change", "reason"),
    [
        ([0.0, 2.0, 1.0], [(0, 0, 0)] * 3, None, "keyframes do not ascend"),
        ([0.0, math.nan], [(0, 0, 0)] * 2, None, "keyframes are not at 0 to 1e.06 s"),
        ([-1.0, 1.0], [(0, 0, 0)] * 2, None, "keyframes are not at 0"),
        ([0.0, 1e30], [(0, 0, 0)] * 2, None, "keyframes are not at 0"),
        ([0.0, 1.0], [(0, 0, 0), (0, math.inf, 0)], None, "are not 3 numbers within reach"),
        ([0.0, 1.0], [(0, 0), (1, 1)], None, "are not 3 numbers within reach"),
        ([0.0, 1.0], [(0, 0, 0), (0, 5e6, 0)], None, "an object moves 5e.06 m from the origin"),
        ([0.0, 1.0], [(0, 0, 0)] * 3, None, "has 3 values instead of 2"),
        ([0.0, 1.0], [(0, 0, 0)] * 2, _changed(interpolation="CUBICSPLINE"), "has 2 values instead of 6"),
        ([0.0, 1.0], [(0, 0, 0)] * 2, _changed(interpolation="BEZIER"), "unknown interpolation BEZIER"),
        ([0.0, 1.0], [(0, 0, 0)] * 2, _changed(input=99), "IndexError"),
        ([0.0, 1.0], [(0, 0, 0)] * 2, lambda header: header["animations"][0].pop("channels"), "KeyError"),
        ([0.0, 1.0], [(0, 0, 0)] * 2, lambda header: header["nodes"][0].update(matrix=[0] * 16), "node 0 has a matrix"),
        (
            [0.0, 1.0],
            [(0, 0, 0)] * 2,
            lambda header: header["animations"][0]["channels"][0]["target"].update(node=7),
            "there is no node 7",
        ),
        (
            [0.0, 1.0],
            [(0, 0, 0)] * 2,
            lambda header: header["accessors"][-2].update(count=10**6, sparse={"count": 0}),
            "1000000 keyframes, the limit is 100000",
        ),
    ],
)
def test_damaged_animations_make_nothing(tmp_path: Path, times: Any, values: Any, change: Any, reason: str) -> None:
    glb = Glb()
    glb.mesh({"POSITION": glb.accessor(WEDGE)}, FACES)
    sampler = {"input": glb.accessor(times), "output": glb.accessor(values)}
    channel = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
    glb.header |= {"animations": [{"samplers": [sampler], "channels": [channel]}]}
    glb.header |= {"nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}]}
    if change is not None:
        change(glb.header)
    path = glb.write(tmp_path / "a.glb")
    with pytest.raises(InputError, match=reason) as refused:
        convert_gltf(path, tmp_path / "made")
    assert str(refused.value).startswith(f"{path}: ")
    assert [file.name for file in tmp_path.iterdir()] == ["a.glb"]
