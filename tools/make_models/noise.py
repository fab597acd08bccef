"""Smooth noise over space, seeded, for relief and colour."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

_SIDE = 32  # the lattice repeats after this many cells


def noise(p: NDArray[np.floating], cell: float, seed: int) -> NDArray[np.float32]:
    """Value noise at points (N, 3): (N,) float32, about −1 to 1, features of the size `cell`."""
    lattice = np.random.default_rng(seed).uniform(-1, 1, (_SIDE, _SIDE, _SIDE)).astype(np.float32)
    q = np.asarray(p, np.float64) / cell
    whole = np.floor(q)
    part = q - whole
    return map_coordinates(lattice, (whole + part * part * (3 - 2 * part)).T, order=1, mode="grid-wrap")


def fractal(p: NDArray[np.floating], cell: float, seed: int, octaves: int = 4) -> NDArray[np.float32]:
    """Return a sum of octaves of `noise`, each half as large and half as strong, about −1 to 1."""
    total = sum(0.5**k * noise(p, cell * 0.5**k, seed + k) for k in range(octaves))
    return np.asarray(total, np.float32) / np.float32(2 - 0.5 ** (octaves - 1))


def ridged(p: NDArray[np.floating], cell: float, seed: int, octaves: int = 4) -> NDArray[np.float32]:
    """Like `fractal` with sharp crests: 0 to 1, crests at 1."""
    total = sum(0.5**k * (1 - np.abs(noise(p, cell * 0.5**k, seed + k))) for k in range(octaves))
    return np.asarray(total, np.float32) / np.float32(2 - 0.5 ** (octaves - 1))
