"""Find where rays hit a height field, by the searches of three ways to draw it, or as precisely as is wanted.

Twin of shaders/common/height_field.glsl: the same coordinates, and the same surface. With few steps `first_hits` is the
search of shaders/relief/relief.frag (Policarpo, Oliveira and Comba 2005); with many it finds the true surface, against
which the other ways are judged. `parallax_hits` and `distance_hits` are the twins of shaders/parallax and
shaders/distance.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from depthwalk.types import Array, Mask, Rows


def surface_depth(depth: NDArray[np.floating], across: Array) -> Array:
    """Return the depth of a height field at points of its picture, interpolated linearly between texels.

    Parameters
    ----------
    depth
        (H, W) depth behind the picture's plane, 1 at the back of the box, much more where there is no surface.
    across
        (n, 2) u and v, 0 to 1 over the picture; v rises with the row.

    Returns
    -------
    Array
        (n,) depths.
    """
    height, width = depth.shape
    column, row = across[:, 0] * width - 0.5, across[:, 1] * height - 0.5
    return np.asarray(map_coordinates(depth, [row, column], order=1, mode="nearest", output=np.float64))


def box_interval(shape: tuple[int, int], viewer: Array, direction: Array) -> tuple[Array, Array]:
    """Return where rays enter the box around a height field, and where they leave it.

    The box ends at the centres of the outermost texels, as the surface does.

    Parameters
    ----------
    shape
        Height H and width W of the depth image, texels.
    viewer
        (3,) where all rays start, field coordinates: u, v and depth, in front of the picture, so that depth < 0.
    direction
        (n, 3) directions of the rays, field coordinates, of any length.

    Returns
    -------
    tuple
        (n,) and (n,) multiples of `direction`; a ray that misses the box leaves it before it enters.
    """
    margin = np.array([0.5 / shape[1], 0.5 / shape[0]])
    low, high = np.append(margin, 0.0), np.append(1 - margin, 1.0)
    along = np.where(np.abs(direction) < 1e-12, 1e-12, direction)
    ends = np.stack([(low - viewer) / along, (high - viewer) / along])
    return np.maximum(ends.min(0).max(1), 0.0), ends.max(0).min(1)


def first_hits(
    depth: NDArray[np.floating], viewer: Array, direction: Array, linear_steps: int, binary_steps: int
) -> Array:
    """Return where rays first go from in front of the surface to behind it.

    Parameters
    ----------
    depth
        (H, W) the height field, as `surface_depth` takes it.
    viewer
        (3,) where all rays start, field coordinates, depth < 0.
    direction
        (n, 3) directions of the rays, field coordinates, of any length.
    linear_steps
        Number of equal steps in the box. Anything thinner than a step may be missed.
    binary_steps
        How often the step in which the ray hits the surface is halved.

    Returns
    -------
    Array
        (n,) multiples of `direction`; NaN for rays that do not hit the surface.
    """
    enters, leaves = box_interval((depth.shape[0], depth.shape[1]), viewer, direction)

    def ahead(rows: Rows, part: Array) -> Array:
        """Return how far in front of the surface the rays `rows` are after `part` of their way, 1 the whole depth."""
        way = enters[rows] + part * (leaves - enters)[rows]
        at = viewer + way[:, None] * direction[rows]
        return np.subtract(surface_depth(depth, at[:, :2]), at[:, 2])

    rays = np.flatnonzero(leaves > enters)
    found = np.full(len(direction), np.nan)
    by_front = viewer[2] + enters[rays] * direction[rays, 2] < 1e-6
    in_front = by_front | (ahead(rays, np.zeros(len(rays))) > 0)
    for k in range(1, linear_steps + 1):
        now = ahead(rays, np.full(len(rays), k / linear_steps)) > 0
        met = in_front & ~now
        found[rays[met]] = k / linear_steps
        rays, in_front = rays[~met], now[~met]
    rays = np.flatnonzero(np.isfinite(found))
    behind = found[rays]
    before = behind - 1 / linear_steps
    for _ in range(binary_steps):
        middle = (before + behind) / 2
        is_behind = ahead(rays, middle) <= 0
        before, behind = np.where(is_behind, before, middle), np.where(is_behind, middle, behind)
    at = viewer + (enters[rays] + before * (leaves - enters)[rays])[:, None] * direction[rays]
    beside = surface_depth(depth, at[:, :2]) > 1  # past the edge of a surface, which is not a wall
    found[rays] = np.where(beside, np.nan, enters[rays] + behind * (leaves - enters)[rays])
    return found


def parallax_hits(
    depth: NDArray[np.floating], viewer: Array, direction: Array, *, size: Array, min_steps: int, max_steps: int
) -> Array:
    """Return where parallax occlusion mapping shows rays that enter the box by its front (Tatarchuk 2006).

    Parameters
    ----------
    depth, viewer, direction
        See `first_hits`.
    size
        (3,) width, height and depth of the box, metres.
    min_steps, max_steps
        Numbers of equal steps along rays perpendicular to the picture and parallel to it. After the first step that
        ends behind the surface, one secant through its ends is taken.

    Returns
    -------
    Array
        (n,) multiples of `direction`; NaN for rays that enter elsewhere, and where there is no surface.
    """
    enters, leaves = box_interval((depth.shape[0], depth.shape[1]), viewer, direction)
    start, way = viewer + enters[:, None] * direction, (leaves - enters)[:, None] * direction
    cosine = way[:, 2] * size[2] / np.linalg.norm(way * size, axis=1)
    steps = (max_steps + (min_steps - max_steps) * cosine).astype(int)
    last = now = np.minimum(_behind(depth, start), 0)
    part = np.zeros(len(direction))
    for k in range(1, max_steps + 1):
        on = ((now < 0) | (k == 1)) & (k <= steps)  # the first step is taken from the very surface, too
        last, part = np.where(on, now, last), np.where(on, k / steps, part)
        now = np.where(on, _behind(depth, start + part[:, None] * way), now)
    part = np.where(now >= 0, part - now / (now - last + 1e-12) / steps, part)
    return _shown(depth, start, way, enters + part * (leaves - enters), part, (start[:, 2] < 1e-6) & (leaves > enters))


def distance_hits(
    depth: NDArray[np.floating],
    distances: NDArray[np.floating],
    viewer: Array,
    direction: Array,
    *,
    size: Array,
    steps: int,
) -> Array:
    """Return where sphere tracing shows rays (Donnelly 2005): each step is as long as the distance to the surface.

    Parameters
    ----------
    depth, viewer, direction, size
        See `parallax_hits`.
    distances
        (D, H, W) metres from points in the box to the surface, 0 behind it, see `distance_volume`.
    steps
        Most steps of a ray; if they do not suffice, the last point is shown.

    Returns
    -------
    Array
        (n,) multiples of `direction`; NaN for rays that do not hit the surface.
    """
    enters, leaves = box_interval((depth.shape[0], depth.shape[1]), viewer, direction)
    start, way = viewer + enters[:, None] * direction, (leaves - enters)[:, None] * direction
    by_front, metres = start[:, 2] < 1e-6, np.linalg.norm(way * size, axis=1)
    part, on = np.zeros(len(direction)), (leaves > enters) & (by_front | (_behind(depth, start) < 0))
    drawn, shape = on.copy(), np.array(distances.shape[::-1])
    for _ in range(steps):
        place = (start[on] + part[on, None] * way[on]) * shape - 0.5
        clear = map_coordinates(distances, place.T[::-1], order=1, mode="nearest", output=np.float64)
        part[on] += clear / metres[on]
        on[on] = (clear > 0) & (part[on] <= 1)
    part = np.minimum(part, 1)
    drawn &= (part < 1) | (_behind(depth, start + way) >= 0)
    return _shown(depth, start, way, enters + part * (leaves - enters), part, drawn)


def _behind(depth: NDArray[np.floating], at: Array) -> Array:
    """Return how far behind the surface points (n, 3) are, 1 the whole depth; negative in front of it."""
    return np.asarray(at[:, 2] - surface_depth(depth, at[:, :2]))


def _shown(depth: NDArray[np.floating], start: Array, way: Array, hit: Array, part: Array, drawn: Mask) -> Array:
    """Return `hit` where there is a surface after `part` of rays that are drawn, NaN elsewhere."""
    at = start + part[:, None] * way
    return np.where(drawn & (surface_depth(depth, at[:, :2]) <= 1), hit, np.nan)
