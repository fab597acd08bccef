"""Place a cylinder in its asset: its axis, and the smallest circle about it."""

from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthwalk.bake.images import Cylinder, enclosing_cylinder
from depthwalk.ingest.mesh import Mesh
from depthwalk.types import Array

if TYPE_CHECKING:  # a quarter of a second to import, and only bakes need it
    from scipy.spatial.transform import Rotation


@dataclass(frozen=True, kw_only=True)
class Placement:
    """Place a baked object in its asset: asset point = position + rotation · object point.

    Attributes
    ----------
    position
        (3,) metres, asset frame.
    rotation
        From the object's frame to the asset's.
    """

    position: Array  # (3,), metres
    rotation: "Rotation"

    def into_object(self, points: Array) -> Array:
        """Return points (n, 3) of the asset in the object's frame, metres."""
        return np.asarray(self.rotation.apply(points - self.position, inverse=True))

    def into_asset(self, points: Array) -> NDArray[np.float32]:
        """Return points (n, 3) of the object in the asset's frame, metres."""
        return np.asarray((self.position + self.rotation.apply(points)).astype(np.float32))

    def turned_into_object(self, vectors: Array) -> Array:
        """Return directions (n, 3) of the asset in the object's frame."""
        return np.asarray(self.rotation.apply(vectors, inverse=True))

    def placed(self, mesh: Mesh) -> Mesh:
        """Return `mesh`, which is in the asset's frame, in the object's."""
        positions, normals = self.into_object(mesh.positions), self.turned_into_object(mesh.normals)
        return replace(mesh, positions=positions.astype(np.float32), normals=normals.astype(np.float32))


def place_along(axis: ArrayLike, points: Array) -> Placement:
    """Return the placement whose +Y is `axis` (3,), amid points (n, 3) of the asset's frame.

    The axis goes through the middle of the smallest circle around the points seen along it. The turn from +Y to the
    axis is the shortest one.
    """
    from scipy.spatial.transform import Rotation

    rotation, _ = Rotation.align_vectors(np.asarray(axis, float).reshape(1, 3), [[0.0, 1.0, 0.0]])
    (x, z), _ = smallest_circle(rotation.apply(points, inverse=True)[:, [0, 2]])
    return Placement(position=rotation.apply([x, 0.0, z]), rotation=rotation)


def cylinder_around(placement: Placement, points: Array) -> Cylinder:
    """Return the smallest cylinder at `placement` that holds points (n, 3) of the asset's frame."""
    return enclosing_cylinder(placement.into_object(points))


def extent(cylinder: Cylinder) -> float:
    """Return the side of the largest square that an image of the cylinder covers, metres."""
    return max(2 * cylinder.radius, cylinder.height)


def smallest_circle(points: Array) -> tuple[Array, float]:
    """Return centre (2,) and radius of the smallest circle around points (n, 2).

    Grows from the circle around a few points, those that lie on it, by whichever lies farthest outside (Gärtner 1999,
    "Fast and robust smallest enclosing balls", in the plane).
    """
    support = points[:1]
    centre, radius = support[0], 0.0
    while True:
        away = np.hypot(*(points - centre).T)
        farthest = int(away.argmax())
        if away[farthest] <= radius * (1 + 1e-7):
            return centre, float(away[farthest])
        few = np.concatenate([support, points[farthest : farthest + 1]])
        circles = (_circle(few[list(chosen)]) for size in (2, 3) for chosen in combinations(range(len(few)), size))
        holding = [circle for circle in circles if np.hypot(*(few - circle[0]).T).max() <= circle[1] * (1 + 1e-9)]
        if not holding:
            return centre, float(away[farthest])  # rounding alone keeps the point out
        centre, radius, support = min(holding, key=lambda circle: circle[1])


def _circle(points: Array) -> tuple[Array, float, Array]:
    """Return centre and radius of the circle through two points (2, 2), on a diameter, or three (3, 2); and the points.

    The radius is NaN for three points on a line.
    """
    if len(points) == 2:
        centre = points.mean(0)
    else:
        (a, b), first = points[1:] - points[0], points[0]
        doubled = 2 * (a[0] * b[1] - a[1] * b[0])
        with np.errstate(divide="ignore", invalid="ignore"):
            centre = first + np.array([b[1] * (a @ a) - a[1] * (b @ b), a[0] * (b @ b) - b[0] * (a @ a)]) / doubled
    return centre, float(np.hypot(*(points - centre).T).max()), points
