"""Store the colours of a virtual texture in few bytes by principal component analysis.

The first principal component of an object's colours is mostly their brightness. It is stored in every texel; the rest
is stored in two numbers (tints) per 2 × 2 texels. Where that would show, texels have two components each and share
the third; where that would show as well, colours are stored unchanged.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_SMALL = 1 << 18  # texels up to which saving bytes is not worth a lookup
_OWN = 1, 2  # numbers of components per texel to try; the first that shows no difference is used
_RMS_ERROR, _MAX_ERROR = 0.6, 24.0  # of 255: allowed errors from sharing tints between 2 × 2 texels


class ColourComponents(NamedTuple):
    """Hold colours as components of a palette.

    The colour of a texel is palette[0] + Σ c[i] · palette[i + 1], where c is its components followed by its tints. If k
    is 0, it is palette[0] alone; if k is 4, the components are the colour itself. Filtering components gives the same
    result as filtering colours.

    Attributes
    ----------
    components
        (H, W, k) where k is 0, 1 or 2 (int8, 127 for 1.0), or 4 (uint8, 255 for 1.0).
    tints
        (H / 2, W / 2, 3 − k) uint8, 255 for 1.0, where k is 1 or 2; else empty.
    palette
        (4, 4) float32, rows of √linear RGB and specular strength.
    """

    components: NDArray[np.int8] | NDArray[np.uint8]
    tints: NDArray[np.uint8]
    palette: NDArray[np.float32]


def few_components(colours: NDArray[np.uint16], used: NDArray[np.bool_]) -> ColourComponents:
    """Store colours in as few components as possible without visible difference.

    Parameters
    ----------
    colours
        (H, W, 4) uint16, 65535 for 1.0: √linear RGB and specular strength; H and W are even.
    used
        (H, W) bool, True for texels whose colours matter.

    Returns
    -------
    ColourComponents
        The components of all texels.
    """
    palette, no_tints = np.zeros((4, 4), np.float32), np.zeros((0, 0, 2), np.uint8)
    rounded = np.round(colours / np.float32(257)).astype(np.uint8)
    if not np.ptp(rounded[used], 0).any():
        palette[0] = rounded[used][0] / 255
        return ColourComponents(rounded[..., :0], no_tints, palette)
    if used.size < _SMALL:
        return ColourComponents(rounded, no_tints, palette)
    shown = colours[used] / np.float32(65535)
    mean = shown.mean(0, dtype=np.float64).astype(np.float32)
    axes = np.linalg.eigh(np.cov(shown, rowvar=False))[1].T[:0:-1].astype(np.float32)  # three, the principal one first
    along = np.zeros((*used.shape, 3), np.float32)
    along[used] = (shown - mean) @ axes.T
    fourth = np.square(shown - mean - along[used] @ axes).sum(1)  # the part along the fourth axis
    for own in _OWN:
        shared = along[..., own:]
        tints = shared.reshape(used.shape[0] // 2, 2, used.shape[1] // 2, 2, 3 - own).mean((1, 3))
        off = np.square(shared - tints.repeat(2, 0).repeat(2, 1))[used].sum(1) + fourth
        if off.mean() <= (_RMS_ERROR / 255) ** 2 and off.max() <= (_MAX_ERROR / 255) ** 2:
            return _components(along, own, tints, used, mean, axes)
    return ColourComponents(rounded, no_tints, palette)


def _components(
    along: NDArray[np.float32],
    own: int,
    tints: NDArray[np.float32],
    used: NDArray[np.bool_],
    mean: NDArray[np.float32],
    axes: NDArray[np.float32],
) -> ColourComponents:
    """Return components of 8 bits.

    along: (H, W, 3), coordinates along the axes; own: how many of them every texel stores; tints: (H / 2, W / 2,
    3 − own), coordinates along the others; used: (H, W) bool; mean (4,) and axes (3, 4), of the colours.
    """
    low, size, palette = along[used].min(0), np.ptp(along[used], 0).clip(1e-6), np.zeros((4, 4), np.float32)
    parts, rest = (along[..., :own] - low[:own]) / size[:own], (tints - low[own:]) / size[own:]
    # Signed, because llvmpipe blends unsigned ones in 8 bits, which costs FLIP .001.
    components = np.round((2 * parts - 1) * 127).clip(-127, 127).astype(np.int8)
    size[:own] /= 2
    low[:own] += size[:own]
    palette[0] = mean + low @ axes
    palette[1:] = size[:, None] * axes
    return ColourComponents(components, np.round(rest * 255).clip(0, 255).astype(np.uint8), palette)
