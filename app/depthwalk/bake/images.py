"""Depth images and the object they make up: plain arrays, in the frame of docs/conventions.md.

Object frame: the cylinder's axis is +Y through the origin, metres. Row 0 of every image is at the bottom
(smallest y, or smallest z for the caps). Empty texels have depth +inf.
"""

from dataclasses import astuple, dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.meso import Meso


class Face(IntEnum):
    """Which surface an image lies on. The order is that of the images.

    The paper has the cylinder's side and its caps. What faces along θ (a finger, the flank of a leg, a flat figure) is
    seen well by none of them; the flanks, sides of the box around the cylinder, look at it squarely.
    """

    TOP = 0
    SIDE = 1
    BOTTOM = 2
    FRONT = 3  # from +z
    BACK = 4
    RIGHT = 5  # from +x
    LEFT = 6


FACE_COUNT = len(Face)
PAPER_FACES = Face.TOP, Face.SIDE, Face.BOTTOM
FLANKS = Face.FRONT, Face.BACK, Face.RIGHT, Face.LEFT
_INWARD = {  # what planar faces look along: axis and sign
    Face.TOP: (1, -1),
    Face.BOTTOM: (1, 1),
    Face.FRONT: (2, -1),
    Face.BACK: (2, 1),
    Face.RIGHT: (0, -1),
    Face.LEFT: (0, 1),
}


@dataclass(frozen=True)
class Cylinder:
    """The volume that the images enclose.

    radius: R; bottom, top: y0 < y1. half_width, half_depth: caps and flanks cover |x| ≤ half_width, |z| ≤ half_depth;
    both equal R for a cylinder and differ only for a single planar image, which is a top cap alone.
    """

    radius: float
    bottom: float
    top: float
    half_width: float
    half_depth: float

    @property
    def height(self) -> float:
        return self.top - self.bottom

    @property
    def box(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Least corner (3,) and size (3,) of the box around it."""
        low = np.array([-self.half_width, self.bottom, -self.half_depth], np.float32)
        return low, np.array([2 * self.half_width, self.height, 2 * self.half_depth], np.float32)


def enclosing_cylinder(points: NDArray[np.floating]) -> Cylinder:
    """The smallest cylinder about +Y that holds points (n, 3), widened by 1e-4 so that no ray starts on the surface,
    however flat they are."""
    radius = float(np.hypot(points[:, 0], points[:, 2]).max()) * 1.0001
    bottom, top = float(points[:, 1].min()), float(points[:, 1].max())
    slack = 1e-4 * max(radius, top - bottom)
    radius = max(radius, slack)
    return Cylinder(radius, bottom - slack, top + slack, radius, radius)


def with_margins(cylinder: Cylinder, rows: int) -> Cylinder:
    """`cylinder`, higher by a texel of images of `rows` at either end: no cell lies beyond the centres of their first
    and last row, so upright walls would end half a texel early. In single precision, as files hold it."""
    margin = cylinder.height / (rows - 2)
    higher = replace(cylinder, bottom=cylinder.bottom - margin, top=cylinder.top + margin)
    return Cylinder(*(float(np.float32(value)) for value in astuple(higher)))


@dataclass(frozen=True)
class DepthImage:
    """One layer of one face.

    depth:  (H, W) float32, metres inward from the face, +inf where empty.
    normal: (H, W, 3) float32, unit, object frame; zero where empty.
    albedo: (H, W, 4) float32, linear RGB and specular strength; zero where empty.
    cells:  one (cells,) uint16 array per level, the grid of step 2^level in the order of `grid_cells`. Bits 0–6 are the
            lower, bits 7–13 the upper triangle whose first corner is on this layer: bit 0 says that it lies on the
            surface, bits 1–3 and 4–6 on which layers its second and third corner are. Bits 14 and 15 say that another
            face holds the lower and the upper triangle better, whoever owns their corners.
    owner:  (H, W) uint8, the Face that samples this surface best.
    """

    face: Face
    layer: int
    depth: NDArray[np.float32]
    normal: NDArray[np.float32]
    albedo: NDArray[np.float32]
    cells: tuple[NDArray[np.uint16], ...]
    owner: NDArray[np.uint8]

    @property
    def name(self) -> str:
        return f"{self.face.name.lower()}.{self.layer}"


@dataclass(frozen=True)
class Border:
    """What completes the grid of one face and level up to the edges of its surfaces.

    start:     (b,) int32, ascending: the sample (layer · H · W + texel) whose surface each border vertex ends.
    offset:    (b, 2) float16, from that sample, in texels along u and v.
    rise:      (b,) float16, depth less that sample's, metres.
    triangles: (t, 3) int32; numbers below L·H·W are samples, the rest border vertices. The first is a sample.
    """

    face: Face
    level: int
    start: NDArray[np.int32]
    offset: NDArray[np.float16]
    rise: NDArray[np.float16]
    triangles: NDArray[np.int32]


@dataclass(frozen=True)
class BakedObject:
    """Everything the renderer needs of one object.

    images: ordered by face, then layer. borders: of some faces and levels. shininess: Phong exponent. steps: number of
    grids, steps 1, 2, … 2^(steps−1). key: hex digest of what it was made from. position, rotation (quaternion
    x, y, z, w): the cylinder's place in the asset's frame; asset point = position + rotate(rotation, object point).
    meso: relief that is laid over the images when they are drawn; baking and files know nothing of it.
    """

    cylinder: Cylinder
    images: tuple[DepthImage, ...]
    borders: tuple[Border, ...]
    shininess: float
    steps: int
    key: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    meso: Meso | None = None


def texel_centres(count: int) -> NDArray[np.float64]:
    """Centres (count,) of `count` texels over [0, 1]."""
    return (np.arange(count) + 0.5) / count


def surface_rays(
    cylinder: Cylinder, face: Face, u: NDArray[np.floating], v: NDArray[np.floating]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Where depth is measured from and along: origins (…, 3) on the face and unit directions (…, 3) inward.

    u, v: (…) in [0, 1], broadcast against each other; u runs with θ, x or (right, left) z, v with y or (caps) z. Depth
    d is the point origin + d · direction (B = ((R−d)cosθ, y, (R−d)sinθ) for the side).
    """
    origin = np.empty((*np.broadcast_shapes(u.shape, v.shape), 3), np.float32)
    direction = np.zeros_like(origin)
    if face is Face.SIDE:
        theta = 2 * np.pi * u
        direction[..., 0], direction[..., 2] = -np.cos(theta), -np.sin(theta)
        origin[...] = -cylinder.radius * direction
        origin[..., 1] = cylinder.bottom + v * cylinder.height
        return origin, direction
    low, size = cylinder.box
    inward, sign = _INWARD[face]
    across, up = plane_axes(face)
    origin[..., across] = low[across] + u * size[across]
    origin[..., up] = low[up] + v * size[up]
    origin[..., inward] = low[inward] if sign > 0 else low[inward] + size[inward]
    direction[..., inward] = sign
    return origin, direction


def face_outward(face: Face) -> NDArray[np.float64]:
    """What a planar face's images are seen from: the unit vector (3,) against the direction of depth."""
    axis, sign = _INWARD[face]
    return -sign * np.eye(3)[axis]


def plane_axes(face: Face) -> tuple[int, int]:
    """The axes (0, 1, 2 for x, y, z) that u and v of a planar face run along."""
    inward, _ = _INWARD[face]
    return (2 if inward == 0 else 0), (2 if inward == 1 else 1)


def image_position(
    cylinder: Cylinder, face: Face, point: NDArray[np.floating]
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """u and v (n,) in [0, 1] of points (n, 3) on this side of the axis."""
    if face is Face.SIDE:
        theta = np.arctan2(point[:, 2], point[:, 0])
        return theta / (2 * np.pi) % 1.0, (point[:, 1] - cylinder.bottom) / cylinder.height
    low, size = cylinder.box
    across, up = plane_axes(face)
    return (point[:, across] - low[across]) / size[across], (point[:, up] - low[up]) / size[up]


def face_reach(cylinder: Cylinder, face: Face) -> float:
    """The greatest depth that a face measures, metres."""
    return 2 * cylinder.radius if face is Face.SIDE else float(cylinder.box[1][_INWARD[face][0]])


def image_points(cylinder: Cylinder, image: DepthImage) -> NDArray[np.float32]:
    """The 3-D point (H, W, 3) of every texel, object frame; NaN or infinite where empty."""
    height, width = image.depth.shape
    origin, direction = surface_rays(cylinder, image.face, texel_centres(width), texel_centres(height)[:, None])
    with np.errstate(invalid="ignore"):
        return origin + image.depth[..., None] * direction


def border_points(
    cylinder: Cylinder, images: list[DepthImage], border: Border
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The 3-D points (b, 3), object frame, and depths (b,) of a border's vertices; images: the layers of its face."""
    height, width = images[0].depth.shape
    row, column = np.divmod(border.start % (height * width), width)
    u = (column + 0.5 + border.offset[:, 0]) / width
    v = (row + 0.5 + border.offset[:, 1]) / height
    depth = np.concatenate([image.depth.ravel() for image in images])[border.start] + border.rise
    origin, direction = surface_rays(cylinder, border.face, u, v)
    return (origin + depth[:, None] * direction).astype(np.float32), depth.astype(np.float32)


def texel_size(cylinder: Cylinder, face: Face, shape: tuple[int, int]) -> tuple[float, float]:
    """Width and height of a texel in metres, on the face itself; shape is (H, W)."""
    height, width = shape
    if face is Face.SIDE:
        return 2 * np.pi * cylinder.radius / width, cylinder.height / height
    _, size = cylinder.box
    across, up = plane_axes(face)
    return float(size[across]) / width, float(size[up]) / height


def square_texel(baked: BakedObject) -> float:
    """The side of a square texel, metres: on the side image, or on the one there is."""
    image = next((image for image in baked.images if image.face is Face.SIDE), baked.images[0])
    width, height = texel_size(baked.cylinder, image.face, (image.depth.shape[0], image.depth.shape[1]))
    return float(np.sqrt(width * height))
