"""Keep captured views in the user's cache folder, found by their key, as NumPy archives."""

from pathlib import Path
from typing import Any

import numpy as np

from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.cache import Cache, check_array, read_arrays, write_arrays

CAPTURES = Cache(suffix=".views.npz", content="captured views")

_ARRAYS = ("centre", "half_size", "colour", "surface")
_NUMBERS = ("radius", "specular", "shininess")


def find_views(params: CaptureParams, key: str) -> CapturedViews | None:
    """Find captured views in the cache, and remove a damaged file, with a warning.

    Parameters
    ----------
    params
        How they were captured.
    key
        The key under which `keep_views` kept them.

    Returns
    -------
    CapturedViews | None
        The views; None where the cache does not hold them.
    """
    return CAPTURES.find(key, lambda path: _read(path, params))


def keep_views(views: CapturedViews, key: str) -> Path:
    """Store captured views in the cache folder.

    Parameters
    ----------
    views
        The views.
    key
        Hash of all that they depend on.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OSError
        Where it cannot be written.
    """
    arrays = {name: np.asarray(getattr(views, name)) for name in (*_ARRAYS, *_NUMBERS)}
    return CAPTURES.keep(key, lambda path: write_arrays(path, arrays, compressed=True))


def _read(path: Path, params: CaptureParams) -> CapturedViews:
    """Read the views of a file. Raises OSError; ValueError or KeyError where they cannot be drawn."""
    stored = read_arrays(path)
    picture = params.views, params.resolution, params.resolution, 4
    shapes = {"centre": (3,), "half_size": (3,), "colour": picture, "surface": picture, **dict.fromkeys(_NUMBERS, ())}
    for name, shape in shapes.items():
        check_array(name, stored[name], shape, np.dtype(np.uint8) if len(shape) == 4 else "f")
    if stored["radius"] <= 0 or (stored["half_size"] < 0).any():
        raise ValueError("its bounds are empty")
    values: dict[str, Any] = {name: stored[name] for name in _ARRAYS}
    values |= {name: float(stored[name]) for name in _NUMBERS}
    return CapturedViews(**values)
