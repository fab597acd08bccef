"""Which edges of placed objects are outlines for a viewer, as lines on the screen. NumPy over all edges and objects."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.adjacency import EdgeAdjacency
from depthwalk.geometry.quaternions import matrices
from depthwalk.render.view.view import View, matrix_array

DENSEST = 0.5  # pixels of outline per pixel of the faces seen: where there are more, several share each pixel
_AT_ONCE = 1 << 22  # faces × objects whose orientation is held at a time

# What edge.vert reads per line: its ends in pixels, the object on the left of the way from one to the other; their
# depths; 1 where it is an outline, with something else beyond it, 0 where faces meet that are both seen or both hidden.
LINE_RECORD = np.dtype([("ends", "4f4"), ("depths", "2f4"), ("outline", "f4")])


def outlines(
    edges: EdgeAdjacency, view: View, placed: NDArray[np.void], least_fold: float | None, solid: bool
) -> NDArray[np.void]:
    """LINE_RECORDs of the edges of n objects, `placed` as PLACED_RECORD.

    Taken are those between a front and a back face, open ones, and, where one of their faces is seen, folds beyond
    `least_fold`, radians (edge-optimised GPAA, §1.1); all edges where that is None. solid: back faces are never seen.
    Left out is what is off the screen, what is so short that it passes no pixel's middle, and objects with more
    outlines than `DENSEST`.
    """
    creased = None if least_fold is None else edges.folds < np.cos(least_fold)
    density = edges.density * np.linalg.norm(placed["origin"], axis=1) / (view.focal_pixels * placed["scale"])
    placed = placed.take(np.flatnonzero(density <= DENSEST))  # of records, far quicker than an index
    lines = [
        _lines(edges, view, some, turns, *_taken(edges, some, turns, creased, solid))
        for some, turns in _chunks(placed, _AT_ONCE // len(edges.planes) + 1)
    ]
    return np.concatenate(lines) if lines else np.zeros(0, LINE_RECORD)


def _chunks(placed: NDArray[np.void], count: int) -> Iterator[tuple[NDArray[np.void], NDArray[np.floating]]]:
    """`count` objects at a time, and their rotations."""
    for first in range(0, len(placed), count):
        some = placed[first : first + count]
        yield some, matrices(some["rotation"])


def _taken(
    edges: EdgeAdjacency,
    placed: NDArray[np.void],
    turns: NDArray[np.floating],
    creased: NDArray[np.bool_] | None,
    solid: bool,
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.bool_], NDArray[np.bool_]]:
    """Numbers of edge and object (k,) of each line, whether the first face (k,) is seen from its front, and whether it
    is an outline (k,)."""
    viewer = -(placed["origin"][:, None] @ turns)[:, 0] / placed["scale"][:, None]
    front = edges.planes[:, :3] @ viewer.T > edges.planes[:, 3:]
    first = front[edges.faces[:, 0]]
    outline = first != front[edges.faces[:, 1]]
    if not solid:
        outline[edges.open] = True
    if creased is None:
        taken = np.ones_like(outline)
    elif creased.any():
        taken = outline | (creased[:, None] & (first if solid else True))
    else:
        taken = outline
    edge, number = taken.nonzero()
    return edge, number, first[edge, number], outline[edge, number]


def _lines(
    edges: EdgeAdjacency,
    view: View,
    placed: NDArray[np.void],
    turns: NDArray[np.floating],
    edge: NDArray[np.intp],
    number: NDArray[np.intp],
    forward: NDArray[np.bool_],
    outline: NDArray[np.bool_],
) -> NDArray[np.void]:
    """LINE_RECORDs of `edge` (k,) of the objects `number` (k,), turned round where not `forward` (k,). turns:
    (n, 3, 3), rotations of all objects."""
    ends = edges.ends[edge]
    ends = np.where(forward[:, None], ends, ends[:, ::-1])
    clip, kept = _before_viewer(_clip_points(edges, view, placed, turns)[number[:, None], ends])
    size = np.array(view.size, np.float32)
    at = (clip[..., :2] / clip[..., 3:] + 1) * (size / 2)
    start, stop = at[:, 0], at[:, 1]
    seen = ((np.maximum(start, stop) >= 0) & (np.minimum(start, stop) <= size)).all(1)
    passes = np.floor(start - 0.5) != np.floor(stop - 0.5)  # a pixel's middle along x, along y
    across = np.abs(stop - start)
    seen &= np.where(across[:, 1] > across[:, 0], passes[:, 1], passes[:, 0])
    lines = np.empty(int(seen.sum()), LINE_RECORD)
    lines["ends"] = at[seen].reshape(-1, 4)
    lines["outline"] = outline[kept][seen]
    clip = clip[seen]
    lines["depths"] = clip[..., 2] / clip[..., 3] / 2 + 0.5
    return lines


def _clip_points(
    edges: EdgeAdjacency, view: View, placed: NDArray[np.void], turns: NDArray[np.floating]
) -> NDArray[np.float32]:
    """Clip coordinates (n, v, 4) of all points of n objects, whose rotations are `turns` (n, 3, 3)."""
    clip_from_eye = matrix_array(view.clip_from_eye).T  # for rows (x, y, z, 1) from the left
    clip_from_object = turns.transpose(0, 2, 1) @ clip_from_eye[:3] * placed["scale"][:, None, None]
    clip: NDArray[np.float32] = edges.points @ clip_from_object.astype(np.float32)
    clip += (placed["origin"] @ clip_from_eye[:3] + clip_from_eye[3]).astype(np.float32)[:, None]
    return clip


def _before_viewer(ends: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """The parts beyond the near plane of lines between clip coordinates (k, 2, 4), and which lines (k,) have one."""
    near = ends[..., 2] + ends[..., 3]
    beyond = near > 0
    kept: NDArray[np.bool_] = beyond[:, 0] | beyond[:, 1]
    if beyond.all():
        return ends, kept
    ends, near, beyond = ends[kept], near[kept], beyond[kept, :, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        cut = np.clip(near[:, :1] / (near[:, :1] - near[:, 1:]), 0, 1)
    crossing = ends[:, 0] + cut * (ends[:, 1] - ends[:, 0])
    return np.where(beyond, ends, crossing[:, None]), kept
