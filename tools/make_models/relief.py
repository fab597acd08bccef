"""Make relief too fine for a field of distances: what tools, weather and growth leave on a surface.

Heights (n,) are lengths along the normal at points `p` (n, 3), negative inward, in the unit of the points. Metres are
named below, but heads are sculpted in centimetres. A `seed` chooses the places of the marks. A mesh needs some vertices
across each mark.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from tools.make_models.model import Model, vertex_normals
from tools.make_models.noise import fractal, noise, ridged
from tools.make_models.paint import smoothstep

Height = NDArray[np.float32]


def displaced(model: Model, height: Height) -> Model:
    """Return `model` with each vertex moved outward along its normal by `height` (V,), in the unit of the model."""
    moved = model.positions + vertex_normals(model) * height[:, None]
    return replace(model, positions=moved.astype(np.float32), normals=None)


def chisel_marks(p: NDArray[np.floating], pitch: float, depth: float, seed: int) -> Height:
    """Return the furrows of a toothed chisel at points `p`: parallel within a patch, turned from patch to patch.

    `pitch` is the distance from furrow to furrow, `depth` that of the deepest below the surface, both metres. `seed`
    chooses the patches.
    """
    turn = 1.6 * noise(p, 12 * pitch, seed)
    across = np.cos(turn) * p[:, 0] + np.sin(turn) * p[:, 1] + 0.7 * p[:, 2]
    furrow = np.abs(np.sin(np.pi * across / pitch + 1.5 * noise(p, 3 * pitch, seed + 1)))
    struck = smoothstep(-0.3, 0.5, noise(p, 9 * pitch, seed + 2))
    return (depth * struck * (np.sqrt(furrow) - 1)).astype(np.float32)


def pores(p: NDArray[np.floating], size: float, depth: float, seed: int) -> Height:
    """Return pits at points `p`, of about `size` metres and up to `depth` metres deep, in swarms that `seed` places.

    Limestone and cast bronze have such pits.
    """
    swarm = smoothstep(-0.1, 0.6, noise(p, 14 * size, seed + 1))
    return (-depth * swarm * smoothstep(0.35, 0.75, noise(p, size, seed))).astype(np.float32)


def cracks(p: NDArray[np.floating], cell: float, depth: float, seed: int) -> Height:
    """Return thin bent clefts at points `p`, up to `depth` metres deep, one per `cell` metres or so, by `seed`."""
    bent = p + 0.3 * cell * np.stack([fractal(p, cell, seed + k, 2) for k in (3, 5, 7)], axis=1)
    return (-depth * smoothstep(0.955, 0.995, ridged(bent, cell, seed, 1))).astype(np.float32)


def grain(p: NDArray[np.floating], size: float, depth: float, seed: int, octaves: int = 3) -> Height:
    """Return even roughness at points `p` of ± `depth` metres, chosen by `seed`.

    Features have `size` metres in the first of `octaves`, and half as many in each other.
    """
    return (np.float32(depth) * fractal(p, size, seed, octaves)).astype(np.float32)


def weathered(model: Model, size: float, seed: int, depth: float = 0.07, chisel: float = 0.0) -> Model:
    """Return stone as rain leaves it: rough, pitted, cracked here and there, with what is left of the chisel.

    Parameters
    ----------
    model
        The stone, metres.
    size
        Size of the smallest pits, metres. What is smaller than two texels of depth images would only be noise in them.
    seed
        Seed of the places.
    depth, chisel
        Depths of the pits and of the chisel's furrows, as parts of `size`; 0 for no furrows.

    Returns
    -------
    Model
        The weathered stone.
    """
    p = model.positions
    height = grain(p, 3 * size, depth * size, seed, 2) + pores(p, size, depth * size, seed + 10)
    height += cracks(p, 30 * size, 1.5 * depth * size, seed + 20)
    if chisel:
        height += chisel_marks(p, 1.5 * size, chisel * size, seed + 30)
    return displaced(model, height)
