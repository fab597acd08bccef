"""Read the channels of an OpenEXR file, once its header says that they are not too large."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError, missing_file


def read_channels(path: Path, check_size: Callable[[int, int, int], None]) -> dict[str, NDArray[Any]]:
    """Read all channels of the first part of an OpenEXR file.

    Parameters
    ----------
    path
        The file.
    check_size
        Called with width, height and the number of channels in the file before any pixel is read; raises InputError
        where that is too much.

    Returns
    -------
    dict
        (H, W) values by the name of the channel, as stored: half, float or unsigned integers; row 0 at the top.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    import OpenEXR

    if not path.is_file():
        raise missing_file(path)
    try:
        with OpenEXR.File(str(path), header_only=True) as file:
            low, high = (np.asarray(corner, int) for corner in file.parts[0].header["dataWindow"])
            planes = sum(len(part.header["channels"]) for part in file.parts)
        width, height = (high - low + 1).tolist()
        check_size(width, height, planes)
        with OpenEXR.File(str(path), separate_channels=True) as file:
            return {name: channel.pixels for name, channel in file.parts[0].channels.items()}
    except InputError:
        raise
    except Exception:  # the binding raises RuntimeError, ValueError and others for the same causes
        raise InputError(f"{path}: cannot be read as an OpenEXR image") from None
