"""Store roughness and metalness of a texel as one number, in the place of the strength of its highlight.

Smooth surfaces that are not metal are 0, rough ones almost 1/2; from beyond that to 1, metal is rough to smooth. So
what averaging makes of a dull and a glossy texel lies between them, and between metal and anything else lies something
rough, metal or not: these hardly differ if they have the same colour, whereas a smooth surface there would glint.
"""

import numpy as np

from depthwalk.types import Array

_ROUGH = 0.1  # part of all codes, in the middle, that no texel has before averaging


def reflection_codes(roughness: Array, metalness: Array) -> Array:
    """Return roughness and metalness (n,), 0 to 1 each, as codes (n,), 0 to 1. Metalness counts as 0 or 1."""
    smooth = _ROUGH + (1 - _ROUGH) * (1 - roughness)
    return np.asarray(0.5 + 0.5 * np.where(metalness >= 0.5, smooth, -smooth))


def reflections_of_codes(codes: Array) -> tuple[Array, Array]:
    """Return roughness and metalness (n,), 0 to 1 each, of codes (n,). Metalness is between only in the middle."""
    metal = 2 * codes - 1
    roughness = 1 - np.maximum(np.abs(metal) - _ROUGH, 0) / (1 - _ROUGH)
    return roughness, np.clip(0.5 + 0.5 * metal / _ROUGH, 0, 1)
