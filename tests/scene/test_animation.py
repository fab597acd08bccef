"""Keyframes of nodes: their curves, what they move, and what a file may not ask for."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from depthwalk.errors import InputError
from depthwalk.scene.animation import animations
from depthwalk.scene.arrays import Nodes
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene, show_moment
from depthwalk.scene.schema import AnimationParams
from depthwalk.scene.similarity import identities

SLIDE = "keyframes: [{time: 0, position: [0, 0, 0]}, {time: 2, position: [4, 0, 0]}]"


def scene(folder: Path, objects: str) -> Scene:
    (folder / "box.ply").touch()
    file = folder / "scene.yaml"
    file.write_text(f"version: 1\nassets: {{box: {{mesh: box.ply}}}}\nobjects:\n{objects}")
    return load_scene(file)


def slider(folder: Path, more: str = "") -> Scene:
    """A box that slides by 4 m along x in two seconds; more: further keys of the animation."""
    return scene(folder, f"  - {{asset: box, animation: {{{SLIDE}{more}}}}}\n")


def places(shown: Scene, *moments: float) -> list[float]:
    """Where the first object is along x at each moment."""
    found = []
    for moment in moments:
        show_moment(shown, moment)
        found.append(float(shown.objects.position[0, 0]))
    return found


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        (", interpolation: linear, repeat: once", [0, 0, 1, 2, 3, 4, 4]),
        (", interpolation: linear", [0, 0, 1, 2, 3, 0, 1]),
        (", interpolation: linear, repeat: ping-pong", [0, 0, 1, 2, 3, 4, 3]),
        (", interpolation: step, repeat: once", [0, 0, 0, 0, 0, 4, 4]),
        (", interpolation: linear, repeat: once, start: 1", [0, 0, 0, 0, 1, 2, 3]),
        (", interpolation: linear, start: -0.5", [0, 1, 2, 3, 0, 1, 2]),
    ],
)
def test_what_follows_the_last_keyframe(tmp_path: Path, more: str, expected: list[float]) -> None:
    assert places(slider(tmp_path, more), -1, 0, 0.5, 1, 1.5, 2, 2.5) == pytest.approx(expected)


def test_a_smooth_curve_passes_through_keyframes_as_the_library_has_it(tmp_path: Path) -> None:
    times, across = np.array([0.0, 0.7, 1.1, 3.0]), np.array([0.0, 2.0, -1.0, 5.0])
    keys = ", ".join(f"{{time: {t}, position: [{x}, 0, 0]}}" for t, x in zip(times, across, strict=True))
    shown = scene(tmp_path, f"  - {{asset: box, animation: {{repeat: once, keyframes: [{keys}]}}}}\n")
    moments = np.linspace(0, 3, 37)
    curve = CubicHermiteSpline(times, across, np.gradient(across, times))
    np.testing.assert_allclose(places(shown, *moments), curve(moments), atol=1e-6)


def test_a_turn_that_closes_goes_on_at_the_same_speed(tmp_path: Path) -> None:
    shown = scene(tmp_path, "  - {asset: box, animation: {keyframes: [{time: 0, yaw: 0}, {time: 4, yaw: 720}]}}\n")
    for moment in (0.0, 0.3, 1.9, 3.99, 4.0, 4.3):
        show_moment(shown, moment)
        assert shown.nodes.angles[0, 0] == pytest.approx(np.pi * (moment % 4))


def test_what_keyframes_leave_out_is_the_nodes_own(tmp_path: Path) -> None:
    own = "position: [1, 2, 3], pitch: 90, scale: 3"
    keys = "keyframes: [{time: 0}, {time: 1, scale: 12}], repeat: once"
    shown = scene(tmp_path, f"  - {{asset: box, {own}, animation: {{{keys}, interpolation: linear}}}}\n")
    show_moment(shown, 0.5)
    assert shown.objects.position[0].tolist() == [1, 2, 3]
    assert shown.nodes.angles[0].tolist() == pytest.approx([0, np.pi / 2, 0])
    assert shown.objects.scale[0] == pytest.approx(6)  # halfway between 3 and 12, as factors


@pytest.mark.parametrize("name", ["yaw", "pitch", "roll"])
def test_each_angle_is_interpolated_by_itself(tmp_path: Path, name: str) -> None:
    keys = f"keyframes: [{{time: 0, {name}: -90}}, {{time: 1, {name}: 270}}], interpolation: linear"
    shown = scene(tmp_path, f"  - {{asset: box, yaw: 5, pitch: 5, roll: 5, animation: {{{keys}}}}}\n")
    show_moment(shown, 0.75)
    expected = dict.fromkeys(("yaw", "pitch", "roll"), 5.0) | {name: 180.0}
    assert np.degrees(shown.nodes.angles[0]).tolist() == pytest.approx([*expected.values()])


def test_objects_below_a_node_move_with_it_and_others_stay(tmp_path: Path) -> None:
    shown = scene(
        tmp_path,
        "  - {asset: box, position: [9, 0, 0]}\n"
        f"  - group:\n      animation: {{{SLIDE}, interpolation: linear}}\n"
        "      objects:\n"
        "        - {asset: box, position: [0, 0, 1]}\n"
        f"        - {{asset: box, animation: {{{SLIDE}, interpolation: linear}}}}\n"
        "  - {grid: {asset: box, count: [2, 1], spacing: [1, 1]}}\n"
        f"  - {{grid: {{asset: box, count: [2, 1], spacing: [1, 1], animation: {{{SLIDE}}}}}}}\n",
    )
    before = shown.objects.position.copy()
    np.testing.assert_array_equal(show_moment(shown, 1), [1, 2, 5, 6])
    moved = shown.objects.position - before
    np.testing.assert_allclose(moved[:, 0], [0, 2, 4, 0, 0, 2, 2], atol=1e-6)
    assert not moved[:, 1:].any()


def test_a_scene_begins_at_its_first_moment(tmp_path: Path) -> None:
    keys = "keyframes: [{time: 0, position: [7, 0, 0]}, {time: 1}]"
    assert scene(tmp_path, f"  - {{asset: box, animation: {{{keys}}}}}\n").objects.position[0].tolist() == [7, 0, 0]


def test_a_scene_without_animations_stays(tmp_path: Path) -> None:
    still = scene(tmp_path, "  - {asset: box}\n")
    assert still.animations is None and not len(show_moment(still, 3.0))


KEY = st.fixed_dictionaries(
    {"position": st.lists(st.floats(-50, 50), min_size=3, max_size=3), "scale": st.floats(0.1, 10)},
    optional={"yaw": st.floats(-720, 720)},
)


@given(
    st.lists(st.tuples(st.floats(0.01, 3), KEY), min_size=2, max_size=6),
    st.sampled_from(["smooth", "linear", "step"]),
    st.sampled_from(["loop", "ping-pong", "once"]),
)
def test_curves_stay_within_their_extents(
    keys: list[tuple[float, dict[str, Any]]], interpolation: str, repeat: str
) -> None:
    times = np.cumsum([gap for gap, _ in keys])
    given_keys = [{"time": float(time), **key} for time, (_, key) in zip(times, keys, strict=True)]
    spec = AnimationParams.model_validate(
        {"keyframes": given_keys, "interpolation": interpolation, "repeat": repeat, "start": -1.0}
    )
    none = np.zeros(1, np.int32)
    nodes = Nodes(
        name=("",),
        parent=none - 1,
        depth=none,
        end=none + 1,
        first_object=none,
        object_count=none,
        angles=np.zeros((1, 3)),
        local=identities(1),
        world=identities(1),
    )
    animated = animations([(0, spec)], nodes)
    (reach,), (least,), (most,) = animated.extents()
    sampled = np.concatenate([animated.sample(moment) for moment in np.linspace(-1, 2 * times[-1], 60)])
    assert (np.linalg.norm(sampled[:, :3], axis=1) <= reach * (1 + 1e-9)).all()
    assert (np.exp(sampled[:, 6]) >= least * (1 - 1e-9)).all() and (np.exp(sampled[:, 6]) <= most * (1 + 1e-9)).all()


@pytest.mark.parametrize(
    ("objects", "message"),
    [
        (
            "  - {asset: box, animation: {keyframes: [{time: 0}]}}\n",
            "4:41: objects[0].animation.keyframes: must hold at least 2, not 1",
        ),
        (
            "  - {asset: box, animation: {keyframes: [{time: 1}, {time: 1}]}}\n",
            "4:60: objects[0].animation.keyframes[1].time: must be later than the keyframe before (1 s)",
        ),
        (
            "  - {grid: {asset: box, count: [1, 1], spacing: [1, 1], animation: {keyframes: [{time: 0}, {time: 1, "
            "scale: 2}]}}}\n",
            "objects[0].grid.animation.keyframes[1].scale: only objects and groups change their size; put this into a "
            "group",
        ),
        (
            "  - {asset: box, animation: {keyframes: [{time: 0}, {time: 1}], repeat: twice}}\n",
            "objects[0].animation.repeat: must be 'loop', 'ping-pong' or 'once', not 'twice'",
        ),
        (
            "  - {group: {scale: 10000, objects: [{group: {scale: 100, objects: [{asset: box, animation: {keyframes: "
            "[{time: 0}, {time: 1, scale: 2}]}}]}}]}}\n",
            "may have a scale that is not 1e-06 to 1e+06, as it moves with its groups",
        ),
        (
            "  - {group: {scale: 1000, objects: [{asset: box, animation: {keyframes: [{time: 0}, {time: 1, position: "
            "[50000, 0, 0]}]}}]}}\n",
            "may move farther than 1e+07 m from the origin, with its groups",
        ),
    ],
)
def test_what_a_file_may_not_ask_for(tmp_path: Path, objects: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        scene(tmp_path, objects)
    assert message in str(caught.value)
