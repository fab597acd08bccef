"""Write plain values as YAML text, in the notation of scene files."""

import json
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

_LONGEST = 100  # characters of a mapping that is written in one line
_PLAIN = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_RESERVED = {"null", "true", "false"}  # what a word without quotes means something else by


def float32_value(value: float) -> float:
    """Return the number with the fewest digits that is the same as `value` in float32.

    A slider that shows 0.3 gives 0.30000001192092896, which is how float32 holds 0.3.

    Parameters
    ----------
    value
        A finite number.

    Returns
    -------
    float
        The number, 0 for both zeros.
    """
    return float(np.format_float_positional(np.float32(value), unique=True)) + 0.0


def flow_text(value: Any) -> str:
    """Return a value in one line: lists in brackets, mappings in braces.

    Parameters
    ----------
    value
        None, bool, int, finite float, str, or nested lists and mappings of these.

    Returns
    -------
    str
        YAML text, which may stand anywhere, also in another flow collection.
    """
    match value:
        case None:
            return "null"
        case bool():
            return str(value).lower()
        case int():
            return str(value)
        case float():
            return np.format_float_positional(value, unique=True, trim="-")
        case str():
            return value if _PLAIN.fullmatch(value) and value.lower() not in _RESERVED else double_quoted(value)
        case Mapping():
            return f"{{{', '.join(f'{flow_text(key)}: {flow_text(child)}' for key, child in value.items())}}}"
    return f"[{', '.join(map(flow_text, value))}]"


def double_quoted(text: str) -> str:
    """Return `text` in double quotes, whose escapes JSON and YAML share."""
    return json.dumps(text, ensure_ascii=False)


def block_lines(values: Mapping[str, Any], indent: str = "", step: int = 2) -> list[str]:
    """Return a mapping as lines of YAML text.

    A mapping within it is written in one line if it holds no mapping itself and is short.

    Parameters
    ----------
    values
        The mapping, of values as `flow_text` takes them.
    indent
        The spaces before each key.
    step
        How many more spaces are before the keys of a mapping within it.

    Returns
    -------
    list[str]
        The lines, without line breaks.
    """
    lines = []
    for key, value in values.items():
        line = f"{indent}{flow_text(key)}: {flow_text(value)}"
        if _is_flat(value) and len(line) <= _LONGEST:
            lines.append(line)
        else:
            lines += [f"{indent}{flow_text(key)}:", *block_lines(value, indent + " " * step, step)]
    return lines


def _is_flat(value: Any) -> bool:
    """Return whether a value may stand in one line: a mapping within another would not be easy to read."""
    return not isinstance(value, Mapping) or not any(isinstance(child, Mapping) for child in value.values())
