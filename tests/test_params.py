"""Declared parameters: what is unknown or out of range is refused, whenever it is set."""

import pytest
from pydantic import ValidationError

from depthwalk.errors import InputError
from depthwalk.params import Params, param


class Lamp(Params):
    watts: float = param(40.0, "Power", unit="W", ge=0, le=100)


def test_defaults_ranges_and_unknown_names() -> None:
    assert Lamp().watts == 40
    for wrong in ({"watts": 101}, {"watts": -1}, {"wats": 3}):
        with pytest.raises(ValidationError):
            Lamp.model_validate(wrong)


def test_assignments_are_checked() -> None:
    lamp = Lamp()
    lamp.watts = 100
    for name, value, message in (
        ("watts", 100.5, "watts: must be at most 100, not 100.5"),
        ("watts", "bright", "watts: must be a number, not 'bright'"),
        ("wats", 3, "wats: unknown key; did you mean 'watts'?"),
    ):
        with pytest.raises(InputError) as raised:
            setattr(lamp, name, value)
        assert str(raised.value) == message
    assert lamp.watts == 100


def test_the_schema_holds_help_unit_and_range() -> None:
    declared = Lamp.model_json_schema()["properties"]["watts"]
    assert declared["description"] == "Power" and declared["unit"] == "W"
    assert (declared["minimum"], declared["maximum"], declared["default"]) == (0, 100, 40)
