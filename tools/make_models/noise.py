"""Make smooth noise over space, for relief and colour; the same seed gives the same noise.

Points are in any unit; the size of features, `cell`, is in the same unit.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

_SIDE = 32  # the lattice repeats after this many cells


def noise(p: NDArray[np.floating], cell: float, seed: int) -> NDArray[np.float32]:
    """Return value noise at points `p` (n, 3) with features of the size `cell`, chosen by `seed`: (n,), −1 to 1."""
    lattice = np.random.default_rng(seed).uniform(-1, 1, (_SIDE, _SIDE, _SIDE)).astype(np.float32)
    q = np.asarray(p, np.float64) / cell
    whole = np.floor(q)
    part = q - whole
    return map_coordinates(lattice, (whole + part * part * (3 - 2 * part)).T, order=1, mode="grid-wrap")


def fractal(p: NDArray[np.floating], cell: float, seed: int, octaves: int = 4) -> NDArray[np.float32]:
    """Return a sum of `octaves` of `noise` at points `p` (n, 3), chosen by `seed`: (n,), −1 to 1.

    Features of the first have the size `cell`; each other octave is half as large and half as strong as the one before.
    """
    total = sum(0.5**k * noise(p, cell * 0.5**k, seed + k) for k in range(octaves))
    return np.asarray(total, np.float32) / np.float32(2 - 0.5 ** (octaves - 1))


def ridged(p: NDArray[np.floating], cell: float, seed: int, octaves: int = 4) -> NDArray[np.float32]:
    """Return noise with sharp crests at points `p` (n, 3): (n,), 0 to 1, with the crests at 1.

    `cell`, `seed` and `octaves` are those of `fractal`.
    """
    total = sum(0.5**k * (1 - np.abs(noise(p, cell * 0.5**k, seed + k))) for k in range(octaves))
    return np.asarray(total, np.float32) / np.float32(2 - 0.5 ** (octaves - 1))
