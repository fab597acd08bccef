"""Pack surfaces into the words of the G-buffer, and unpack them, as shaders/common/gbuffer.glsl does.

Normals are unit vectors unfolded onto the octahedron: Meyer et al. 2010, "On Floating-Point Normal Vectors".
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.view_directions import direction_from_square, square_from_direction
from depthwalk.limits import MAX_SHININESS
from depthwalk.reference.light import Surfaces
from depthwalk.reference.reflection import Microfacets
from depthwalk.render.target_table import NORMAL_BITS
from depthwalk.types import Array, Mask

_NORMAL_MASK = (1 << NORMAL_BITS) - 1
_NORMAL_STEPS = _NORMAL_MASK - 1  # even, so that floors and walls have exact normals
_SHININESS_STEPS = 254.0
_SHININESS_SHIFT = 2 * NORMAL_BITS
_ROUGHNESS_STEPS, _METALNESS_STEPS = 49, 4  # of reflecting surfaces
_POLE_UP = [0, 2, 1]  # swaps y and z: the pole of the G-buffer is +z, that of `view_directions` +y


def packed_surfaces(surfaces: Surfaces) -> NDArray[np.uint32]:
    """Pack surfaces into words of the G-buffer, (n, 2) uint32."""
    colour = np.concatenate([np.sqrt(surfaces.albedo), surfaces.specular[:, None]], 1)
    place = square_from_direction(surfaces.normal[:, _POLE_UP], hemisphere=False) * 0.5 + 0.5
    sharp = 1 + _rounded(_SHININESS_STEPS * np.log2(np.maximum(surfaces.shininess, 1)) / np.log2(MAX_SHININESS))
    first = (_rounded(np.clip(colour, 0, 1) * 255) << np.arange(0, 32, 8, dtype=np.uint32)).sum(1, dtype=np.uint32)
    column, row = _rounded(place * _NORMAL_STEPS).T
    return np.stack([first, column | row << NORMAL_BITS | sharp << _SHININESS_SHIFT], 1)


def unlit_surfaces(words: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return words of the G-buffer, (n, 2) uint32, of the same surfaces shown without light."""
    kept, added = np.array([[0xFFFFFF, (1 << _SHININESS_SHIFT) - 1], [0xFF << 24, 0]], np.uint32)
    return np.asarray(words & kept | added)


def is_unlit(words: NDArray[np.uint32]) -> Mask:
    """Return which words of the G-buffer, (n, 2) uint32, are of surfaces that are shown without light, (n,)."""
    return np.asarray((words[:, 0] >> 24 == 0xFF) & (words[:, 1] >> _SHININESS_SHIFT == 0))


def reflecting_surfaces(words: NDArray[np.uint32], roughness: Array, metalness: Array) -> NDArray[np.uint32]:
    """Return words of the G-buffer, (n, 2) uint32, of the same surfaces that reflect the sky; (n,) 0 to 1 each."""
    code = 1 + _rounded(_METALNESS_STEPS * metalness) * (_ROUGHNESS_STEPS + 1) + _rounded(_ROUGHNESS_STEPS * roughness)
    kept = words & np.array([0xFFFFFF, (1 << _SHININESS_SHIFT) - 1], np.uint32)
    kept[:, 0] |= code.astype(np.uint32) << 24
    return kept


def is_reflecting(words: NDArray[np.uint32]) -> Mask:
    """Return which words of the G-buffer, (n, 2) uint32, are of surfaces that reflect the sky, (n,)."""
    return np.asarray((words[:, 1] >> _SHININESS_SHIFT == 0) & ~np.isin(words[:, 0] >> 24, (0, 0xFF)))


def microfacets(words: NDArray[np.uint32]) -> Microfacets:
    """Unpack words of the G-buffer, (n, 2) uint32, of surfaces that reflect the sky."""
    surfaces, code = unpacked_surfaces(words), (words[:, 0] >> 24).astype(int) - 1
    metalness, roughness = np.divmod(code, _ROUGHNESS_STEPS + 1)
    return Microfacets(
        base=surfaces.albedo,
        metalness=metalness / _METALNESS_STEPS,
        roughness=roughness / _ROUGHNESS_STEPS,
        normal=surfaces.normal,
    )


def unpacked_surfaces(words: NDArray[np.uint32]) -> Surfaces:
    """Unpack words of the G-buffer, (n, 2) uint32, of surfaces that are not lit already."""
    first, second = words.T
    colour = (first[:, None] >> np.arange(0, 32, 8, dtype=np.uint32) & 255) / 255
    place = np.stack([second & _NORMAL_MASK, second >> NORMAL_BITS & _NORMAL_MASK], 1) / _NORMAL_STEPS
    sharp = (second >> _SHININESS_SHIFT).astype(np.float64) - 1
    return Surfaces(
        albedo=colour[:, :3] ** 2,
        specular=colour[:, 3],
        normal=direction_from_square(place * 2 - 1, hemisphere=False)[:, _POLE_UP],
        shininess=np.exp2(sharp * np.log2(MAX_SHININESS) / _SHININESS_STEPS),
    )


def _rounded(values: Array) -> NDArray[np.uint32]:
    return (values + 0.5).astype(np.uint32)
