"""Map the texels of a cylinder's face to space and back: the ray of each texel, and the texel of each point.

A depth image holds only depths; their meaning follows from its face and its size (Liu, Liu and Wu 2007, §2 for planar
images and §3.1 for the cylinder's). Texel (row, column) is at u = (column + 0.5) / W and v = (row + 0.5) / H. u runs
with θ on the side, with z on the right and left box faces, else with x; v runs with z on the caps, else with y.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import INWARD, BakedObject, BoundaryStrip, Cylinder, DepthImage, Face, plane_axes
from depthwalk.geometry.soa import StructOfArrays
from depthwalk.geometry.vectors import lengths
from depthwalk.types import Array


@dataclass(frozen=True, kw_only=True)
class Projection(StructOfArrays):
    """Hold the projections of n points onto a face.

    Attributes
    ----------
    point
        (n, 3), metres, object frame.
    u, v
        (n,), positions on the face, from 0 to 1 within its bounds.
    origin, direction
        (n, 3) float32, object frame, the rays through them: points on the face, metres, and unit vectors inward.
    """

    point: Array
    u: Array
    v: Array
    origin: NDArray[np.float32]
    direction: NDArray[np.float32]

    @property
    def depth(self) -> Array:
        """Return the depth (n,) of the points, metres from the face inward."""
        return lengths(self.point - self.origin)


@dataclass(frozen=True, kw_only=True)
class FaceGrid:
    """Combine one face of a cylinder with the size of its images.

    All layers of a face share one grid; arrays that take time to compute are computed once, when first used.

    Attributes
    ----------
    cylinder
        The volume that the face bounds, object frame, metres.
    face
        One of the cylinder's faces.
    height, width
        Height H and width W of the face's images, texels.
    """

    cylinder: Cylinder
    face: Face
    height: int
    width: int

    @classmethod
    def of(cls, cylinder: Cylinder, image: DepthImage) -> Self:
        """Return the grid of the texels of `image`, a depth image of `cylinder` (object frame, metres)."""
        height, width = image.depth.shape
        return cls(cylinder=cylinder, face=image.face, height=height, width=width)

    @property
    def shape(self) -> tuple[int, int]:
        """Return height H and width W of the face's images, texels."""
        return self.height, self.width

    @property
    def max_depth(self) -> float:
        """Return the greatest depth that the face measures, metres: up to the opposite side of the cylinder."""
        if self.face is Face.SIDE:
            return 2 * self.cylinder.radius
        return float(self.cylinder.box[1][INWARD[self.face][0]])

    @cached_property
    def texel_size(self) -> tuple[float, float]:
        """Return width and height of a texel on the face itself, where depth is 0, metres."""
        if self.face is Face.SIDE:
            return 2 * np.pi * self.cylinder.radius / self.width, self.cylinder.height / self.height
        _, size = self.cylinder.box
        across, up = plane_axes(self.face)
        return float(size[across]) / self.width, float(size[up]) / self.height

    def texel_area(self, depth: Array) -> Array:
        """Return the area of a texel across its ray at `depth` (…), metres from the face: (…) m².

        Towards the axis, the texels of the side become narrower; beyond it, wider again.
        """
        across, up = self.texel_size
        if self.face is not Face.SIDE:
            return np.full(depth.shape, across * up)
        return np.asarray(across * up * np.abs(1 - depth / self.cylinder.radius))

    @property
    def longest_texel(self) -> float:
        """Return the longer side of a texel on the face itself, where depth is 0, metres."""
        return max(self.texel_size)

    @cached_property
    def rays(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the rays through the texels' centres: origins on the face, metres, and unit directions inward.

        Both are (H, W, 3) float32, object frame.
        """
        return self.rays_at(texel_centres(self.width), texel_centres(self.height)[:, None])

    def rays_at(self, u: Array, v: Array) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the rays along which depth is measured.

        Depth d at (u, v) stands for the point origin + d · direction. On the side this is ((R − d) cos θ, y,
        (R − d) sin θ), where R is the cylinder's radius, θ = 2πu, and y is the height at v (Liu, Liu and Wu 2007,
        §3.1).

        Parameters
        ----------
        u, v
            (…) positions on the face from 0 to 1, broadcast against each other. u runs with θ on the side, with z on
            the right and left box faces, else with x; v runs with z on the caps, else with y.

        Returns
        -------
        origin
            (…, 3) float32, points on the face, metres, object frame.
        direction
            (…, 3) float32, unit vectors inward, object frame.
        """
        cylinder = self.cylinder
        origin = np.empty((*np.broadcast_shapes(u.shape, v.shape), 3), np.float32)
        direction = np.zeros_like(origin)
        if self.face is Face.SIDE:
            theta = 2 * np.pi * u
            direction[..., 0], direction[..., 2] = -np.cos(theta), -np.sin(theta)
            origin[...] = -cylinder.radius * direction
            origin[..., 1] = cylinder.bottom + v * cylinder.height
            return origin, direction
        low, size = cylinder.box
        inward, sign = INWARD[self.face]
        across, up = plane_axes(self.face)
        origin[..., across] = low[across] + u * size[across]
        origin[..., up] = low[up] + v * size[up]
        origin[..., inward] = low[inward] if sign > 0 else low[inward] + size[inward]
        direction[..., inward] = sign
        return origin, direction

    def points(self, depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the points (H, W, 3), object frame, metres, of an image's `depth` (H, W), metres from the face inward.

        Empty texels, of depth +inf, give NaN or infinite points.
        """
        origin, direction = self.rays
        with np.errstate(invalid="ignore"):
            return origin + depth[..., None] * direction

    def points_at(self, u: Array, v: Array, depth: Array) -> NDArray[np.float32]:
        """Return the points at given positions and depths.

        Parameters
        ----------
        u, v
            Positions (…) on the face in [0, 1], broadcast against each other.
        depth
            (…) metres from the face inward.

        Returns
        -------
        numpy.ndarray
            (…, 3) float32, metres, object frame.
        """
        origin, direction = self.rays_at(u, v)
        return origin + depth[..., None] * direction

    def border_points(
        self, images: Sequence[DepthImage], border: BoundaryStrip
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the vertices of a boundary strip.

        Parameters
        ----------
        images
            The depth images of all layers of the face, in order.
        border
            A boundary strip of this face.

        Returns
        -------
        points
            (b, 3) float32, metres, object frame.
        depths
            (b,) float32, metres from the face inward.
        """
        row, column = np.divmod(border.start % (self.height * self.width), self.width)
        u = (column + 0.5 + border.offset[:, 0]) / self.width
        v = (row + 0.5 + border.offset[:, 1]) / self.height
        depth = np.concatenate([image.depth.ravel() for image in images])[border.start] + border.rise
        return self.points_at(u, v, depth).astype(np.float32), depth.astype(np.float32)

    def position_of(self, point: Array) -> tuple[Array, Array]:
        """Return u and v, (n,) each, of the rays that pass through `point` (n, 3), metres, object frame.

        Both are in [0, 1] where the point projects onto the face. On the side two rays pass through a point; this is
        the one that reaches it before the axis.
        """
        if self.face is Face.SIDE:
            theta = np.arctan2(point[:, 2], point[:, 0])
            return theta / (2 * np.pi) % 1.0, (point[:, 1] - self.cylinder.bottom) / self.cylinder.height
        low, size = self.cylinder.box
        across, up = plane_axes(self.face)
        return (point[:, across] - low[across]) / size[across], (point[:, up] - low[up]) / size[up]

    def texel_at(self, u: Array, v: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return row and column, (…) each, of the texels nearest to positions `u`, `v` (…) in [0, 1] on the face.

        Positions outside the face give the nearest texel on its edge.
        """
        row = np.clip((v * self.height).astype(int), 0, self.height - 1)
        return row, np.clip((u * self.width).astype(int), 0, self.width - 1)

    def project(self, point: Array) -> Projection:
        """Return the projections of `point` (n, 3), metres, object frame, onto the face."""
        u, v = self.position_of(point)
        origin, direction = self.rays_at(u, v)
        return Projection(point=point, u=u, v=v, origin=origin, direction=direction)


def texel_centres(count: int) -> NDArray[np.float64]:
    """Return the centres, (count,) float64, of `count` texels that divide [0, 1] evenly."""
    return (np.arange(count) + 0.5) / count


def square_texel(baked: BakedObject) -> float:
    """Return the edge, metres, of a square with the area of a texel of the side image of `baked`.

    Without a side image, the first image is used.
    """
    image = next((image for image in baked.images if image.face is Face.SIDE), baked.images[0])
    width, height = FaceGrid.of(baked.cylinder, image).texel_size
    return float(np.sqrt(width * height))
