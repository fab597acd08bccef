"""Declaration of a parameter: once, with default, unit, range and help.

The scene file, the panel, `--set KEY=VALUE` and the docs all read these declarations.
"""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class Params(BaseModel):
    """A group of parameters. Unknown names are errors; assignments are validated."""

    model_config = ConfigDict(extra="forbid", validate_assignment=True)


def param(default: Any, help: str, *, unit: str = "", ge: float | None = None, le: float | None = None) -> Any:
    """A field of a `Params` class: its default, one line of help, its unit and its closed range."""
    return Field(default, description=help, ge=ge, le=le, json_schema_extra={"unit": unit} if unit else None)
