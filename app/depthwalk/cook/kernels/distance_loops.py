"""Measure the distance of points from triangles. The reference is `cook.cluster_error`."""

import numpy as np

from depthwalk.kernels.compilation import (
    Float64Array1,
    Float64Array2,
    Float64Array3,
    Int64Array1,
    compiled,
    compiled_as_annotated,
)
from depthwalk.types import Array, Ints

_BLOCK = 32  # triangles that are passed over together


@compiled
def _spheres(corners: Array) -> tuple[Array, Array]:
    """Return the middles (t, 3) of triangles, and how far these reach from there (t,)."""
    middle, reach = np.empty((len(corners), 3)), np.zeros(len(corners))
    for row in range(len(corners)):
        for axis in range(3):
            middle[row, axis] = (corners[row, 0, axis] + corners[row, 1, axis] + corners[row, 2, axis]) / 3
        for corner in range(3):
            apart = 0.0
            for axis in range(3):
                apart += (corners[row, corner, axis] - middle[row, axis]) ** 2
            reach[row] = max(reach[row], np.sqrt(apart))
    return middle, reach


@compiled
def _blocks(middle: Array, reach: Array) -> tuple[Array, Array]:
    """Return centres (b, 3) and radii (b,) of spheres around runs of `_BLOCK` triangles, which are near each other."""
    count = -(-len(middle) // _BLOCK)
    centre, radius = np.zeros((count, 3)), np.zeros(count)
    for block in range(count):
        rows = range(block * _BLOCK, min((block + 1) * _BLOCK, len(middle)))
        for row in rows:
            for axis in range(3):
                centre[block, axis] += middle[row, axis] / len(rows)
        for row in rows:
            radius[block] = max(radius[block], np.sqrt(_squared(middle[row], centre[block])) + reach[row])
        radius[block] *= 1 + 1e-9
    return centre, radius


@compiled
def _nearest_block(p: Array, centre: Array, begin: int, end: int) -> int:
    """Return the block, from `begin` to `end`, whose centre is nearest to a point."""
    nearest, least = begin, np.inf
    for block in range(begin, end):
        apart = _squared(p, centre[block])
        if apart < least:
            nearest, least = block, apart
    return nearest


@compiled
def _squared(p: Array, q: Array) -> float:
    """Return the squared distance of two points."""
    return float((p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2)


@compiled
def _below(p: Array, corners: Array) -> tuple[bool, float, float]:
    """Return whether a point is above or below a triangle (3, 3), and the last two barycentric coordinates there."""
    ab = ac = bc = along_ab = along_ac = 0.0
    for axis in range(3):
        u, v, w = corners[1, axis] - corners[0, axis], corners[2, axis] - corners[0, axis], p[axis] - corners[0, axis]
        ab += u * u
        ac += v * v
        bc += u * v
        along_ab += u * w
        along_ac += v * w
    area = ab * ac - bc * bc
    if area > 0:
        v, w = (ac * along_ab - bc * along_ac) / area, (ab * along_ac - bc * along_ab) / area
        return v >= 0 and w >= 0 and v + w <= 1, v, w
    return False, 0.0, 0.0


@compiled
def _squared_distance(p: Array, corners: Array) -> float:
    """Return the squared distance of a point from a triangle (3, 3)."""
    above, v, w = _below(p, corners)
    if above:
        plane = 0.0
        for axis in range(3):
            a = corners[0, axis]
            plane += (p[axis] - a - v * (corners[1, axis] - a) - w * (corners[2, axis] - a)) ** 2
        return plane
    least = np.inf
    for corner in range(3):
        least = min(least, _from_edge(p, corners[corner], corners[(corner + 1) % 3]))
    return least


@compiled
def _from_edge(p: Array, start: Array, end: Array) -> float:
    """Return the squared distance of a point from an edge."""
    length = inward = 0.0
    for axis in range(3):
        step = end[axis] - start[axis]
        length += step * step
        inward += step * (p[axis] - start[axis])
    share = min(max(inward / length, 0.0), 1.0) if length > 0 else 0.0
    apart = 0.0
    for axis in range(3):
        apart += (p[axis] - start[axis] - share * (end[axis] - start[axis])) ** 2
    return apart


@compiled
def _off_colour(p: Array, corners: Array, colour: Array, colours: Array) -> float:
    """Return the squared difference of a colour (3,) from that of a triangle (3, 3) at its point nearest to p."""
    share = _shares(p, corners)
    off = 0.0
    for k in range(3):
        off += (share[0] * colours[0, k] + share[1] * colours[1, k] + share[2] * colours[2, k] - colour[k]) ** 2
    return off


@compiled
def _shares(p: Array, corners: Array) -> tuple[float, float, float]:
    """Return the barycentric coordinates of the point of a triangle (3, 3) that is nearest to p."""
    above, v, w = _below(p, corners)
    if above:
        return 1 - v - w, v, w
    best, least, along = 0, np.inf, 0.0
    for corner in range(3):
        start, end = corners[corner], corners[(corner + 1) % 3]
        apart = _from_edge(p, start, end)
        if apart < least:
            length = inward = 0.0
            for axis in range(3):
                step = end[axis] - start[axis]
                length += step * step
                inward += step * (p[axis] - start[axis])
            best, least, along = corner, apart, min(max(inward / length, 0.0), 1.0) if length > 0 else 0.0
    if best == 0:
        return 1 - along, along, 0.0
    if best == 1:
        return 0.0, 1 - along, along
    return along, 0.0, 1 - along


@compiled_as_annotated
def nearest(
    point: Float64Array2,
    of: Int64Array1,
    corners: Float64Array3,
    group: Int64Array1,
    colour: Float64Array2,
    colours: Float64Array3,
    metres: Float64Array1,
) -> tuple[Array, Ints]:
    """Find the nearest triangle of its group to each point; see `cook.cluster_error.group_errors`.

    point: (n, 3); of: (n,) group of each, ascending; corners: (t, 3, 3); group: (t,) of each triangle, ascending;
    colour: (n, 3) and colours: (t, 3, 3), or none of either; metres: (t,) that a difference of 1 between them counts
    as. Returns the squared distances (n,), and the triangles (n,).
    """
    distance, triangles = np.full(len(point), np.inf), np.full(len(point), -1)
    middle, reach = _spheres(corners)
    centre, radius = _blocks(middle, reach)
    begin = end = 0
    for row in range(len(point)):
        if row == 0 or of[row] != of[row - 1]:
            begin = np.searchsorted(group, of[row])
            end = np.searchsorted(group, of[row], side="right")
        best, root, chosen, p = np.inf, np.inf, -1, point[row]
        if begin == end:
            continue
        first = _nearest_block(p, centre, begin // _BLOCK, (end - 1) // _BLOCK + 1)
        for step in range(-1, (end - 1) // _BLOCK + 1 - begin // _BLOCK):  # the nearest block first, then all others
            block = first if step < 0 else begin // _BLOCK + step
            if step >= 0 and (block == first or _squared(p, centre[block]) > (root + radius[block]) ** 2):
                continue
            for triangle in range(max(begin, block * _BLOCK), min(end, (block + 1) * _BLOCK)):
                apart = _squared(p, middle[triangle])
                if apart > best and apart > (root + reach[triangle]) ** 2:
                    continue
                found = _squared_distance(p, corners[triangle])
                if found <= best and len(colour):
                    off = _off_colour(p, corners[triangle], colour[row], colours[triangle])
                    found += metres[triangle] ** 2 * off
                if found < best or (found == best and triangle < chosen):  # of equally near ones, always the same
                    best, root, chosen = found, np.sqrt(found), triangle
        distance[row], triangles[row] = best, chosen
    return distance, triangles
