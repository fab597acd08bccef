"""Compute quadrics of colours for single places. The reference is `cook.colour_quadrics`.

Sums are kept in variables and written once: numba cannot know that arrays do not overlap, and would store each term.
"""

from depthwalk.cook.kernels.collapse_costs import COLOUR
from depthwalk.cook.kernels.quadric_loops import add_square, triangle_normal
from depthwalk.cook.kernels.surface_loops import Surface
from depthwalk.kernels.compilation import compiled


@compiled
def begin_colours(s: Surface, begin: int, end: int, places: int) -> None:
    """Add the colours of the triangles from `begin` to `end` to their places with one vertex.

    places: number of them, which are listed in `around`.
    """
    for k in range(places):
        number = s.lists[k].around
        for value in range(13):
            s.tint[number, value] = 0.0
    for triangle in range(begin, end):
        _add_colours(s, triangle)


@compiled
def _add_colours(s: Surface, triangle: int) -> None:
    """Add the colours of a triangle to its places."""
    one, two, three = s.corners[3 * triangle], s.corners[3 * triangle + 1], s.corners[3 * triangle + 2]
    a, b, c = s.places[one.place].point, s.places[two.place].point, s.places[three.place].point
    x, y, z, size = triangle_normal(a, b, c)
    scale = 1 / max(size * size, 1e-60)
    weight = COLOUR**2 * size * size / 4
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    bx, by, bz = (vy * z - vz * y) * scale, (vz * x - vx * z) * scale, (vx * y - vy * x) * scale
    cx, cy, cz = (y * uz - z * uy) * scale, (z * ux - x * uz) * scale, (x * uy - y * ux) * scale
    for k in range(3):
        first = s.look[one.vertex, s.colour + k]
        to_b, to_c = s.look[two.vertex, s.colour + k] - first, s.look[three.vertex, s.colour + k] - first
        gx, gy, gz = to_b * bx + to_c * cx, to_b * by + to_c * cy, to_b * bz + to_c * cz
        value = first - (gx * a[0] + gy * a[1] + gz * a[2])
        for corner in range(3 * triangle, 3 * triangle + 3):
            number = s.corners[corner].place
            if s.places[number].several == 1:
                tint = s.tint[number]
                tint[4 * k] += weight * gx
                tint[4 * k + 1] += weight * gy
                tint[4 * k + 2] += weight * gz
                tint[4 * k + 3] += weight * value
                add_square(s.places[number].quadric, gx, gy, gz, value, weight)
    for corner in range(3 * triangle, 3 * triangle + 3):
        number = s.corners[corner].place
        if s.places[number].several == 1:
            s.tint[number, 12] += weight


@compiled
def reduce(s: Surface, start: int, to: int) -> None:
    """Write the sum of two places' quadrics, with the colours that suit the position best, to `merged`."""
    one, other, p, q = s.tint[start], s.tint[to], s.places[start].quadric, s.places[to].quadric
    xx = xy = xz = xw = yy = yz = yw = zz = zw = ww = 0.0
    for k in range(0, 12, 4):
        x, y, z, w = one[k] + other[k], one[k + 1] + other[k + 1], one[k + 2] + other[k + 2], one[k + 3] + other[k + 3]
        xx += x * x
        xy += x * y
        xz += x * z
        xw += x * w
        yy += y * y
        yz += y * z
        yw += y * w
        zz += z * z
        zw += z * w
        ww += w * w
    scale, m = 1 / max(one[12] + other[12], 1e-300), s.merged
    m[0], m[1], m[2] = p[0] + q[0] - scale * xx, p[1] + q[1] - scale * xy, p[2] + q[2] - scale * xz
    m[3], m[4], m[5] = p[3] + q[3] - scale * xw, p[4] + q[4] - scale * yy, p[5] + q[5] - scale * yz
    m[6], m[7], m[8] = p[6] + q[6] - scale * yw, p[7] + q[7] - scale * zz, p[8] + q[8] - scale * zw
    m[9] = p[9] + q[9] - scale * ww


@compiled
def best_colour(s: Surface, start: int, to: int, k: int) -> float:
    """Return channel k, 0 to 1, that suits the target best if a place merges with another."""
    one, other, p = s.tint[start], s.tint[to], s.target
    value = one[4 * k + 3] + other[4 * k + 3]
    for axis in range(3):
        value += (one[4 * k + axis] + other[4 * k + axis]) * p[axis]
    return float(min(max(value / max(one[12] + other[12], 1e-300), 0.0), 1.0))


@compiled
def fixed_colour_cost(s: Surface, start: int, to: int) -> float:
    """Return what it costs that a place keeps its colour, rather than the best one, when another merges with it."""
    if s.tint[to, 12] == 0:  # it has several
        return 0.0
    corner = s.places[to].first
    while not s.alive[corner // 3]:
        corner = s.corners[corner].following
    off, vertex = 0.0, s.corners[corner].vertex
    for k in range(3):
        off += (s.look[vertex, s.colour + k] - best_colour(s, start, to, k)) ** 2
    return float((s.tint[start, 12] + s.tint[to, 12]) * off)


@compiled
def merge_colours(s: Surface, start: int, to: int) -> None:
    """Add the tint of a place to that of the one that it merges with, whose quadric is that of both already.

    If this has several colours, the tint ends here: from now on, the best ones are in the quadric.
    """
    quadric, tint = s.places[to].quadric, s.tint[start]
    if s.tint[to, 12] > 0:
        for k in range(13):
            s.tint[to, k] += tint[k]
    elif tint[12] > 0:
        for k in range(0, 12, 4):
            add_square(quadric, tint[k], tint[k + 1], tint[k + 2], tint[k + 3], -1 / tint[12])
