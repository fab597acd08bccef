"""Declared parameters: what is unknown or out of range is refused, whenever it is set."""

from collections.abc import Sequence

import pytest
from pydantic import ValidationError

from depthwalk.errors import InputError
from depthwalk.params import Memo, Params, param


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


def test_a_memo_computes_again_only_what_has_changed_even_in_place() -> None:
    calls: list[float] = []

    def total(lamps: Sequence[Lamp]) -> float:
        calls.append(sum(lamp.watts for lamp in lamps))
        return calls[-1]

    memo, lamps = Memo(total), [Lamp(watts=10), Lamp(watts=20)]
    assert [memo.of(lamps), memo.of(list(lamps)), memo.of([Lamp(watts=10), Lamp(watts=20)])] == [30, 30, 30]
    lamps[1].watts = 25
    assert memo.of(lamps) == 35
    lamps.append(Lamp(watts=1))
    assert [memo.of(lamps), memo.of([])] == [36, 0]
    assert calls == [30, 35, 36, 0]
