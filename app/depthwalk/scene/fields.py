"""Define the value types that scene and path files share: numbers in sane ranges, vectors, counts, colours.

A union of several classes is decided by the key that only one of them has (`one_of_keys`).
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Discriminator, Field, Strict, WithJsonSchema

from depthwalk.errors import suggest
from depthwalk.limits import MAX_COORDINATE, MAX_DPCI_LAYERS, MAX_DPCI_PARTS, MAX_INSTANCES
from depthwalk.params import Params, shown

MIN_SCALE, MAX_SCALE = 1e-4, 1e4
COLOUR_TEXT = "^(#([0-9a-fA-F]{3}){1,2}|[a-zA-Z]+)$"
"""The pattern of colours as text in the JSON schema, by which they are told from other values; see `colour_of_text`."""
KIND = "\x1f"  # first character of a union branch's tag, which occurs only in pydantic's locations: no key may hold it


class FileParams(Params):
    """Hold keys of a file, typed more strictly than `Params`: text is not taken for a number, nor `true` for 1."""

    model_config = ConfigDict(strict=True, allow_inf_nan=False)


def numbers(*names: str) -> BeforeValidator:
    """Return a validator for lists with as many items as there are `names`; errors call the items by these.

    pydantic's own errors would speak of missing fields.
    """

    def check(value: Any) -> Any:
        if not isinstance(value, list | tuple) or len(value) != len(names):
            raise ValueError(f"must be [{', '.join(names)}]")
        return value

    return BeforeValidator(check)


def one_of_keys(*keys: str, first: str = "") -> Discriminator:
    """Return the discriminator that selects a union's branch by the one key that only this branch has.

    The tag of a branch is `KIND` followed by its key.

    Parameters
    ----------
    *keys
        The keys that decide.
    first
        The key that may be given together with others, and then takes precedence.
    """

    def present(value: Any) -> str | None:
        found = [key for key in keys if isinstance(value, dict) and key in value]
        return KIND + (first if first in found else found[0]) if len(found) == 1 or first in found else None

    message = f"needs exactly one of {', '.join(map(repr, keys))}"
    return Discriminator(present, custom_error_type="no_kind", custom_error_message=message)


def colour_of_text(text: str) -> tuple[float, float, float] | None:
    """Return the sRGB colour, 0 to 1, of `#rrggbb`, `#rgb` or a name of CSS such as `teal`; None for any other text."""
    if not re.fullmatch(COLOUR_TEXT, text):
        return None
    digits = text[1:]
    if text[0] != "#":
        from PIL import ImageColor  # here: few files name colours, and most are read without Pillow

        if text.lower() not in ImageColor.colormap:
            return None
        digits = bytes(ImageColor.getrgb(text)).hex()
    elif len(digits) == 3:
        digits = "".join(2 * digit for digit in digits)
    red, green, blue = (level / 255 for level in bytes.fromhex(digits))
    return red, green, blue


def _suggest_colour(text: str) -> str:
    """Return the end of an error message that suggests a colour's name for a misspelt one, as `suggest` does."""
    from PIL import ImageColor

    return suggest(text.lower(), ImageColor.colormap)


def _colour(value: Any) -> Any:
    if isinstance(value, str) and (colour := colour_of_text(value)):
        return colour
    if not isinstance(value, list | tuple) or len(value) != 3:
        meant = _suggest_colour(value) if isinstance(value, str) else ""
        raise ValueError(
            'must be "#rrggbb" or "#rgb" (in quotes), a name of CSS such as teal, or [r, g, b] from 0 to 1' + meant
        )
    return value


def _version(value: Any) -> Any:
    if isinstance(value, bool) or value != 1:  # True == 1 in Python
        raise ValueError(f"must be 1, not {shown(value)}")
    return value


def _scale_range(value: Any) -> Any:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return value, value
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise ValueError("must be a number or [low, high]")
    return value


def _ordered(value: Sequence[float]) -> Sequence[float]:
    if value[0] > value[1]:
        raise ValueError("must be [low, high] with low not above high")
    return value


def _auto_or_up_to(most: int) -> BeforeValidator:
    def check(value: Any) -> Any:
        if value != "auto" and not (type(value) is int and 1 <= value <= most):
            raise ValueError(f"must be auto or a whole number from 1 to {most}, not {shown(value)}")
        return value

    return BeforeValidator(check)


def _auto_or_up_to_schema(most: int) -> WithJsonSchema:
    return WithJsonSchema({"anyOf": [{"const": "auto"}, {"type": "integer", "minimum": 1, "maximum": most}]})


def _axis(value: Any) -> Any:
    if value not in ("auto", "x", "y", "z") and not (
        isinstance(value, list | tuple)
        and len(value) == 3
        and all(type(part) in (int, float) and abs(part) <= MAX_COORDINATE for part in value)
        and any(value)
    ):
        raise ValueError(f"must be auto, x, y, z or a direction [x, y, z], not {shown(value)}")
    return value


Coordinate = Annotated[float, Field(ge=-MAX_COORDINATE, le=MAX_COORDINATE)]
Length = Annotated[float, Field(gt=0, le=MAX_COORDINATE)]
FocalLength = Annotated[float, Field(ge=1, le=MAX_COORDINATE)]
Count = Annotated[int, Field(ge=1, le=MAX_INSTANCES)]
Scale = Annotated[float, Field(ge=MIN_SCALE, le=MAX_SCALE)]
_SCALE_SCHEMA = {"type": "number", "minimum": MIN_SCALE, "maximum": MAX_SCALE}
_Unit = Annotated[float, Field(ge=0, le=1)]

Version = Annotated[Literal[1], BeforeValidator(_version)]
Vector = Annotated[tuple[Coordinate, Coordinate, Coordinate], Strict(False), numbers("x", "y", "z")]
Extent = Annotated[tuple[Length, Length], Strict(False), numbers("x", "z")]
GridCount = Annotated[tuple[Count, Count], Strict(False), numbers("nx", "nz")]
ImageSize = Annotated[tuple[Length, Length], Strict(False), numbers("width", "height")]
ScaleRange = Annotated[
    tuple[Scale, Scale],
    Strict(False),
    BeforeValidator(_scale_range),
    AfterValidator(_ordered),
    WithJsonSchema({"anyOf": [_SCALE_SCHEMA, {"type": "array", "items": _SCALE_SCHEMA, "minItems": 2, "maxItems": 2}]}),
]
"""(low, high); a single number in the file stands for both."""
FilePath = Annotated[Path, Strict(False)]
Colour = Annotated[
    tuple[_Unit, _Unit, _Unit],
    Strict(False),
    BeforeValidator(_colour),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string", "pattern": COLOUR_TEXT},
                {
                    "type": "array",
                    "items": {"type": "number", "minimum": 0, "maximum": 1},
                    "minItems": 3,
                    "maxItems": 3,
                },
            ]
        }
    ),
]
"""sRGB red, green, blue in 0–1; `depthwalk.colour.linear_from_srgb` makes it linear."""
CountOrAuto = int | Literal["auto"]
Layers = Annotated[CountOrAuto, _auto_or_up_to(MAX_DPCI_LAYERS), _auto_or_up_to_schema(MAX_DPCI_LAYERS)]
Parts = Annotated[CountOrAuto, _auto_or_up_to(MAX_DPCI_PARTS), _auto_or_up_to_schema(MAX_DPCI_PARTS)]
AxisName = Literal["auto", "x", "y", "z"]
Axis = Annotated[AxisName | Vector, BeforeValidator(_axis)]
