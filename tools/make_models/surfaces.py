"""Build meshes directly: surfaces of revolution, tubes, boxes. All but `panel` are closed and look outward.

Lengths are metres, Y is up. Models are white unless a colour is given.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator
from tools.make_models.model import Model, merged

from depthwalk.types import Array

Polyline = Sequence[Sequence[float]] | Array  # points on a line, in order
Relief = Callable[[Array, Array], Array]
WHITE = (1.0, 1.0, 1.0)


def rounded_profile(points: Polyline, steps: int) -> NDArray[np.float64]:
    """Return (steps, 2) points, about evenly spaced, on a smooth curve through `points` (n, 2) of (radius, y)."""
    corners = np.asarray(points, np.float64)
    at = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    return PchipInterpolator(at, corners)(np.linspace(0, at[-1], steps))


def bevelled_profile(points: Polyline, bevel: float) -> NDArray[np.float64]:
    """Return the line through `points` (n, 2) of (radius, y), each inner corner replaced by two points beside it.

    The two are `bevel` metres from the corner, so that a surface of revolution keeps a crisp edge there.
    """
    corners = np.asarray(points, np.float64)
    before = corners[:-2] - corners[1:-1]
    after = corners[2:] - corners[1:-1]
    shrink = [np.minimum(bevel / np.linalg.norm(v, axis=1, keepdims=True), 0.45) for v in (before, after)]
    pairs = np.stack([corners[1:-1] + before * shrink[0], corners[1:-1] + after * shrink[1]], axis=1)
    return np.concatenate([corners[:1], pairs.reshape(-1, 2), corners[-1:]])


def dense(profile: Polyline, spacing: float) -> NDArray[np.float64]:
    """Return the points `profile` (n, 2) of (radius, y) with others added between, at most `spacing` metres apart."""
    corners = np.asarray(profile, np.float64)
    parts = [corners[:1]]
    for begin, end in pairwise(corners):
        count = max(int(np.ceil(np.linalg.norm(end - begin) / spacing)), 1)
        parts.append(begin + (end - begin) * (np.arange(1, count + 1) / count)[:, None])
    return np.concatenate(parts)


def lathe(profile: Polyline, segments: int, relief: Relief | None = None) -> Model:
    """Return the surface of revolution of a profile about the y axis.

    Parameters
    ----------
    profile
        (n, 2) points of (radius, y), metres, from bottom to top; the first and the last are on the axis.
    segments
        Number of vertices round the axis.
    relief
        Returns factors on the radius for arrays of angles, radians, and y, metres: flutes and lobes. None for none.

    Returns
    -------
    Model
        The surface.
    """
    rings = np.asarray(profile, np.float64)
    theta = 2 * np.pi * np.arange(segments) / segments
    inner = rings[1:-1]
    grid_theta, grid_y = np.meshgrid(theta, inner[:, 1])
    radius = inner[:, :1] * (np.ones_like(grid_theta) if relief is None else relief(grid_theta, grid_y))
    body = np.stack([radius * np.cos(grid_theta), grid_y, radius * np.sin(grid_theta)], axis=-1).reshape(-1, 3)
    positions = np.concatenate([body, [[0, rings[0, 1], 0], [0, rings[-1, 1], 0]]])
    faces = np.concatenate([_grid_faces(len(inner), segments), _fans(len(inner), segments)])
    return Model(positions.astype(np.float32), faces, np.ones_like(positions, np.float32))


def _grid_faces(rings: int, segments: int) -> NDArray[np.int32]:
    """Return the faces of a grid that closes along its second axis."""
    i, j = np.meshgrid(np.arange(rings - 1), np.arange(segments), indexing="ij")
    a, b = i * segments + j, i * segments + (j + 1) % segments
    c, d = a + segments, b + segments
    return np.stack([a, c, b, b, c, d], axis=-1).reshape(-1, 3).astype(np.int32)


def _fans(rings: int, segments: int) -> NDArray[np.int32]:
    """Return fans that close the first ring at vertex rings·segments and the last one at the vertex after it."""
    j = np.arange(segments)
    following, last, pole = (j + 1) % segments, (rings - 1) * segments, rings * segments
    bottom = np.stack([np.full_like(j, pole), j, following], axis=1)
    top = np.stack([np.full_like(j, pole + 1), last + following, last + j], axis=1)
    return np.concatenate([bottom, top]).astype(np.int32)


def tube(path: Polyline, radii: ArrayLike, sides: int) -> Model:
    """Return a round tube along `path` (n, 3), closed at both ends.

    `radii` are (n,), or one for all points, metres; `sides` is the number of vertices round the tube.
    """
    points = np.asarray(path, np.float64)
    radius = np.broadcast_to(np.asarray(radii, np.float64), len(points))
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.empty_like(along)
    side = np.eye(3)[np.argmin(np.abs(along[0]))]
    for k, direction in enumerate(along):  # each frame follows from the one before: no twist
        side = side - direction * (side @ direction)
        side /= np.linalg.norm(side)
        across[k] = side
    other = np.cross(across, along)
    theta = 2 * np.pi * np.arange(sides) / sides
    ring = np.cos(theta)[:, None] * across[:, None] + np.sin(theta)[:, None] * other[:, None]
    body = points[:, None] + radius[:, None, None] * ring
    positions = np.concatenate([body.reshape(-1, 3), points[[0, -1]]])
    faces = np.concatenate([_grid_faces(len(points), sides), _fans(len(points), sides)])
    return Model(positions.astype(np.float32), faces, np.ones_like(positions, np.float32))


def curve(points: Polyline, steps: int) -> NDArray[np.float64]:
    """Return (steps, 3) points, about evenly spaced, on a smooth curve through `points` (n, 3)."""
    knots = np.asarray(points, np.float64)
    at = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
    return PchipInterpolator(at, knots)(np.linspace(0, at[-1], steps))


_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
_SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
_QUAD = np.array([[0, 1, 2], [0, 2, 3]])
_SIDE_NORMALS = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], np.float32)


def block(lower: ArrayLike, upper: ArrayLike, colour: ArrayLike = WHITE) -> Model:
    """Return a box with sharp edges from its `lower` to its `upper` corner, (3,) each, in one `colour` (3,), sRGB.

    Vertices repeat on each side, with the side's normal.
    """
    low, high = np.asarray(lower, np.float32), np.asarray(upper, np.float32)
    positions = (low + _CORNERS * (high - low))[_SIDES].reshape(-1, 3)
    faces = (4 * np.arange(6)[:, None, None] + _QUAD).reshape(-1, 3).astype(np.int32)
    model = Model(positions, faces, np.ones_like(positions), np.repeat(_SIDE_NORMALS, 4, axis=0))
    return model.painted(colour)


def rounded_block(lower: ArrayLike, upper: ArrayLike, edge: float, spacing: float) -> Model:
    """Return a box from its `lower` to its `upper` corner, (3,) each, with edges rounded by the radius `edge`, metres.

    It is one closed surface with a vertex every `spacing` metres.
    """
    low, high = np.asarray(lower, np.float64), np.asarray(upper, np.float64)
    cells = np.maximum(np.ceil((high - low) / spacing), 2).astype(np.int64)
    quads = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        i, j = (grid.ravel() for grid in np.meshgrid(np.arange(cells[u]), np.arange(cells[v]), indexing="ij"))
        ring = np.zeros((len(i), 4, 3), np.int64)
        ring[:, :, u] = np.stack([i, i + 1, i + 1, i], axis=1)
        ring[:, :, v] = np.stack([j, j, j + 1, j + 1], axis=1)
        quads.append(ring[:, ::-1].copy())
        ring[:, :, axis] = cells[axis]
        quads.append(ring)
    lattice = np.concatenate(quads).reshape(-1, 3)
    key = (lattice[:, 0] * (cells[1] + 1) + lattice[:, 1]) * (cells[2] + 1) + lattice[:, 2]
    _, first, corner = np.unique(key, return_index=True, return_inverse=True)
    place = low + lattice[first] * ((high - low) / cells)
    within = np.clip(place, low + edge, high - edge)
    out = place - within
    positions = within + edge * out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)
    faces = corner.reshape(-1, 4)[:, _QUAD].reshape(-1, 3).astype(np.int32)
    return Model(positions.astype(np.float32), faces, np.ones(positions.shape, np.float32))


def panel(corner: ArrayLike, u: ArrayLike, v: ArrayLike, cells: tuple[int, int]) -> Model:
    """Return a flat rectangle from `corner` (3,) along the edges `u` and `v`, (3,) each; it faces u × v.

    It is split into `cells`, so many along u and so many along v. It is not closed.
    """
    along, up = np.asarray(u, np.float64), np.asarray(v, np.float64)
    s, t = np.meshgrid(np.linspace(0, 1, cells[0] + 1), np.linspace(0, 1, cells[1] + 1), indexing="ij")
    positions = np.asarray(corner) + s.reshape(-1, 1) * along + t.reshape(-1, 1) * up
    index = np.arange(len(positions)).reshape(cells[0] + 1, cells[1] + 1)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3).astype(np.int32)
    normal = np.cross(along, up)
    normals = np.broadcast_to(normal / np.linalg.norm(normal), positions.shape).astype(np.float32)
    return Model(positions.astype(np.float32), faces, np.ones_like(positions, np.float32), normals)


def assembled(*models: Model) -> Model:
    """Return `models` as one model that stands on y = 0."""
    return merged(models).grounded()
