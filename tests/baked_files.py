"""Change baked files and tell what reading them says, for tests of several modules."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from depthwalk.bake.file import read_baked
from depthwalk.errors import InputError

Channels = dict[str, NDArray[Any]]
Parts = list[tuple[str, dict[str, Any], Channels]]
_OWN = ("channels", "chunkCount", "name")  # attributes that the library writes itself


def rewrite(path: Path, change: Callable[[Parts], Parts]) -> None:
    """Writes the parts of a file again; `change` gets the list of (name, header, channels) and returns it."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        parts = [
            (
                part.name(),
                {key: value for key, value in part.header.items() if key not in _OWN},
                {key: channel.pixels.copy() for key, channel in part.channels.items()},
            )
            for part in file.parts
        ]
    OpenEXR.File([OpenEXR.Part(header, channels, name) for name, header, channels in change(parts)]).write(str(path))


def refused(path: Path, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read_baked(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)


def identical(one: Any, other: Any) -> bool:
    """Whether two baked objects, or what they are made of, are the same to the bit."""
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(identical, one, other))
    if hasattr(one, "__dataclass_fields__"):
        return all(identical(getattr(one, name), getattr(other, name)) for name in one.__dataclass_fields__)
    return one == other
