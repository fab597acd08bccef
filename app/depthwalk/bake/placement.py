"""Place a cylinder in its asset: its axis, and the smallest circle around it."""

from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthwalk.bake.images import Cylinder, enclosing_cylinder
from depthwalk.ingest.mesh import Mesh
from depthwalk.types import Array

if TYPE_CHECKING:  # takes a quarter of a second to import, and only bakes need it
    from scipy.spatial.transform import Rotation


@dataclass(frozen=True, kw_only=True)
class Placement:
    """Place a baked object in its asset: asset point = position + rotation · object point.

    Attributes
    ----------
    position
        (3,) metres, asset frame.
    rotation
        Rotates vectors from the object's frame to the asset's.
    """

    position: Array  # (3,), metres
    rotation: "Rotation"

    def into_object(self, points: Array) -> Array:
        """Convert `points` (n, 3), metres, from the asset's frame to the object's."""
        return np.asarray(self.rotation.apply(points - self.position, inverse=True))

    def into_asset(self, points: Array) -> NDArray[np.float32]:
        """Convert `points` (n, 3), metres, from the object's frame to the asset's, as float32."""
        return np.asarray((self.position + self.rotation.apply(points)).astype(np.float32))

    def turned_into_object(self, vectors: Array) -> Array:
        """Convert the directions `vectors` (n, 3) from the asset's frame to the object's."""
        return np.asarray(self.rotation.apply(vectors, inverse=True))

    def placed(self, mesh: Mesh) -> Mesh:
        """Convert `mesh`, metres, from the asset's frame to the object's."""
        positions, normals = self.into_object(mesh.positions), self.turned_into_object(mesh.normals)
        return replace(mesh, positions=positions.astype(np.float32), normals=normals.astype(np.float32))


def place_along(axis: ArrayLike, points: Array) -> Placement:
    """Return the frame of a cylinder with a given axis direction around given points.

    The axis passes through the centre of the smallest circle around the points, seen along the axis. The rotation is
    the shortest one from +Y.

    Parameters
    ----------
    axis
        (3,) direction of any length above 0, asset frame: +Y of the cylinder's frame.
    points
        (n, 3) metres, asset frame.

    Returns
    -------
    Placement
        Placement of the cylinder's frame in the asset's.
    """
    from scipy.spatial.transform import Rotation

    rotation, _ = Rotation.align_vectors(np.asarray(axis, float).reshape(1, 3), [[0.0, 1.0, 0.0]])
    (x, z), _ = smallest_circle(rotation.apply(points, inverse=True)[:, [0, 2]])
    return Placement(position=rotation.apply([x, 0.0, z]), rotation=rotation)


def cylinder_around(placement: Placement, points: Array) -> Cylinder:
    """Return the smallest cylinder in the frame `placement` that holds `points` (n, 3), metres, asset frame."""
    return enclosing_cylinder(placement.into_object(points))


def extent(cylinder: Cylinder) -> float:
    """Return the side, metres, of the largest square that an image of `cylinder` covers."""
    return max(2 * cylinder.radius, cylinder.height)


def smallest_circle(points: Array) -> tuple[Array, float]:
    """Return the centre (2,) and the radius of the smallest circle around `points` (n, 2), in their unit.

    Starts with the circle around a few points and repeatedly includes the point that lies farthest outside it (Gärtner
    1999, "Fast and robust smallest enclosing balls", in the plane).
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
            return centre, float(away[farthest])  # the point is outside only by rounding
        centre, radius, support = min(holding, key=lambda circle: circle[1])


def _circle(points: Array) -> tuple[Array, float, Array]:
    """Return centre and radius of the circle through two points (2, 2), its diameter, or three (3, 2); and the points.

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
