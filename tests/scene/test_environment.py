"""Sky, ground, lights, camera and walk of a scene file."""

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from depthwalk.errors import InputError
from depthwalk.limits import MAX_LIGHTS
from depthwalk.scene.environment import (
    MAX_SHADOW_ANGLE,
    CameraParams,
    Environment,
    LampParams,
    SkyParams,
    SunParams,
    WalkParams,
)

LAMP: dict[str, Any] = {"position": [0, 3, 0]}


def test_an_empty_environment_has_a_sun_and_ambient_light_only() -> None:
    environment = Environment.model_validate({})
    assert environment.sky is None and environment.ground is None and environment.fog is None
    assert environment.sun.intensity > 0 and environment.ambient.intensity > 0 and environment.lights == []


def test_an_empty_group_switches_on() -> None:
    environment = Environment.model_validate({"sky": {}, "ground": {}, "fog": {}})
    assert environment.sky and environment.ground and environment.fog
    assert environment.ground.half_size == 10_000


@pytest.mark.parametrize("model", ["picture", 3, ["image"]])
def test_a_misspelt_model_is_the_only_mistake(model: Any) -> None:
    with pytest.raises(ValidationError) as caught:
        SkyParams.model_validate({"model": model, "image": "a.hdr"})
    assert [error["loc"] for error in caught.value.errors()] == [("model",)]


@pytest.mark.parametrize(
    ("sky", "defect"),
    [
        ({"model": "image"}, "'model: image' needs 'image', the file of the picture"),
        ({"image": "a.hdr"}, "'image' is only for 'model: image'"),
        ({"model": "preetham", "turn": 90.0}, "'turn' is only for 'model: image'"),
        ({"sun": True}, "'sun' is only for 'model: image'"),
        ({"model": "image", "image": "a.hdr", "horizon": "#ffffff"}, "'horizon' is not for 'model: image'"),
        ({"model": "image", "image": "a.hdr", "turbidity": 3.0}, "'turbidity' is not for 'model: image'"),
        ({"model": "image", "image": "a.hdr", "sun_size": 0.5}, "'sun_size' is not for 'model: image'"),
    ],
)
def test_a_picture_has_keys_of_its_own(sky: dict[str, Any], defect: str) -> None:
    with pytest.raises(ValidationError, match=defect):
        SkyParams.model_validate(sky)


def test_refused_changes_leave_a_sky() -> None:
    painted = SkyParams.model_validate({"zenith": "#102030"})
    with pytest.raises(InputError, match="model: 'model: image' needs 'image'"):
        painted.model = "image"
    with pytest.raises(InputError, match="turn: 'turn' is only for 'model: image'"):
        painted.turn = 45.0
    assert (painted.model, painted.turn) == ("gradient", 0)
    shown = SkyParams.model_validate({"model": "image", "image": "a.hdr"})
    shown.turn, shown.light = 45.0, True
    for key, value, defect in (
        ("horizon", (1.0, 1.0, 1.0), "horizon: 'horizon' is not for 'model: image'"),
        ("image", None, "image: 'model: image' needs 'image'"),
        ("turn", 1000.0, "turn: must be at most 360"),
    ):
        with pytest.raises(InputError, match=defect):
            setattr(shown, key, value)
    assert (shown.model, shown.image, shown.turn, shown.light) == ("image", Path("a.hdr"), 45, True)


def test_a_sky_becomes_a_picture_and_what_it_was() -> None:
    """Both models keep their values, as for somebody who compares them in the panel."""
    sky = SkyParams.model_validate({"zenith": "#102030"})
    zenith = sky.zenith
    sky.image = Path("a.hdr")
    sky.model = "image"
    sky.turn = 45.0
    assert {"image", "turn"} <= sky.used_keys and "zenith" not in sky.used_keys
    sky.sun = True
    assert sky.is_sun
    sky.model = "preetham"
    assert not sky.is_sun and sky.used_keys == {"model", "turbidity", "sun_size", "light"}
    sky.model = "gradient"
    assert not sky.is_sun and sky.used_keys == {"model", "zenith", "horizon", "sun_size", "light"}
    assert sky.zenith == zenith
    sky.model = "image"
    assert (sky.image, sky.turn) == (Path("a.hdr"), 45)


@pytest.mark.parametrize("direction", [[0, 0, 0], [1e-9, 0, 0]])
def test_a_light_needs_a_direction(direction: list[float]) -> None:
    with pytest.raises(ValidationError, match="zero vector"):
        SunParams.model_validate({"direction": direction})


@pytest.mark.parametrize(
    ("lamp", "defect"),
    [
        ({"shadow": True}, "'shadow' needs a cone: give a 'direction'"),
        ({"shadow": True, "direction": [0, -1, 0], "angle": MAX_SHADOW_ANGLE + 1}, "cone of at most 150 degrees"),
        ({"range": 0}, "greater than 0"),
    ],
)
def test_lamps_that_cannot_be(lamp: dict[str, Any], defect: str) -> None:
    with pytest.raises(ValidationError, match=defect):
        LampParams.model_validate(LAMP | lamp)


def test_a_spot_light_may_cast_shadows() -> None:
    lamp = LampParams.model_validate(LAMP | {"shadow": True, "direction": [0, -1, 0], "angle": MAX_SHADOW_ANGLE})
    assert lamp.shadow and lamp.direction == (0, -1, 0)


def test_lamps_are_limited() -> None:
    with pytest.raises(ValidationError, match=f"at most {MAX_LIGHTS}"):
        Environment.model_validate({"lights": [LAMP] * (MAX_LIGHTS + 1)})


def test_a_camera_looks_somewhere() -> None:
    assert CameraParams.model_validate({"position": [0, 0, 1], "target": [0, 0, 0]}).fov == 60
    with pytest.raises(ValidationError, match="elsewhere"):
        CameraParams.model_validate({"position": [1, 1, 1], "target": [1, 1, 1]})


def test_the_speed_may_be_left_to_the_scene() -> None:
    assert WalkParams.model_validate({}).speed is None
    with pytest.raises(ValidationError):
        WalkParams.model_validate({"speed": 0})
