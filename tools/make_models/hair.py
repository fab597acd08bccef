"""Make relief for hair: heights of wavy strands and curls, by which a smooth mass is displaced."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from tools.make_models.noise import fractal, noise
from tools.make_models.sdf import Points

Height = NDArray[np.float32]


def strands(across: Height, along: Height, p: Points, locks: float, wave: float, seed: int) -> Height:
    """Return the height of wavy locks, each made of finer strands.

    Parameters
    ----------
    across
        (n,) angle or distance across the strands, in any unit.
    along
        (n,) distance along the strands, centimetres.
    p
        (n, 3) points, centimetres, by which noise varies the locks.
    locks
        Number of locks per unit of `across`.
    wave
        How far the strands swing, in widths of a lock.
    seed
        Seed of the noise.

    Returns
    -------
    Height
        (n,) 0 to 1.
    """
    swing = wave * np.sin(1.35 * along + 1.2 * noise(p, 6.0, seed)) + 0.5 * noise(p, 3.5, seed + 1)
    u = across * locks + swing
    lock = 1 - np.abs(2 * (u - np.floor(u)) - 1) ** 2.2
    fine = 0.5 + 0.5 * np.cos(2 * np.pi * (4 * u + 0.3 * np.sin(2.1 * along)))
    return (0.7 * lock + 0.3 * fine * (0.35 + 0.65 * lock)).astype(np.float32)


def curls(p: Points, centres: NDArray[np.float64], radius: float, hands: NDArray[np.float64]) -> Height:
    """Return the height of snail curls.

    Parameters
    ----------
    p
        (n, 3) points, centimetres.
    centres
        (m, 3) centres of the curls, centimetres, head frame.
    radius
        Radius of a curl, centimetres.
    hands
        (m,) 1 or −1: whether a curl winds left or right.

    Returns
    -------
    Height
        (n,) about 0 to 1; 0 between the curls.
    """
    distance, nearest = cKDTree(centres).query(p, k=2, workers=1)
    own = distance[:, 0]
    edge = np.clip((distance[:, 1] - own) / (0.7 * radius), 0, 1)
    offset = p - centres[nearest[:, 0]]
    out = centres[nearest[:, 0]] - np.array([0, 11.0, -0.5])
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    right = np.cross([0.0, 1.0, 0.02], out)
    right /= np.maximum(np.linalg.norm(right, axis=1, keepdims=True), 1e-6)
    up = np.cross(out, right)
    angle = np.arctan2(np.einsum("ij,ij->i", offset, up), np.einsum("ij,ij->i", offset, right))
    phase = hands[nearest[:, 0]] * angle + 5.4 * own / radius + nearest[:, 0]
    spiral = 0.5 + 0.5 * np.cos(phase)
    dome = np.sqrt(np.clip(1 - (own / (1.35 * radius)) ** 2, 0, 1))
    fine = 0.5 + 0.5 * np.cos(3 * phase)
    height = dome * (0.55 + 0.35 * spiral + 0.1 * fine) * (0.25 + 0.75 * np.sqrt(edge))
    return (height + 0.05 * fractal(p, 1.2, 7, 2)).astype(np.float32)


def spread(candidates: NDArray[np.floating], spacing: float, seed: int) -> NDArray[np.float64]:
    """Return those of `candidates` (n, 3), chosen at random by `seed`, no two of which are nearer than `spacing`."""
    rng = np.random.default_rng(seed)
    points = np.asarray(candidates, np.float64)[rng.permutation(len(candidates))]
    tree = cKDTree(points)
    free = np.ones(len(points), bool)
    for k in range(len(points)):  # greedy: each kept point removes its later neighbours
        if free[k]:
            near = np.array(tree.query_ball_point(points[k], spacing))
            free[near[near > k]] = False
    return points[free]
