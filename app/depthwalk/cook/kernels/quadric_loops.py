"""Compute quadric error metrics of single places. The reference is `cook.quadrics`."""

import math

from depthwalk.kernels.compilation import compiled
from depthwalk.types import Array


@compiled
def triangle_normal(a: Array, b: Array, c: Array) -> tuple[float, float, float, float]:
    """Return the normal of a triangle, as long as twice its area, and this length."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    return x, y, z, math.sqrt(x * x + y * y + z * z)


@compiled
def add_plane(quadric: Array, x: float, y: float, z: float, point: Array, weight: float) -> None:
    """Add a plane through a point to a quadric (10,)."""
    w = -(x * point[0] + y * point[1] + z * point[2])
    add_square(quadric, x, y, z, w, weight)


@compiled
def add_square(quadric: Array, x: float, y: float, z: float, w: float, weight: float) -> None:
    """Add the square of a function of position to a quadric (10,)."""
    quadric[0] += weight * x * x
    quadric[1] += weight * x * y
    quadric[2] += weight * x * z
    quadric[3] += weight * x * w
    quadric[4] += weight * y * y
    quadric[5] += weight * y * z
    quadric[6] += weight * y * w
    quadric[7] += weight * z * z
    quadric[8] += weight * z * w
    quadric[9] += weight * w * w


@compiled
def distance(one: Array, other: Array, point: Array) -> float:
    """Return the weighted squared distance of a point from the planes of two quadrics (10,)."""
    x, y, z = point[0], point[1], point[2]
    xx, xy, xz, xw = one[0] + other[0], one[1] + other[1], one[2] + other[2], one[3] + other[3]
    yy, yz, yw, zz = one[4] + other[4], one[5] + other[5], one[6] + other[6], one[7] + other[7]
    mixed = x * (xy * y + xz * z + xw) + y * (yz * z + yw) + z * (one[8] + other[8])
    return float(xx * x * x + yy * y * y + zz * z * z + 2 * mixed + one[9] + other[9])


@compiled
def optimal_point(one: Array, other: Array, stiffness: float, start: Array, end: Array, best: Array) -> None:
    """Write the point nearest to the planes of two quadrics (10,) to `best` (3,), see `quadrics.optimal_points`.

    A spring pulls it to the middle between `start` and `end`, where it stays if it would be farther off than they are
    from each other.
    """
    xx, xy, xz = one[0] + other[0] + stiffness, one[1] + other[1], one[2] + other[2]
    yy, yz, zz = one[4] + other[4] + stiffness, one[5] + other[5], one[7] + other[7] + stiffness
    middle_x, middle_y, middle_z = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2, (start[2] + end[2]) / 2
    x = stiffness * middle_x - one[3] - other[3]
    y = stiffness * middle_y - one[6] - other[6]
    z = stiffness * middle_z - one[8] - other[8]
    ax, ay, az = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    by, bz, cz = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    determinant = xx * ax + xy * ay + xz * az
    best[0] = (ax * x + ay * y + az * z) / determinant
    best[1] = (ay * x + by * y + bz * z) / determinant
    best[2] = (az * x + bz * y + cz * z) / determinant
    off = (best[0] - middle_x) ** 2 + (best[1] - middle_y) ** 2 + (best[2] - middle_z) ** 2
    if not off <= (start[0] - end[0]) ** 2 + (start[1] - end[1]) ** 2 + (start[2] - end[2]) ** 2:
        best[0], best[1], best[2] = middle_x, middle_y, middle_z
