"""Define depth images and the object that they form: plain arrays, in the frame of docs/conventions.md.

Object frame: the cylinder's axis is +Y through the origin, metres. Row 0 of every image is at the bottom
(smallest y, or smallest z for the caps). Empty texels have depth +inf. `face_grid.FaceGrid` computes what follows from
a face's place on the cylinder: rays, points and texels.
"""

from dataclasses import asdict, dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.meso import Meso
from depthwalk.ingest.mesh import Reflection
from depthwalk.types import Array


class Face(IntEnum):
    """Name the surface that an image lies on; images are stored in this order.

    The paper (Liu, Liu and Wu 2007, §3.1) has the cylinder's side and its two caps. Surfaces that face along the circle
    around the axis (a finger, the side of a leg, a flat figure) are sampled badly by all three. So the baker adds the
    four upright faces of the box around the cylinder, which see such surfaces head-on: FRONT and BACK are seen from +z
    and −z, RIGHT and LEFT from +x and −x, object frame.
    """

    TOP = 0
    SIDE = 1
    BOTTOM = 2
    FRONT = 3  # from +z
    BACK = 4
    RIGHT = 5  # from +x
    LEFT = 6


FACE_COUNT = len(Face)
COORDINATE_STEPS = 1 << 16  # steps of a stored texture coordinate per repetition of the texture
HAS_COORDINATES = 1  # last bit of u
ONE_CHART = 1  # last bit of v
PAPER_FACES = Face.TOP, Face.SIDE, Face.BOTTOM
BOX_FACES = Face.FRONT, Face.BACK, Face.RIGHT, Face.LEFT
INWARD = {  # the direction of depth on the planar faces: axis (0, 1, 2 for x, y, z) and sign
    Face.TOP: (1, -1),
    Face.BOTTOM: (1, 1),
    Face.FRONT: (2, -1),
    Face.BACK: (2, 1),
    Face.RIGHT: (0, -1),
    Face.LEFT: (0, 1),
}


@dataclass(frozen=True, kw_only=True)
class Cylinder:
    """Describe the volume that the images enclose: an upright cylinder about +Y in the object frame.

    Attributes
    ----------
    radius
        Distance R of the side from the axis, metres.
    bottom, top
        Heights y0 < y1 of the two caps, metres.
    half_width, half_depth
        Caps and box faces cover |x| ≤ half_width and |z| ≤ half_depth, metres. Around a mesh both equal the radius;
        they differ only for a single planar image, whose object is a top cap alone.
    """

    radius: float
    bottom: float
    top: float
    half_width: float
    half_depth: float

    @property
    def height(self) -> float:
        """Return the distance between the caps, metres."""
        return self.top - self.bottom

    @property
    def box(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return lowest corner (3,) and size (3,) of the box around the cylinder, float32, metres, object frame."""
        low = np.array([-self.half_width, self.bottom, -self.half_depth], np.float32)
        return low, np.array([2 * self.half_width, self.height, 2 * self.half_depth], np.float32)


def enclosing_cylinder(points: Array) -> Cylinder:
    """Return the smallest cylinder about +Y that holds `points` (n, 3), object frame, metres.

    It is enlarged by 1e-4 of its extent, so that no ray starts on the surface, even if the points lie in a plane.
    """
    radius = float(np.hypot(points[:, 0], points[:, 2]).max()) * 1.0001
    bottom, top = float(points[:, 1].min()), float(points[:, 1].max())
    slack = 1e-4 * max(radius, top - bottom)
    radius = max(radius, slack)
    return Cylinder(radius=radius, bottom=bottom - slack, top=top + slack, half_width=radius, half_depth=radius)


def with_margins(cylinder: Cylinder, rows: int) -> Cylinder:
    """Return `cylinder` (object frame, metres) extended by one texel at either end, for images of `rows` rows.

    Grid cells extend from the centre of the first row of texels to that of the last. Without the margin, upright walls
    would end half a texel early. The numbers are rounded to single precision, as files store them.
    """
    margin = cylinder.height / (rows - 2)
    higher = replace(cylinder, bottom=cylinder.bottom - margin, top=cylinder.top + margin)
    return Cylinder(**{name: float(np.float32(value)) for name, value in asdict(higher).items()})


@dataclass(frozen=True, kw_only=True)
class DepthImage:
    """Hold one layer of one face: a depth, a normal and a colour for every texel.

    Attributes
    ----------
    face, layer
        The face that the image lies on, and the number of surfaces its rays hit before those of this layer (0 to 7).
    depth
        (H, W) float32, metres from the face inward, +inf where empty.
    normal
        (H, W, 3) float32, unit, object frame: the mesh's interpolated normals; zero where empty.
    albedo
        (H, W, 4) float32, linear RGB and specular strength; zero where empty.
    cells
        One (cells,) uint16 array per level, for the grid of step 2^level, in the order of `grid_cells`. Bits 0 to 6
        describe the lower triangle and bits 7 to 13 the upper one, if its first corner is on this layer: the first bit
        is set if the triangle lies on the surface, the next three and the last three hold the layers of its second and
        third corners. Bits 14 and 15 are set if another face holds the lower or the upper triangle better, whoever
        owns their corners.
    owner
        (H, W) uint8, the `Face` that samples this surface best.
    coordinates
        (H, W, 2) uint16, position of each texel in the object's texture: u and v modulo 1, in steps of 2^−16 except for
        their last bits. The last bit of u is set if the texel has coordinates; that of v, if they may be interpolated
        between this texel and those to its right, above it and both, since all four show one surface and one chart.
        None if the object has no texture.
    mapped_normal
        (H, W, 3) float32, likewise: `normal` turned by the mesh's normal maps, for shading; None if it has none.
    """

    face: Face
    layer: int
    depth: NDArray[np.float32]
    normal: NDArray[np.float32]
    albedo: NDArray[np.float32]
    cells: tuple[NDArray[np.uint16], ...]
    owner: NDArray[np.uint8]
    coordinates: NDArray[np.uint16] | None = None
    mapped_normal: NDArray[np.float32] | None = None

    @property
    def shading_normal(self) -> NDArray[np.float32]:
        """Return the normals (H, W, 3) to light the surface by: `mapped_normal` if there is one."""
        return self.normal if self.mapped_normal is None else self.mapped_normal

    @property
    def name(self) -> str:
        """Return the name of the image in files: `side.0`, `top.1`, …."""
        return f"{self.face.name.lower()}.{self.layer}"


@dataclass(frozen=True, kw_only=True)
class BoundaryStrip:
    """Hold the boundary strip of one face and level: it completes the grid up to the edges of its surfaces.

    Attributes
    ----------
    face, level
        The grid that the strip completes, of step 2^level.
    start
        (b,) int32, ascending: the sample (layer · H · W + texel) whose surface ends at each of the b boundary vertices.
    offset
        (b, 2) float16, from that sample to the vertex, in texels along u and v.
    rise
        (b,) float16, depth of the vertex minus depth of the sample, metres.
    triangles
        (t, 3) int32, corners: numbers below L · H · W are samples of the face's L layers, the rest are boundary
        vertices. The first of each row is a sample.
    """

    face: Face
    level: int
    start: NDArray[np.int32]
    offset: NDArray[np.float16]
    rise: NDArray[np.float16]
    triangles: NDArray[np.int32]


@dataclass(frozen=True, kw_only=True)
class BakedObject:
    """Hold the baked form of one object: all its depth images and what is needed to draw them.

    Attributes
    ----------
    cylinder
        The volume that the images enclose, object frame, metres.
    images
        All images, ordered by face, then layer, and all of one size.
    boundary_strips
        The boundary strips of some faces and levels.
    shininess
        Phong exponent; 0 for surfaces that are shown without light.
    steps
        Number of grids, of steps 1, 2, … 2^(steps − 1).
    key
        Hex digest of what the object was made from.
    position, rotation
        The cylinder's place in the asset's frame, metres and a unit quaternion (x, y, z, w): asset point = position +
        rotate(rotation, object point).
    texture
        (h, w, 3) uint8, sRGB, row 0 at v = 0, for the coordinates of the images; None if they have none.
    meso
        Relief laid over the images when they are drawn; None for none. It is not baked and not stored in files.
    mesh_triangles
        Triangles of the whole mesh that the asset was baked from, at least 1; None if it was not a mesh, or if an older
        file does not say.
    has_interior
        Whether the mesh encloses a space, such as a room, whose walls are missing from the images, see `bake.interior`;
        False also if an older file does not say.
    keeps_normals
        Whether drawing must not turn around normals that face away from the viewer, as those of normal maps may where a
        surface is seen at a grazing angle. Not set for meshes with cut-outs: leaves have two sides.
    reflection
        How surfaces reflect the sky; None: not at all. Where it is not too rough, the specular strength of each texel
        tells how metallic it is.
    tells_roughness
        Whether texels hold a code of roughness and metalness in the place of their specular strength, see
        `bake.reflection_code`.
    """

    cylinder: Cylinder
    images: tuple[DepthImage, ...]
    boundary_strips: tuple[BoundaryStrip, ...]
    shininess: float
    steps: int
    key: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    texture: NDArray[np.uint8] | None = None
    meso: Meso | None = None
    mesh_triangles: int | None = None
    has_interior: bool = False
    keeps_normals: bool = False
    reflection: Reflection | None = None
    tells_roughness: bool = False

    @property
    def is_unlit(self) -> bool:
        """Return whether its surfaces are shown without light."""
        return self.shininess == 0


def checked_reflection(roughness: object, metalness: object) -> Reflection | None:
    """Return the reflection that a file states; None if it states none. Raises ValueError if it cannot be valid."""
    if roughness is None and metalness is None:
        return None
    if isinstance(roughness, float) and isinstance(metalness, float) and 0 <= roughness <= 1 and 0 <= metalness <= 1:
        return Reflection(roughness, metalness)
    raise ValueError("its roughness or metalness is not a number from 0 to 1")


def checked_triangles(value: object) -> int | None:
    """Return `BakedObject.mesh_triangles` from a file's value. Raises ValueError if it cannot be valid."""
    if value is None or (isinstance(value, int) and value is not True and value > 0):
        return value
    raise ValueError(f"mesh_triangles is {value!r:.40}, not a whole number above 0")


def face_outward(face: Face) -> NDArray[np.float64]:
    """Return the outward unit vector (3,), object frame, of `face`, a cap or box face; depth increases against it."""
    axis, sign = INWARD[face]
    return np.asarray(-sign * np.eye(3)[axis])


def plane_axes(face: Face) -> tuple[int, int]:
    """Return the axes (0, 1, 2 for x, y, z) along which u and v run on `face`, a cap or box face."""
    inward, _ = INWARD[face]
    return (2 if inward == 0 else 0), (2 if inward == 1 else 1)
