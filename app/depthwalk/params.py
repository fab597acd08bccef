"""Declare parameters with default, unit, range and help, each in one place.

The scene file, the panel, `--set KEY=VALUE` and the docs all read these declarations.
"""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class Params(BaseModel):
    """Hold a group of parameters, which a subclass declares with `param`.

    Raises pydantic's ValidationError for unknown names, and when a parameter is set to a value that is not allowed.
    """

    model_config = ConfigDict(
        extra="forbid",
        validate_assignment=True,
        defer_build=True,  # until values are checked: most groups are only ever checked as part of a whole file
    )


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
