"""Place the objects of a `grid` or a `scatter` item within their node."""

import math

import numpy as np
from numpy.typing import NDArray

from depthwalk.scene.similarity import Similarity, from_yaw, identities

_DENSEST = math.pi / math.sqrt(12)  # largest part of the plane that equal discs can cover
_IDLE_ROUNDS = 40  # rounds of darts without a hit after which the area counts as full


def grid_instances(count: tuple[int, int], spacing: tuple[float, float], scale: float) -> Similarity:
    """Return the transforms of objects in a rectangular grid, centred on the origin of their node.

    Parameters
    ----------
    count
        Objects along x and along z.
    spacing
        Metres between neighbours along x and along z.
    scale
        Size of every object relative to its asset.

    Returns
    -------
    Similarity
        count[0] · count[1] transforms, float32, metres, the position along x changing fastest.
    """
    instances = identities(count[0] * count[1], np.float32)
    x, z = ((np.arange(n) - (n - 1) / 2) * step for n, step in zip(count, spacing, strict=True))
    instances.position[:, 0] = np.tile(x, count[1])
    instances.position[:, 2] = np.repeat(z, count[0])
    instances.scale[:] = scale
    return instances


def scatter_instances(
    count: int, area: tuple[float, float], spacing: float, scale: tuple[float, float], seed: int
) -> Similarity:
    """Place objects at random in a rectangle centred on the origin of their node, with random yaw and scale.

    Parameters
    ----------
    count
        How many objects to place.
    area
        Sides of the rectangle along x and z, metres.
    spacing
        Smallest distance between two objects, metres.
    scale
        Lowest and highest size of an object relative to its asset.
    seed
        Seed of the random numbers; the same seed gives the same objects.

    Returns
    -------
    Similarity
        Transforms, float32, metres; fewer than `count` if there is no room for more.
    """
    random = np.random.default_rng(seed)
    places = _spaced_places(random, count, np.asarray(area), spacing)
    instances = identities(len(places), np.float32)
    instances.position[:, [0, 2]] = places
    instances.rotation[:] = from_yaw(random.uniform(0, 2 * math.pi, len(places)).astype(np.float32))
    instances.scale[:] = random.uniform(*scale, len(places))
    return instances


def room_for(area: tuple[float, float], spacing: float) -> float:
    """Return an upper bound on the number of points in a rectangle that keep a given distance from each other.

    It is the number of discs in their densest packing, which is hexagonal (Thue 1910).

    Parameters
    ----------
    area
        Sides of the rectangle along x and z, metres.
    spacing
        Smallest distance between two points, metres.

    Returns
    -------
    float
        The number; +inf if the spacing is 0.
    """
    if spacing == 0:
        return math.inf
    return _DENSEST * (area[0] + spacing) * (area[1] + spacing) / (math.pi / 4 * spacing**2)


def _spaced_places(
    random: "np.random.Generator", count: int, area: NDArray[np.float64], spacing: float
) -> NDArray[np.float64]:
    """Return up to `count` points (n, 2) float64 by dart throwing (Cook 1986), many darts a round."""
    if spacing == 0:
        return (random.random((count, 2)) - 0.5) * area
    places = np.empty((0, 2))
    crowd = int(min(math.prod(area / spacing), 2.0 * count)) + 64  # more darts would mostly hit each other
    idle = 0
    while len(places) < count and idle < _IDLE_ROUNDS:
        wanted = max(2 * (count - len(places)), len(places) // 4) + 64  # the last few cost a whole tree per round
        darts = (random.random((min(wanted, crowd), 2)) - 0.5) * area
        hits, _ = _close_pairs(darts, places, np.nextafter(spacing, 0))
        darts = np.delete(darts, np.unique(hits), axis=0)
        # Of two darts too close to each other the later one is dropped, even if the earlier one is dropped as well.
        one, other = _close_pairs(darts, darts, spacing)
        keep = np.ones(len(darts), bool)
        keep[one[other < one]] = False
        idle = 0 if keep.any() else idle + 1
        places = np.concatenate([places, darts[keep][: count - len(places)]])
    return places


def _close_pairs(
    points: NDArray[np.float64], others: NDArray[np.float64], reach: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return all pairs of a point and another at most `reach` apart.

    Searches only the nine square cells around each point. For a million points this takes 3 s, twice as long as
    SciPy's trees; but importing those would delay every start by a third of a second.

    Parameters
    ----------
    points, others : (n, 2) and (m, 2), metres; they may be the same.
    reach : metres, > 0.

    Returns
    -------
    Their indices (k,) into `points` and (k,) into `others`.
    """
    if not len(points) or not len(others):
        return np.zeros(0, np.intp), np.zeros(0, np.intp)
    low = np.minimum(points.min(0), others.min(0))
    size = np.maximum(points.max(0), others.max(0)) - low
    side = max(reach, math.sqrt(math.prod(size) / len(others)), size.max() / len(others))
    rows, columns = (np.ceil(size / side).astype(np.int64) + 3).tolist()  # with an empty cell all around
    cell, other_cell = (
        (places[:, 0] * columns + places[:, 1])
        for places in (((all_places - low) / side).astype(np.int64) + 1 for all_places in (points, others))
    )
    # Both are sorted by cell, so that neighbours are near each other in memory too.
    turn, order = np.argsort(cell), np.argsort(other_cell)
    points, others, cell = points[turn], others[order], cell[turn]
    first = np.concatenate([[0], np.cumsum(np.bincount(other_cell, minlength=rows * columns))])
    pairs = []
    for aside in (-columns, 0, columns):  # the three neighbours in a row of cells follow each other
        start = first[cell + aside - 1]
        count = first[cell + aside + 2] - start
        one = np.repeat(np.arange(len(points)), count)
        other = np.arange(len(one)) + np.repeat(start - np.cumsum(count) + count, count)
        apart = points[one] - others[other]
        near = np.flatnonzero(apart[:, 0] ** 2 + apart[:, 1] ** 2 <= reach**2)
        pairs.append((turn[one[near]], order[other[near]]))
    return np.concatenate([one for one, _ in pairs]), np.concatenate([other for _, other in pairs])
