"""Decimate a closed mesh to an exact number of faces, and repair where decimation pinched it."""

from dataclasses import replace

import fast_simplification
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from tools.make_models.meshing import largest_part, tidy
from tools.make_models.model import Model


def without_flaps(model: Model) -> Model:
    """Return `model` without pairs of faces that lie back to back on the same three corners."""
    corners = np.sort(model.faces, axis=1)
    _, which, count = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    return tidy(replace(model, faces=model.faces[count[which] == 1]))


def unpinched(model: Model) -> Model:
    """Return the closed `model`, taken apart where it touches itself along edges, so that each edge joins two faces."""
    edge, partner = _joints(model)
    here, there = np.concatenate([edge, _following(edge)]), np.concatenate([_following(partner), partner])
    links = coo_array((np.ones(len(here), bool), (here, there)), (model.faces.size, model.faces.size))
    _, vertex = connected_components(links, directed=False)
    source = model.faces.ravel()[np.unique(vertex, return_index=True)[1]]
    apart = Model(model.positions[source], vertex.reshape(-1, 3).astype(np.int32), model.colours[source])
    while len(crowded := _crowded(apart)):  # both ends hang together elsewhere: the second pair gets its own middle
        corner, other = crowded[0]
        a, b = apart.faces.ravel()[[corner, _following(corner)]]
        apart = halved(apart, a, b, [corner // 3, other // 3])
    return apart


def _following(corner: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the next corner of the same face.

    Corner k is corner k mod 3 of face k // 3, and stands for the edge that begins there.
    """
    return corner - corner % 3 + (corner + 1) % 3


def _edge_keys(model: Model) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return for each corner's edge (3F,) a number without direction, and whether it leads to the higher vertex."""
    start = model.faces.ravel().astype(np.int64)
    end = model.faces[:, [1, 2, 0]].ravel().astype(np.int64)
    return np.minimum(start, end) * len(model.positions) + np.maximum(start, end), start < end


def _crowded(model: Model) -> NDArray[np.int64]:
    """Return pairs (n, 2) of corners whose faces are joined at an edge that already joins two others."""
    edge, partner = _joints(model)
    keys = _edge_keys(model)[0][edge]  # sorted
    again = np.flatnonzero(np.diff(keys, prepend=-1) == 0)
    return np.stack([edge[again], partner[again]], axis=1)


def _joints(model: Model) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return corners (n,), (n,) whose edges, of opposite directions, are the same one and join their two faces.

    Around an edge with more than two faces, those are joined that have solid between them.
    """
    key, ascending = _edge_keys(model)
    forward, backward = np.flatnonzero(ascending), np.flatnonzero(~ascending)
    angle = _angle_about(model.positions, *np.divmod(key, len(model.positions)), model.faces[:, [2, 0, 1]].ravel())
    edges, first, group = np.unique(key[backward], return_index=True, return_inverse=True)
    zero = angle[backward[first]]  # turn from a backward face on: each forward face follows the one it belongs to
    turn = np.empty(len(key))
    turn[backward] = (angle[backward] - zero[group]) % (2 * np.pi)
    turn[forward] = (angle[forward] - zero[np.searchsorted(edges, key[forward])]) % (2 * np.pi)
    edge = forward[np.lexsort((turn[forward], key[forward]))]
    partner = backward[np.lexsort((turn[backward], key[backward]))]
    nested = np.flatnonzero((key[edge[:-1]] == key[edge[1:]]) & (turn[partner[1:]] <= turn[edge[:-1]]))
    partner[nested], partner[nested + 1] = partner[nested + 1], partner[nested]
    return edge, partner


def _angle_about(
    p: NDArray[np.float32], low: NDArray[np.int64], high: NDArray[np.int64], third: NDArray[np.int32]
) -> NDArray[np.float64]:
    """Return the angles (n,) of the vertices `third` about the axes from `low` to `high`, radians."""
    axis = p[high].astype(np.float64) - p[low]
    axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-20)
    helper = np.where(np.abs(axis[:, :1]) < 0.6, [[1.0, 0, 0]], [[0, 1.0, 0]])
    u = np.cross(axis, helper)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    arm = p[third].astype(np.float64) - p[low]
    return np.arctan2(np.einsum("ij,ij->i", arm, np.cross(axis, u)), np.einsum("ij,ij->i", arm, u))


def simplified(model: Model, count: int) -> Model:
    """Return a closed model decimated by quadric error to at most `count` faces, white all over.

    Raises ValueError where the decimation stops above `count`. Source: Garland and Heckbert 1997.
    """
    result = model
    for slack in (0, 8, 64, 512, 512):  # a pass may stop a little above its target
        arrays = fast_simplification.simplify(result.positions, result.faces, target_count=count - slack, agg=4)
        positions, faces = arrays[0].astype(np.float32), arrays[1].astype(np.int32)
        result = largest_part(unpinched(without_flaps(Model(positions, faces, np.ones_like(positions)))))
        if len(result.faces) <= count:
            return result
    raise ValueError(f"decimation stopped at {len(result.faces)} faces, above {count}")


def with_exact_count(model: Model, count: int) -> Model:
    """Return a closed model decimated to exactly `count` faces.

    It is decimated to just below the number, and its longest edges are halved then. Since a closed surface has an even
    number of faces, an odd number leaves out one face of the underside.
    """
    result = simplified(model, count + count % 2)
    for _ in range((count + 1 - len(result.faces)) // 2):
        ends = result.positions[result.faces[:, :2]]
        longest = np.argmax(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1))
        result = halved(result, result.faces[longest, 0], result.faces[longest, 1])
    return punctured(result) if count % 2 else result


def punctured(model: Model) -> Model:
    """Return `model` without the smallest of the faces that look straight down."""
    a, b, c = (model.positions[model.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    below = np.flatnonzero(normal[:, 1] < -0.999 * area)
    return replace(model, faces=np.delete(model.faces, below[np.argmin(area[below])], axis=0))


def halved(model: Model, a: int, b: int, faces: list[int] | None = None) -> Model:
    """Return a model with a new vertex in the middle of an edge, at which each face becomes two.

    Parameters
    ----------
    model
        The model.
    a, b
        Numbers of the edge's two vertices.
    faces
        Numbers of the faces at the edge that are divided; None divides all of them.

    Returns
    -------
    Model
        The model with the vertex.
    """
    if faces is None:
        faces = np.flatnonzero(((model.faces == a) | (model.faces == b)).sum(axis=1) == 2).tolist()
    old = model.faces[faces]
    middle = len(model.positions)
    parts = [np.delete(model.faces, faces, axis=0), np.where(old == a, middle, old), np.where(old == b, middle, old)]
    ends = [a, b]
    return Model(
        np.vstack([model.positions, model.positions[ends].mean(axis=0, keepdims=True)]).astype(np.float32),
        np.concatenate(parts).astype(np.int32),
        np.vstack([model.colours, model.colours[ends].mean(axis=0, keepdims=True)]).astype(np.float32),
    )
