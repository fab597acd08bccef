"""Sample a mesh as the paper does (Liu, Liu and Wu 2007, §3.1): from six planar depth images of its box, warped.

The box is the one around the cylinder, so its top and bottom images are the caps themselves. The GPU draws each view as
a picture of triangle numbers; the exact point, normal and colour at each texel's centre are then computed from the
triangle, as for a ray's hit. The views' texels, connected to triangles, are then drawn into the side image.
"""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.boundary_strip import Samples
from depthwalk.bake.face_grid import FaceGrid, texel_centres
from depthwalk.bake.images import Cylinder, Face
from depthwalk.bake.normal_maps import NormalMaps, footprint_area
from depthwalk.bake.raycast import Hits, facing_normals
from depthwalk.bake.samples import FaceSamples, face_samples
from depthwalk.gpu.device import Scope
from depthwalk.gpu.failures import GpuError
from depthwalk.gpu.headless_device import headless_device
from depthwalk.gpu.program import Program
from depthwalk.gpu.state import LESS
from depthwalk.ingest.mesh import Mesh

# A triangle between texels of a view lies on the surface if it is not seen edge-on and its normal agrees with those at
# its corners: a rubber sheet across a jump of two texels is 63° off. Any surface is within 55° of one of the six views.
_LEAST_COSINE = 0.17  # between triangle and view: 80°
_LEAST_AGREEMENT = 0.5  # between triangle and normals: 60°
_WIDEST = 0.25  # turns: a wider triangle contains or touches the axis and has no meaning in the side image
# Texels. The views' rows lie on those of the side image, where a triangle may or may not cover its first and last row.
# It is drawn twice, slightly lower and slightly higher, to cover both.
_NUDGE = 1 / 64
_CHANNELS = (3, 4, 8, 11)  # end of normal, depth, albedo and facing in a side texel; then front (±1, 0 where empty)


@dataclass(frozen=True, kw_only=True)
class _View:
    """Describe an orthographic camera on a side of the box around the cylinder.

    Texel (u, v) in [0, 1]² looks from origin + u · across + v · up along the unit vector `inward`, up to `max_depth`
    metres. All vectors are (3,) float64, object frame, metres.
    """

    origin: NDArray[np.float64]
    across: NDArray[np.float64]
    up: NDArray[np.float64]
    inward: NDArray[np.float64]
    max_depth: float

    @property
    def clip_from_object(self) -> NDArray[np.float64]:
        """Return the matrix (4, 4) from the object's frame, metres, to clip space."""
        rows = np.stack([self.across / (self.across @ self.across), self.up / (self.up @ self.up),
                         self.inward / self.max_depth])  # fmt: skip
        matrix = np.eye(4)
        matrix[:3, :3] = 2 * rows
        matrix[:3, 3] = -2 * rows @ self.origin - 1
        return matrix

    @property
    def mirrored(self) -> bool:
        """Return whether u to the right and v upward show the object mirrored, as on a top cap."""
        return bool(np.cross(self.across, self.up) @ self.inward > 0)

    def ray_origins(self, size: int) -> NDArray[np.float64]:
        """Return the origins of the texels' rays, (size², 3)."""
        centres = texel_centres(size)[:, None]
        return (self.origin + centres[:, None] * self.up + centres * self.across).reshape(-1, 3)


@dataclass(frozen=True, kw_only=True)
class _ViewImage:
    """Hold what a view sees: its texels as samples, and their points (size², 3) float64, NaN where empty."""

    seen: FaceSamples
    points: NDArray[np.float64]


def sample_six_views(mesh: Mesh, cylinder: Cylinder, size: int) -> dict[Face, FaceSamples]:
    """Sample side and caps of a cylinder by six orthographic views of the box around it (Liu, Liu and Wu 2007, §3.1).

    Parameters
    ----------
    mesh
        The mesh, object frame, metres.
    cylinder
        The cylinder that encloses the mesh, object frame, metres.
    size
        Side of every image, texels.

    Returns
    -------
    dict
        The samples of side, top and bottom by face, one layer each. The side lacks surfaces that no view sees.

    Raises
    ------
    GpuError
        If no OpenGL 3.3 context can be created.
    """
    # In a separate thread, so that a window's context that is current in this one stays current.
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(_sample, mesh, cylinder, size).result()


def _sample(mesh: Mesh, cylinder: Cylinder, size: int) -> dict[Face, FaceSamples]:
    try:
        device = headless_device()
    except GpuError as error:
        raise GpuError(f"method six-view draws with OpenGL, method raycast does not: {error}") from error
    try:
        with device.context, ExitStack() as objects:
            scope = device.scope("six-view")
            objects.callback(scope.release)
            return _sample_on(scope, mesh, cylinder, size)
    finally:
        device.context.release()


def _sample_on(scope: Scope, mesh: Mesh, cylinder: Cylinder, size: int) -> dict[Face, FaceSamples]:
    camera = _ViewCamera(scope, mesh, size)
    grid, maps = FaceGrid(cylinder=cylinder, face=Face.SIDE, height=size, width=size), NormalMaps.of(mesh)
    side = _SideImage(scope, grid)
    mapped_side = None if maps is None else _SideImage(scope, grid)
    found: dict[Face, FaceSamples] = {}
    for face, view in _views(cylinder):
        image = _see(mesh, view, camera.draw(view), size, maps)
        triangles = _connected(image, view, size)
        side.add(image, triangles)
        if mapped_side is not None and (mapped := image.seen.mapped_normal) is not None:
            mapped_side.add(replace(image, seen=replace(image.seen, normal=mapped)), triangles)
        if face is not Face.SIDE:
            found[face] = image.seen
    mapped_normal = None if mapped_side is None else mapped_side.read().normal
    found[Face.SIDE] = replace(side.read(), mapped_normal=mapped_normal)
    return {face: found[face] for face in sorted(found)}


def _views(cylinder: Cylinder) -> Iterator[tuple[Face, _View]]:
    """Yield the six sides of the box around the cylinder, each with the face that it contributes to."""
    radius, height = cylinder.radius, cylinder.height
    x, y, z = np.eye(3)
    for outward in (x, z, -x, -z):
        across = np.cross(y, outward)
        origin = radius * (outward - across) + cylinder.bottom * y
        yield (
            Face.SIDE,
            _View(origin=origin, across=2 * radius * across, up=height * y, inward=-outward, max_depth=2 * radius),
        )
    for face, level, inward in ((Face.TOP, cylinder.top, -y), (Face.BOTTOM, cylinder.bottom, y)):
        corner = np.array([-radius, level, -radius])
        yield face, _View(origin=corner, across=2 * radius * x, up=2 * radius * z, inward=inward, max_depth=height)


class _ViewCamera:
    """Draw the mesh as a picture of face numbers."""

    def __init__(self, scope: Scope, mesh: Mesh, size: int) -> None:
        self._scope = scope
        self._target = scope.framebuffer([scope.texture((size, size), 2, "f4")], scope.depth_texture((size, size)))
        self._program = Program(scope, "six_view/faces.vert", "six_view/faces.frag")
        vertices = scope.buffer(np.ascontiguousarray(mesh.positions, np.float32))
        indices = scope.buffer(np.ascontiguousarray(mesh.faces, np.uint32))
        self._array = scope.vertex_array(self._program.gl, [(vertices, "3f", "in_position")], index_buffer=indices)

    def draw(self, view: _View) -> NDArray[np.int64]:
        """Return the face (size²,) that each texel sees, −1 for none; rows from v = 0 up."""
        self._target.clear(-1.0, -1.0)
        self._program.set(clip_from_object=view.clip_from_object.T.astype(np.float32).tobytes())
        with self._scope.state(into=self._target, depth_test=LESS):
            self._array.render()
        high, low = np.frombuffer(self._target.read(components=2, dtype="f4"), np.float32).reshape(-1, 2).T
        return np.where(high < 0, -1, high.astype(np.int64) << 16 | low.astype(np.int64))


def _see(mesh: Mesh, view: _View, face: NDArray[np.int64], size: int, maps: NormalMaps | None) -> _ViewImage:
    """Compute what lies on the rays through the texels' centres.

    face: (size²,), the triangle that each ray hits, as the camera drew it; maps: the mesh's normal maps.
    """
    solid = np.flatnonzero(face >= 0)
    corners = mesh.positions[mesh.faces[face[solid]]].astype(np.float64)
    origin = view.ray_origins(size)
    flat = corners - origin[solid, None]
    plane = np.stack([flat @ view.across, flat @ view.up], -1)  # (n, 3, 2): the ray is at 0
    # Weight of a corner: the area that the ray and the other two corners span.
    areas = np.stack([_cross(plane[:, (k + 1) % 3], plane[:, (k + 2) % 3]) for k in range(3)], -1)
    # Rasterisation snaps corners, so a centre may be slightly outside; a face seen edge-on would extrapolate wildly.
    areas = np.maximum(areas * np.sign(areas.sum(1, keepdims=True)), 0) + 1e-300
    weights = areas / areas.sum(1, keepdims=True)
    distance = np.einsum("nk,nkc,c->n", weights, flat, view.inward)
    across_face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).astype(np.float32)
    normal, flipped = facing_normals(across_face, np.broadcast_to(view.inward.astype(np.float32), across_face.shape))

    hits = Hits(
        distance=_spread(distance, solid, size, np.inf),
        face=face[None].astype(np.int32),
        u=_spread(weights[:, 1], solid, size, 0),
        v=_spread(weights[:, 2], solid, size, 0),
        normal=_spread(normal, solid, size, 0),
        flipped=_spread(flipped, solid, size, False),
    )
    points = np.full((size * size, 3), np.nan)
    points[solid] = origin[solid] + distance[:, None] * view.inward
    texel = float(np.linalg.norm(view.across) * np.linalg.norm(view.up)) / size**2
    area = footprint_area(texel, hits.normal, view.inward) if maps else None
    return _ViewImage(seen=face_samples(mesh, hits, (size, size), normal_maps=maps, area=area), points=points)


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _spread(values: NDArray[Any], where: NDArray[np.intp], size: int, empty: float) -> NDArray[Any]:
    """Return values (n, …) at texels (n,) as one single-precision layer (1, size², …) that is `empty` elsewhere."""
    dtype = np.bool_ if values.dtype == np.bool_ else np.float32
    layer = np.full((1, size * size, *values.shape[1:]), empty, dtype)
    layer[0, where] = values
    return layer


def _connected(image: _ViewImage, view: _View, size: int) -> NDArray[np.uint32]:
    """Return triangles (t, 3) of neighbouring texels on the surface, counter-clockwise seen from the view."""
    number = np.arange(size * size, dtype=np.uint32).reshape(size, size)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([b, d, c], -1)])
    triangles = triangles[np.isfinite(image.points[:, 0])[triangles].all(1)]
    if view.mirrored:
        triangles = triangles[:, ::-1]
    points = image.points[triangles]
    normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    frontal = normal @ view.inward < -_LEAST_COSINE
    agreeing = np.einsum("nc,nkc->nk", normal, image.seen.normal.reshape(-1, 3)[triangles]) > _LEAST_AGREEMENT
    return np.ascontiguousarray(triangles[frontal & agreeing.all(1)])


class _SideImage:
    """Draw the views' triangles into the side image; the nearest at each texel remains."""

    def __init__(self, scope: Scope, grid: FaceGrid) -> None:
        self._scope, self._grid = scope, grid
        self._context = scope.device.context
        size = grid.width, grid.height
        colours = [scope.texture(size, 4, "f4") for _ in range(3)]
        self._target = scope.framebuffer(colours, scope.depth_texture(size))
        self._target.clear()
        self._program = Program(scope, "six_view/side.vert", "six_view/side.frag")
        self._program.set(far_depth=grid.max_depth)

    def add(self, image: _ViewImage, triangles: NDArray[np.uint32]) -> None:
        """Draw triangles (t, 3) between the texels of a view: where rays see them before the axis, and past it."""
        seen = image.seen
        front = np.where(seen.samples.flipped, np.float32(-1), np.float32(1))[..., None]
        attributes = self._scope.buffer(np.concatenate([seen.normal, seen.albedo, seen.samples.facing, front], -1))
        for past_axis in (False, True):
            place = self._places(image.points, past_axis)
            u = place[triangles.T, 0]  # (3, t)
            wraps = np.ptp(u, axis=0) > 0.5
            narrow = np.ptp(np.where(wraps & (u < 0.5), u + 1, u), axis=0) < _WIDEST
            # Outward-facing triangles run clockwise in the image: seen from outside, θ grows to the left. The others
            # are culled, in an open mesh as well: the other side of a surface belongs to the view that sees it.
            self._context.front_face = "ccw" if past_axis else "cw"
            places = self._scope.buffer(place)
            self._draw(places, attributes, triangles[narrow & ~wraps], wraps=False, shifts=(0.0,))
            self._draw(places, attributes, triangles[narrow & wraps], wraps=True, shifts=(0.0, -1.0))
            self._scope.free(places)
        self._scope.free(attributes)

    def read(self) -> FaceSamples:
        """Return the image, with gaps a texel wide closed."""
        channels = [self._target.read(components=4, attachment=k, dtype="f4") for k in range(3)]
        texels = np.concatenate([np.frombuffer(c, np.float32).reshape(*self._grid.shape, 4) for c in channels], -1)
        _close_gaps(texels, 2 * self._grid.longest_texel)
        normal, depth, albedo, facing, front = np.split(texels[None], _CHANNELS, -1)
        solid = front[..., 0] != 0
        samples = Samples(
            depth=np.where(solid, depth[..., 0], np.float32(np.inf)),
            facing=facing.copy(),
            flipped=front[..., 0] < 0,
        )
        return FaceSamples(samples=samples, normal=normal.copy(), albedo=albedo.copy())

    def _places(self, points: NDArray[np.float64], past_axis: bool) -> NDArray[np.float32]:
        """Return u, v and depth (n, 3) of points (n, 3), on the ray that meets them before or past the axis."""
        cylinder = self._grid.cylinder
        x, y, z = points.T
        v = (y - cylinder.bottom) / cylinder.height
        u = (np.arctan2(z, x) / (2 * np.pi) + 0.5 * past_axis) % 1.0
        distance = np.hypot(x, z) * (1 if past_axis else -1)
        return np.stack([u, v, cylinder.radius + distance], -1).astype(np.float32)

    def _draw(
        self,
        places: moderngl.Buffer,
        attributes: moderngl.Buffer,
        triangles: NDArray[np.uint32],
        wraps: bool,
        shifts: tuple[float, ...],
    ) -> None:
        if not len(triangles):
            return
        indices = self._scope.buffer(np.ascontiguousarray(triangles))
        content = [(places, "3f", "in_place"), (attributes, "3f 4f 4f", "in_normal", "in_albedo", "in_facing")]
        array = self._scope.vertex_array(self._program.gl, content, index_buffer=indices)
        with self._scope.state(into=self._target, depth_test=LESS, cull=True):
            for shift, nudge in product(shifts, (-_NUDGE, _NUDGE)):
                self._program.set(wraps=wraps, shift=(shift, nudge / self._grid.height))
                array.render()
        self._scope.free(array, indices)


def _close_gaps(texels: NDArray[np.float32], deepest: float) -> None:
    """Fill each empty texel between two filled ones, whose depths differ by at most `deepest` metres, with their mean.

    Where two views meet at an edge of the object, each ends up to half a texel before it. texels: (H, W, 12), with
    columns that wrap.
    """
    for axis in (1, 0):
        before, after = np.roll(texels, 1, axis), np.roll(texels, -1, axis)
        gap = (before[..., -1] != 0) & (after[..., -1] != 0) & (texels[..., -1] == 0)
        gap &= np.abs(before[..., 3] - after[..., 3]) <= deepest
        if axis == 0:
            gap[[0, -1]] = False
        filled = (before[gap] + after[gap]) / 2
        for vector in (filled[:, :3], filled[:, 8:11]):
            vector /= np.maximum(np.linalg.norm(vector, axis=1, keepdims=True), 1e-12)
        filled[:, -1] = before[gap, -1]
        texels[gap] = filled
