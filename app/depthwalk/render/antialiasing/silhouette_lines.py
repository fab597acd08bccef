"""Find the edges of objects that are silhouettes or creases for a viewer, as lines on the screen.

Geometric anti-aliasing (`render.passes.gpaa`) blends pixels along these lines. NumPy tests all edges of all objects of
an asset at once; `render.kernels.silhouette_loops` does so where it is loaded.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.adjacency import EdgeAdjacency
from depthwalk.geometry.quaternions import matrices
from depthwalk.render import kernels
from depthwalk.render.view.view import View, matrix_array

MAX_DENSITY = 0.5  # pixels of silhouette per pixel of visible faces; beyond that, pixels have several lines each
_MAX_CHUNK = 1 << 22  # faces × objects that are processed at a time

# What shaders/gpaa/edge.vert reads per line: its ends in pixels, with the object on the left from the first to the
# second; their depths; 1 for a silhouette, with something else beyond it, 0 for a crease between two faces.
LINE_RECORD = np.dtype([("ends", "4f4"), ("depths", "2f4"), ("silhouette", "f4")])


def silhouette_lines(
    edges: EdgeAdjacency, view: View, placed: NDArray[np.void], least_fold: float | None, solid: bool
) -> NDArray[np.void]:
    """Return the lines on the screen that are silhouettes or creases of n objects of one asset.

    An edge between a front and a back face is a silhouette, as is an edge of one face only. A folded edge with a
    visible face is a crease (edge-optimised GPAA, §1.1, see docs/anti-aliasing.md). Left out are lines off the screen,
    lines too short to pass a pixel's centre, and objects with a higher density of silhouettes than `MAX_DENSITY`.

    Parameters
    ----------
    edges : the edges of the asset, in its frame.
    view : the view of the picture, near and far plane fitted.
    placed : (n,) PLACED_RECORD of the objects, relative to the viewer.
    least_fold : the least angle by which creases are folded, radians; None: every edge is drawn.
    solid : whether the asset is closed, so that back faces are never visible.

    Returns
    -------
    (k,) LINE_RECORD.
    """
    loops = kernels.loaded()
    if loops is not None:
        return _compiled_lines(loops.silhouettes, edges, view, placed, least_fold, solid)
    near = np.linalg.norm(placed["origin"], axis=1) <= _farthest(edges, view) * placed["scale"]
    placed = placed.take(np.flatnonzero(near))  # far quicker for records than indexing
    creased = None if least_fold is None else edges.folds < np.cos(least_fold)
    lines = [
        _lines(edges, view, chunk, rotations, _chosen(edges, chunk, rotations, creased, solid))
        for chunk, rotations in _chunks(placed, _MAX_CHUNK // len(edges.planes) + 1)
    ]
    return np.concatenate(lines) if lines else np.zeros(0, LINE_RECORD)


def _farthest(edges: EdgeAdjacency, view: View) -> float:
    """Return the distance, metres, up to which the silhouettes of an object of scale 1 stay below `MAX_DENSITY`."""
    return MAX_DENSITY * view.focal_pixels / edges.density if edges.density else math.inf


def _compiled_lines(
    silhouettes: Callable[..., NDArray[np.float32]],
    edges: EdgeAdjacency,
    view: View,
    placed: NDArray[np.void],
    least_fold: float | None,
    solid: bool,
) -> NDArray[np.void]:
    """Find the lines by the compiled loop `silhouettes`, see `silhouette_lines`."""
    lines = silhouettes(
        points=edges.points,
        ends=edges.ends,
        faces=edges.faces,
        planes=edges.planes,
        folds=edges.folds,
        origin=placed["origin"],
        rotation=placed["rotation"],
        scale=placed["scale"],
        clip_from_eye=matrix_array(view.clip_from_eye),
        width=float(view.size[0]),
        height=float(view.size[1]),
        most_fold=2.0 if least_fold is None else math.cos(least_fold),
        solid=solid,
        farthest=_farthest(edges, view),
    )
    records: NDArray[np.void] = lines.view(LINE_RECORD).reshape(-1)
    return records


def _chunks(placed: NDArray[np.void], count: int) -> Iterator[tuple[NDArray[np.void], NDArray[np.floating]]]:
    """Yield `count` objects at a time, and their rotations (count, 3, 3)."""
    for first in range(0, len(placed), count):
        chunk = placed[first : first + count]
        yield chunk, matrices(chunk["rotation"])


@dataclass(frozen=True, kw_only=True)
class _Chosen:
    """Hold which edges of which objects are drawn, k in all.

    Attributes
    ----------
    edge : (k,) index of the edge.
    number : (k,) index of the object.
    forward : (k,) whether the edge's first face is front-facing: the object is on the left from the first stored end to
        the second.
    silhouette : (k,) whether the edge is a silhouette.
    """

    edge: NDArray[np.intp]
    number: NDArray[np.intp]
    forward: NDArray[np.bool_]
    silhouette: NDArray[np.bool_]


def _chosen(
    edges: EdgeAdjacency,
    placed: NDArray[np.void],
    rotations: NDArray[np.floating],
    creased: NDArray[np.bool_] | None,
    solid: bool,
) -> _Chosen:
    """Return which edges of which objects are drawn. rotations: (n, 3, 3) of all objects."""
    viewer = -(placed["origin"][:, None] @ rotations)[:, 0] / placed["scale"][:, None]
    front = edges.planes[:, :3] @ viewer.T > edges.planes[:, 3:]
    first = front[edges.faces[:, 0]]
    silhouette = first != front[edges.faces[:, 1]]
    if not solid:
        silhouette[edges.open] = True
    if creased is None:
        chosen = np.ones_like(silhouette)
    elif creased.any():
        chosen = silhouette | (creased[:, None] & (first if solid else True))
    else:
        chosen = silhouette
    edge, number = chosen.nonzero()
    return _Chosen(edge=edge, number=number, forward=first[edge, number], silhouette=silhouette[edge, number])


def _lines(
    edges: EdgeAdjacency,
    view: View,
    placed: NDArray[np.void],
    rotations: NDArray[np.floating],
    chosen: _Chosen,
) -> NDArray[np.void]:
    """Return the LINE_RECORDs of those `chosen` edges that are on the screen. rotations: (n, 3, 3) of all objects."""
    ends = edges.ends[chosen.edge]
    ends = np.where(chosen.forward[:, None], ends, ends[:, ::-1])
    clip, kept = _before_viewer(_clip_points(edges, view, placed, rotations)[chosen.number[:, None], ends])
    size = np.array(view.size, np.float32)
    pixels = (clip[..., :2] / clip[..., 3:] + 1) * (size / 2)
    start, stop = pixels[:, 0], pixels[:, 1]
    seen = ((np.maximum(start, stop) >= 0) & (np.minimum(start, stop) <= size)).all(1)
    passes = np.floor(start - 0.5) != np.floor(stop - 0.5)  # a pixel's centre, along x and along y
    across = np.abs(stop - start)
    seen &= np.where(across[:, 1] > across[:, 0], passes[:, 1], passes[:, 0])
    lines = np.empty(int(seen.sum()), LINE_RECORD)
    lines["ends"] = pixels[seen].reshape(-1, 4)
    lines["silhouette"] = chosen.silhouette[kept][seen]
    clip = clip[seen]
    lines["depths"] = clip[..., 2] / clip[..., 3] / 2 + 0.5
    return lines


def _clip_points(
    edges: EdgeAdjacency, view: View, placed: NDArray[np.void], rotations: NDArray[np.floating]
) -> NDArray[np.float32]:
    """Return the clip coordinates (n, v, 4) of all points of n objects. rotations: (n, 3, 3)."""
    clip_from_eye = matrix_array(view.clip_from_eye).T  # for rows (x, y, z, 1) from the left
    clip_from_object = rotations.transpose(0, 2, 1) @ clip_from_eye[:3] * placed["scale"][:, None, None]
    clip: NDArray[np.float32] = edges.points @ clip_from_object.astype(np.float32)
    clip += (placed["origin"] @ clip_from_eye[:3] + clip_from_eye[3]).astype(np.float32)[:, None]
    return clip


def _before_viewer(ends: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Clip lines (k, 2, 4), in clip coordinates, at the near plane; return them and which lines are left, (k,)."""
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
