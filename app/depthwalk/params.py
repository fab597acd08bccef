"""Declare parameters with default, unit, range and help, each in one place.

The scene file, the panel, `--set KEY=VALUE` and the docs all read these declarations.
"""

from collections.abc import Callable, Sequence
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from depthwalk.errors import InputError, suggest

P = TypeVar("P", bound="Params")
T = TypeVar("T")

_PLAIN_WORDS = {
    "Input should be": "must be",
    "greater than or equal to": "at least",
    "less than or equal to": "at most",
    "a valid number": "a number",
    "a valid integer": "a whole number",
    "a valid boolean": "true or false",
    "a valid string": "text",
    "a valid list": "a list",
}


class Params(BaseModel):
    """Hold a group of parameters, which a subclass declares with `param`.

    Constructing one with unknown names or values that are not allowed raises pydantic's ValidationError, which knows
    the place of each mistake in a file.
    """

    model_config = ConfigDict(
        extra="forbid",
        validate_assignment=True,
        defer_build=True,  # until values are checked: most groups are only ever checked as part of a whole file
    )

    def __setattr__(self, name: str, value: Any) -> None:
        """Set a parameter. Raises InputError for an unknown name, and for a value that is not allowed."""
        try:
            super().__setattr__(name, value)
        except ValidationError as error:
            detail = error.errors(include_url=False)[0]
            if detail["type"] == "no_such_attribute":
                raise InputError(f"{name}: unknown key{suggest(name, type(self).model_fields)}") from None
            raise InputError(f"{name}: {plain_message(detail)}") from None


class Memo(Generic[P, T]):
    """Keep what a function computes from a list of groups until one of them changes, which they may do in place.

    Parameters
    ----------
    compute
        The function. Groups within the groups must not change.
    """

    def __init__(self, compute: Callable[[Sequence[P]], T]) -> None:
        self._compute = compute
        self._known: tuple[list[dict[str, Any]], T] | None = None

    def of(self, groups: Sequence[P]) -> T:
        """Return the result for `groups`, computed again only if their values are others than in the last call."""
        values = [group.__dict__ for group in groups]
        if self._known is None or self._known[0] != values:
            self._known = [dict(value) for value in values], self._compute(groups)
        return self._known[1]


def param(default: Any, help: str, *, unit: str = "", ge: float | None = None, le: float | None = None) -> Any:
    """Declare a field of a `Params` class.

    Parameters
    ----------
    default
        The value if the parameter is not set; `...` for a parameter that must be set.
    help
        One line that tells users what the parameter does.
    unit
        The unit of its value, as shown to users; "" if it has none.
    ge, le
        Smallest and largest allowed value; None for no bound.

    Returns
    -------
    Any
        The field, for pydantic.
    """
    return Field(default, description=help, ge=ge, le=le, json_schema_extra={"unit": unit} if unit else None)


def plain_message(detail: ErrorDetails) -> str:
    """Return what is wrong with a value, and what would be right, in the words of error messages.

    Parameters
    ----------
    detail
        A mistake that pydantic found in a value.

    Returns
    -------
    str
        The message, without the place of the mistake.
    """
    if detail["type"] in ("value_error", "assertion_error"):
        return detail["msg"].split(", ", 1)[1]
    message = detail["msg"].split(", unable")[0]
    for pydantics, plain in _PLAIN_WORDS.items():
        message = message.replace(pydantics, plain)
    return f"{message[0].lower()}{message[1:]}, not {shown(detail['input'])}"


def shown(value: object) -> str:
    """Return a value as error messages show it: as users write it in a file, shortened."""
    match value:
        case None:
            return "null"
        case bool():
            return str(value).lower()
        case dict():
            return "a mapping"
        case list():
            return "a list"
        case float():
            return f"{value:.6g}"
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + "..."
