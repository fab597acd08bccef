"""Make leaves and twigs by the ten thousand, each a closed solid of some dozens of triangles."""

import numpy as np
from numpy.typing import NDArray
from tools.make_models.model import Model

from depthwalk.types import Array

OAK = (0.30, 0.62, 0.45, 0.95, 0.72, 1.0, 0.62)  # half widths from stalk to tip: lobes and the bays between them
BOX = (0.62, 1.0, 0.98, 0.66)
IVY = (0.95, 0.80, 1.0, 0.45, 0.25)


def _leaf_faces(stations: int) -> NDArray[np.int32]:
    """Faces of one leaf: base, tip, then a ring of (left, right, upper rib, lower rib) per station."""
    ring = 2 + 4 * np.arange(stations)
    left, right, above, below = (ring + k for k in range(4))
    faces = []
    for rib, sides in ((above, ((left, False), (right, True))), (below, ((left, True), (right, False)))):
        for side, flip in sides:
            a, b, c, d = side[:-1], side[1:], rib[1:], rib[:-1]
            part = np.concatenate(
                [[[0, side[0], rib[0]], [side[-1], 1, rib[-1]]], np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
            )
            faces.append(part if flip else part[:, ::-1])
    return np.concatenate(faces).astype(np.int32)


def leaves(
    base: Array, along: Array, up: Array, size: Array, slim: float, shading: Array, outline: tuple[float, ...]
) -> Model:
    """Return n leaves with a rib, a fold along it, a bend towards the tip and an outline.

    Parameters
    ----------
    base
        (n, 3) the stalks' ends, metres.
    along
        (n, 3) unit vectors towards the tips.
    up
        (n, 3) vectors out of the leaves' upper sides, roughly.
    size
        (n,) lengths, metres.
    slim
        Greatest width as a part of the length.
    shading
        (n, 3) unit normals of the mass that the leaves clothe: foliage looks full when its leaves share them.
    outline
        Half widths at even steps from stalk to tip, as parts of the greatest one.

    Returns
    -------
    Model
        The leaves, whose vertices are leaf after leaf, 2 + 4 per step of the outline; the first two are stalk and tip.
    """
    side = np.cross(along, up)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
    up = np.cross(side, along)
    stations = len(outline)
    t = np.arange(1, stations + 1) / (stations + 1)
    half, bend = 0.5 * slim * np.array(outline), 0.16 * np.sin(np.pi * t) - 0.14 * t**2
    flat = np.zeros((2 + 4 * stations, 3))  # (across, up, along) as shares of the length
    flat[1] = 0, -0.14, 1
    for k, (across, lift) in enumerate(
        ((-half, 0.35 * half), (half, 0.35 * half), (0 * t, 0 * t), (0 * t, 0 * t - 0.05))
    ):
        flat[2 + k :: 4] = np.stack([across, bend + lift, t], axis=1)
    axes = np.stack([side, up, along], axis=1)  # (n, 3, 3)
    corners = base[:, None] + size[:, None, None] * np.einsum("kc,ncx->nkx", flat, axes)
    normals = np.repeat(shading[:, None], len(flat), axis=1)
    normals[:, 2::4] -= 0.22 * side[:, None]  # the halves look a little apart
    normals[:, 3::4] += 0.22 * side[:, None]
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    faces = len(flat) * np.arange(len(base))[:, None, None] + _leaf_faces(stations)
    positions = corners.reshape(-1, 3).astype(np.float32)
    return Model(
        positions,
        faces.reshape(-1, 3).astype(np.int32),
        np.ones_like(positions),
        normals.reshape(-1, 3).astype(np.float32),
    )


def leaf_pattern(outline: tuple[float, ...]) -> NDArray[np.float64]:
    """Return how much lighter than the leaf as a whole each of its vertices is painted; negative is darker.

    The result (2 + 4 · steps of `outline`,) is a part of the way from the dark to the light colour of foliage. Its
    order is that of the vertices of a leaf that `leaves` makes.
    """
    stations = len(outline)
    pattern = np.zeros(2 + 4 * stations)
    pattern[:2] = -0.1, 0.18
    pattern[2::4] = pattern[3::4] = -0.06 + 0.12 * np.arange(stations) / stations
    pattern[4::4], pattern[5::4] = 0.16, -0.16
    return pattern


def brushes(base: Array, tip: Array, width: Array, rings: int, sides: int) -> tuple[Model, NDArray[np.float64]]:
    """Return n twigs set with needles: spindles whose surface is needles in tufts, pointing forward.

    Parameters
    ----------
    base, tip
        (n, 3) ends of the twigs, metres.
    width
        (n,) widths from needle tip to needle tip, metres.
    rings, sides
        Number of rows of vertices along a twig, and of vertices in a row. Every other vertex is the tip of a needle.

    Returns
    -------
    model : Model
        The twigs, one after the other, each of 2 + rings · sides vertices, base and tip first.
    outward : NDArray[np.float64]
        (2 + rings · sides,) 1 for those vertices of a twig that are needles' tips, 0 for those between needles.
    """
    axis = tip - base
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    helper = np.where(np.abs(axis[:, 1:2]) > 0.9 * length, [[1.0, 0, 0]], [[0, 1.0, 0]])
    side = np.cross(axis, helper)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(side, axis / length)
    ring, place = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    needle = ((ring + place) % 2).astype(float)  # 1: a needle's tip, 0: the hollow beside it
    t = (ring + 0.5 + 0.55 * needle) / (rings + 0.6)
    taper = np.sqrt(np.clip(4 * t * (1 - t), 0.05, 1)) * (1 - 0.35 * t)
    radius = 0.5 * taper * (0.45 + 0.75 * needle)
    theta = 2 * np.pi * (place + 0.37 * ring) / sides
    body = (
        base[:, None]
        + t.ravel()[None, :, None] * axis[:, None]
        + width[:, None, None]
        * (
            (radius * np.cos(theta)).ravel()[None, :, None] * side[:, None]
            + (radius * np.sin(theta)).ravel()[None, :, None] * other[:, None]
        )
    )
    positions = np.concatenate([base[:, None], tip[:, None], body], axis=1).reshape(-1, 3).astype(np.float32)
    j = np.arange(sides)
    a = 2 + (np.arange(rings - 1)[:, None] * sides + j).ravel()
    b = 2 + (np.arange(rings - 1)[:, None] * sides + (j + 1) % sides).ravel()
    last = 2 + (rings - 1) * sides
    one = np.concatenate(
        [
            np.stack([a, b, a + sides], 1),
            np.stack([b, b + sides, a + sides], 1),
            np.stack([0 * j, 2 + (j + 1) % sides, 2 + j], 1),
            np.stack([0 * j + 1, last + j, last + (j + 1) % sides], 1),
        ]
    )
    faces = (2 + rings * sides) * np.arange(len(base))[:, None, None] + one[:, ::-1]
    outward = np.concatenate([[0.0, 1.0], needle.ravel()])
    return Model(positions, faces.reshape(-1, 3).astype(np.int32), np.ones_like(positions)), outward
