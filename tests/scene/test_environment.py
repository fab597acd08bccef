"""Sky, ground, lights, camera and walk of a scene file."""

from typing import Any

import pytest
from pydantic import ValidationError

from depthwalk.limits import MAX_LIGHTS
from depthwalk.scene.environment import MAX_SHADOW_ANGLE, CameraParams, Environment, LampParams, SunParams, WalkParams

LAMP: dict[str, Any] = {"position": [0, 3, 0]}


def test_an_empty_environment_has_a_sun_and_ambient_light_only() -> None:
    environment = Environment.model_validate({})
    assert environment.sky is None and environment.ground is None and environment.fog is None
    assert environment.sun.intensity > 0 and environment.ambient.intensity > 0 and environment.lights == []


def test_an_empty_group_switches_on() -> None:
    environment = Environment.model_validate({"sky": {}, "ground": {}, "fog": {}})
    assert environment.sky and environment.ground and environment.fog
    assert environment.ground.half_size == 10_000


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
