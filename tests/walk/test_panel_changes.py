"""What differs between a scene as its file gave it and as it is now."""

import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthwalk.params import Params
from depthwalk.scene.loader import load_scene
from depthwalk.scene.saved_values import save_values
from depthwalk.scene.scene import Scene
from depthwalk.walk.changes import FileValues
from depthwalk.walk.fields import controls_of

SCENE = """\
version: 1
environment: {sky: {}, sun: {colour: "#ffffff"}, fog: {density: 0.1}}
camera: {position: [0, 1, 5], target: [0, 1, 0], fov: 50}
render: {shadows: {distance: 0.3}}
"""


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    return load_scene(path)


def test_nothing_differs_at_first_and_after_a_value_has_returned(scene: Scene) -> None:
    values = FileValues(scene)
    assert values.changed() == values.changed(math.radians(50)) == {}
    scene.render.shadows.distance = 0.30000001192092896  # as a slider gives 0.3
    assert values.changed() == {}
    scene.render.shadows.enabled = True
    assert values.changed() == {"render": {"shadows": {"enabled": True}}}
    scene.render.shadows.enabled = False
    assert values.changed() == {}


def test_all_groups_are_told_as_in_a_scene_file(scene: Scene) -> None:
    values, environment = FileValues(scene), scene.environment
    assert environment.sky is not None and environment.fog is not None
    scene.render.aa = "fxaa"
    scene.render.output.exposure = 0.10000000149011612
    environment.background = (0.2, 0.4000000059604645, 0.6)
    environment.sun.direction = (0.5, -0.25, 1 / 3)
    environment.sun.colour = (0.25, 0.5, 0.75)
    environment.sky.horizon = (1.0, 0.0, 0.0)
    environment.fog.colour = (0.0, 0.0, 0.0)
    scene.walk.collide = False
    assert values.changed(math.radians(40)) == {
        "camera": {"fov": 40.0},
        "environment": {
            "background": "#336699",
            "sky": {"horizon": "#ff0000"},
            "sun": {"direction": [0.5, -0.25, 0.33333334], "colour": [0.25, 0.5, 0.75]},
            "fog": {"colour": "#000000"},
        },
        "walk": {"collide": False},
        "render": {"aa": "fxaa", "output": {"exposure": 0.1}},
    }
    assert list(values.changed(math.radians(40))) == ["camera", "environment", "walk", "render"]


def test_keys_that_a_sky_or_lens_has_no_use_for_are_left_out(scene: Scene) -> None:
    values, sky, lens = FileValues(scene), scene.environment.sky, scene.render.dof
    assert sky is not None
    sky.zenith = (1.0, 1.0, 1.0)
    sky.model = "preetham"
    assert values.changed() == {"environment": {"sky": {"model": "preetham"}}}
    sky.turbidity = 4
    assert values.changed()["environment"]["sky"] == {"model": "preetham", "turbidity": 4.0}
    lens.focus_distance = 9
    assert values.changed()["render"] == {"dof": {"focus_distance": 9.0}}
    lens.autofocus = True
    assert values.changed()["render"] == {"dof": {"focus_distance": 9.0, "autofocus": True}}
    lens.mode = "gather"
    assert values.changed()["render"] == {"dof": {"mode": "gather", "autofocus": True}}


def test_the_field_of_view_counts_only_where_the_file_has_a_camera(scene: Scene, tmp_path: Path) -> None:
    assert FileValues(scene).changed(1.0) == {"camera": {"fov": 57.29578}}
    (tmp_path / "bare.yaml").write_text("version: 1\n")
    assert FileValues(load_scene(tmp_path / "bare.yaml")).changed(1.0) == {}


def test_undoing_gives_exactly_the_values_of_the_file(scene: Scene) -> None:
    values, sky = FileValues(scene), scene.environment.sky
    before = scene.render.model_copy(deep=True), scene.environment.model_copy(deep=True)
    assert sky is not None
    scene.render.shadows.distance, scene.render.aa, sky.model = 40, "fxaa", "preetham"
    sky.turbidity, scene.environment.sun.direction = 4, (0, -1, 0)
    values.restore()
    assert (scene.render, scene.environment) == before and sky.turbidity == 2.5
    assert values.changed() == {} and scene.environment.sky is sky


def test_accepted_values_are_those_of_the_file_and_others_are_not(scene: Scene) -> None:
    values = FileValues(scene)
    scene.render.aa, scene.environment.sun.intensity = "fxaa", 2
    values.accept(values.changed(1.0), 1.0)
    assert values.changed(1.0) == {} and values.fov == 1.0
    scene.render.fused, scene.render.aa = False, "none"
    assert values.changed(1.0) == {"render": {"aa": "none", "fused": False}}
    values.restore()
    assert (scene.render.aa, scene.render.fused, scene.environment.sun.intensity) == ("fxaa", True, 2)


def controls(params: Params) -> list[Any]:
    return [control for control in controls_of(type(params)) if control.kind != "other" and control.name != "preset"]


@given(st.data())
def test_what_is_saved_is_read_back_as_what_was_shown(tmp_path: Path, data: st.DataObject) -> None:
    """Any values of any groups; afterwards the file, read again, differs in nothing that float32 tells."""
    path = tmp_path / "any.yaml"
    path.write_text(SCENE)
    scene = load_scene(path)
    values = FileValues(scene)
    groups = [scene.render, *(group for _, group in scene.render if isinstance(group, Params))]
    groups += [scene.environment.sun, scene.environment.ambient, scene.walk]
    for group in data.draw(st.lists(st.sampled_from(groups), max_size=6)):
        control = data.draw(st.sampled_from(controls(group)))
        setattr(group, control.name, data.draw(some_value(control)))
    changed = values.changed()
    if changed:
        save_values(path, changed)
    again = load_scene(path)
    assert FileValues(again).changed() == {}
    for name, part in (("render", scene.render), ("environment", scene.environment), ("walk", scene.walk)):
        assert_same(part, getattr(again, name))


def some_value(control: Any) -> st.SearchStrategy[Any]:
    low, high = control.low, control.high
    ranged = st.floats(-9 if low is None else low, 9 if high is None else high, width=64).map(
        lambda value: min(max(float(f"{value:.6g}"), low if low is not None else value), high or value)
    )
    parts = st.floats(0.0, 1.0, width=32)
    return {
        "switch": st.booleans(),
        "choice": st.sampled_from(control.choices or [None]),
        "integer": st.integers(int(low or 0), int(high or 9)),
        "number": ranged,
        "colour": st.one_of(st.tuples(parts, parts, parts), st.just((0.2, 0.4, 1.0))),
        "vector": st.tuples(parts, parts, st.just(0.5)),
    }[str(control.kind)]


def assert_same(one: Params, other: Params) -> None:
    for name, value in one:
        read = getattr(other, name)
        if isinstance(value, Params):
            assert_same(value, read)
        elif isinstance(value, float | tuple):
            assert read == pytest.approx(value, rel=1e-7, abs=1e-30), name
        else:
            assert read == value, name
