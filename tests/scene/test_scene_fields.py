"""Types of values that the files share."""

from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from depthwalk.scene.fields import Colour, FileParams, ScaleRange, Vector, Version


@pytest.mark.parametrize(
    ("kind", "written", "read"),
    [
        (Colour, "#ff0080", (1.0, 0.0, 128 / 255)),
        (Colour, "#F08", (1.0, 0.0, 136 / 255)),
        (Colour, "Teal", (0.0, 128 / 255, 128 / 255)),
        (Colour, "rebeccapurple", (102 / 255, 51 / 255, 153 / 255)),
        (Colour, [0, 0.5, 1], (0, 0.5, 1)),
        (ScaleRange, 2, (2, 2)),
        (ScaleRange, [1, 3], (1, 3)),
        (Vector, [1, 2, 3], (1, 2, 3)),
    ],
)
def test_what_is_read(kind: Any, written: Any, read: tuple[float, ...]) -> None:
    assert TypeAdapter(kind).validate_python(written) == read


@pytest.mark.parametrize(
    ("kind", "written", "message"),
    [
        (Colour, "ff0080", 'must be "#rrggbb"'),
        (Colour, "#ff008", 'must be "#rrggbb"'),
        (Colour, "#ff0080ff", 'must be "#rrggbb"'),  # which would be translucent in CSS
        (Colour, "rgb(1, 2, 3)", 'must be "#rrggbb"'),
        (Colour, "#fff\n", 'must be "#rrggbb"'),
        (Colour, "Cyon", "must be \"#rrggbb\" .* a name of CSS such as teal, .*; did you mean 'cyan'?"),
        (Colour, [0, 1], 'must be "#rrggbb"'),
        (Colour, [0, 0, 2], "less than or equal to 1"),
        (ScaleRange, [3, 1], "low not above high"),
        (ScaleRange, True, "must be a number or"),
        (Vector, [1, 2], r"must be \[x, y, z\]"),
        (Vector, "abc", r"must be \[x, y, z\]"),
        (Vector, [0, 0, 1e7], "less than or equal to 1000000"),
        (Version, True, "must be 1, not true"),
    ],
)
def test_what_is_refused(kind: Any, written: Any, message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        TypeAdapter(kind).validate_python(written)


def test_files_have_neither_text_for_numbers_nor_nan() -> None:
    class Group(FileParams):
        number: float = 0.0

    for written in ("1", True, float("nan")):
        with pytest.raises(ValidationError):
            Group.model_validate({"number": written})
    assert Group.model_validate({"number": 1}).number == 1
