"""Store captured views in the user's cache folder as NumPy archives, found by their key."""

from typing import Any

import numpy as np

from depthwalk.array_file import Arrays, check_array
from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.bake.images import checked_reflection
from depthwalk.cache import ArrayCache

_ARRAYS = ("centre", "half_size", "colour", "surface")
_NUMBERS = ("radius", "specular", "shininess")
_REFLECTION = "reflection"  # optional: roughness and metalness


def _arrays(views: CapturedViews) -> Arrays:
    """Return the arrays that a file holds of views."""
    named = (*_ARRAYS, *_NUMBERS, *(() if views.reflection is None else (_REFLECTION,)))
    return {name: np.asarray(getattr(views, name)) for name in named}


def _parse(stored: Arrays, params: CaptureParams) -> CapturedViews:
    """Return the views in a file, captured with `params`. Raises ValueError or KeyError if the file holds none."""
    picture = params.views, params.resolution, params.resolution, 4
    shapes = {"centre": (3,), "half_size": (3,), "colour": picture, "surface": picture, **dict.fromkeys(_NUMBERS, ())}
    for name, shape in shapes.items():
        check_array(name, stored[name], shape, np.dtype(np.uint8) if len(shape) == 4 else "f")
    if stored["radius"] <= 0 or (stored["half_size"] < 0).any():
        raise ValueError("its bounds are empty")
    values: dict[str, Any] = {name: stored[name] for name in _ARRAYS}
    values |= {name: float(stored[name]) for name in _NUMBERS}
    reflection = None
    if _REFLECTION in stored:
        check_array(_REFLECTION, stored[_REFLECTION], (2,), "f")
        reflection = checked_reflection(*stored[_REFLECTION].tolist())
    return CapturedViews(**values, reflection=reflection)


CAPTURES = ArrayCache(suffix=".views.npz", content="captured views", arrays=_arrays, parse=_parse, compressed=True)
"""Captured views, by their capture parameters."""
