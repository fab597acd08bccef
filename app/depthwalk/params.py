"""Declare parameters, each once, with default, unit, range and help.

The scene file, the panel, `--set KEY=VALUE` and the docs all read these declarations.
"""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class Params(BaseModel):
    """Hold a group of parameters, which a subclass declares by `param`.

    Raises pydantic's ValidationError for unknown names, and whenever a value is set that a declaration does not allow.
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
        The value where nobody sets the parameter; `...` for a parameter that must be set.
    help
        One line that tells users what the parameter does.
    unit
        The unit of its value, as users read it; "" where it has none.
    ge, le
        Least and greatest value that is allowed; None for no such bound.

    Returns
    -------
    Any
        The field, for pydantic.
    """
    return Field(default, description=help, ge=ge, le=le, json_schema_extra={"unit": unit} if unit else None)
