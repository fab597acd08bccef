"""Meshes in the stead of depth images: near by, polygons have detail that images would only magnify."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import square_texel
from depthwalk.bake.images import BakedObject
from depthwalk.geometry.quaternions import conjugate, multiply, rotate
from depthwalk.render.lod.mesh_lod import MeshLevels
from depthwalk.render.lod.selection import error_level
from depthwalk.render.view.bounds import outside
from depthwalk.render.view.view import View, viewer_in_object
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.types import Array, Rows

IsResident = Callable[
    [Rows], NDArray[np.bool_]
]  # meshes (n,), those first read first, to which of them (n,) may be drawn

# With so many a walk through the garden takes two cores as long as with images alone; with any number, half as long
# again.
_TRIANGLES_PER_PIXEL = 2


@dataclass(frozen=True, kw_only=True)
class MeshFallbackRule:
    """When meshes stand in: where a texel may cover more than `magnification` pixels, never where that is 0; those that
    have come, drawn as coarsely as `error`, in pixels, allows (see `mesh_level`)."""

    magnification: float
    is_resident: IsResident
    error: float


@dataclass(kw_only=True)
class MeshFallbacks:
    """Which mesh may stand in for each depth object; arrays (a,) over the numbers of `AssetStore`.

    mesh: number of the mesh that shows the same asset, -1 where none may; part: which of the asset's depth objects it
    is; offset (a, 3), turn (a, 4): where it is placed in the asset's frame; texel: metres, the coarsest of them; centre
    (a, 3), half_height, girth: upright cylinder that holds the asset, asset frame; span: metres from the depth object's
    own origin to what of that is farthest.
    """

    mesh: NDArray[np.int64]
    part: NDArray[np.int64]
    offset: Array
    turn: Array
    texel: Array
    centre: Array
    half_height: Array
    cylinder_radius: Array
    span: Array

    @classmethod
    def empty(cls, count: int) -> "MeshFallbacks":
        """For `count` numbers, none of which has one."""
        return cls(
            mesh=np.full(count, -1),
            part=np.full(count, -1),
            offset=np.zeros((count, 3)),
            turn=np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
            texel=np.zeros(count),
            centre=np.zeros((count, 3)),
            half_height=np.zeros(count),
            cylinder_radius=np.zeros(count),
            span=np.zeros(count),
        )

    def add(self, mesh: int, numbers: range, objects: list[BakedObject]) -> None:
        """Mesh `mesh` may stand in for all the depth objects `objects`, which have these `numbers`."""
        corners = np.concatenate([_corners(each) for each in objects])
        low, high = corners.min(0), corners.max(0)
        centre = (low + high) / 2
        among = slice(numbers.start, numbers.stop)
        self.mesh[among], self.part[among] = mesh, np.arange(len(objects))
        self.texel[among] = max(map(square_texel, objects))
        self.centre[among], self.half_height[among] = centre, (high - low)[1] / 2
        self.cylinder_radius[among] = np.hypot(*(corners - centre).T[[0, 2]]).max()
        for number, each in zip(numbers, objects, strict=True):
            self.offset[number], self.turn[number] = each.position, each.rotation
            self.span[number] = np.linalg.norm(corners - self.offset[number], axis=1).max()

    def near_by(
        self, view: View, objects: Objects, rows: Rows, levels: MeshLevels, rule: MeshFallbackRule
    ) -> NDArray[np.bool_]:
        """For which (m,) of the objects `rows` (m,) of all `objects`, nearest first, a mesh stands in where `view` sees
        them. All that show one asset in one place agree."""
        found = np.zeros(len(rows), bool)
        near = self._close(view, objects, rows, rule.magnification)  # of few it is asked in earnest
        if not len(near):
            return found
        number = objects.asset[rows[near]]
        meshes = self.placed(objects, rows[near] - self.part[number])
        viewer = viewer_in_object(view, meshes.position, meshes.rotation, meshes.scale)
        nearest = outside(viewer, self.centre[number], self.half_height[number], self.cylinder_radius[number])
        metres = nearest / view.focal_pixels, (nearest + self.cylinder_radius[number]) / view.focal_pixels
        most = view.size[0] * view.size[1]
        found[near] = self.allowed(number, *metres, levels, rule, _TRIANGLES_PER_PIXEL, most)
        return found

    def allowed(
        self,
        number: Rows,
        nearest: Array,
        middle: Array,
        levels: MeshLevels,
        rule: MeshFallbackRule,
        triangles_per_pixel: float,
        most: float = np.inf,
    ) -> NDArray[np.bool_]:
        """For which (m,) of the depth objects `number` (m,) a mesh stands in, which has no more triangles than so many
        for each of its pixels. nearest, middle: what a pixel covers (m,), metres in the frames of the objects, where
        they are nearest and about their middle; most: pixels that any may cover."""
        coarse = (self.mesh[number] >= 0) & (nearest * rule.magnification < self.texel[number])
        some = np.flatnonzero(coarse) if rule.magnification else np.zeros(0, np.intp)
        some = some[rule.is_resident(self.mesh[number[some]])]
        number, mesh = number[some], self.mesh[number[some]]
        level = error_level(levels.error[mesh], rule.error * nearest[some])
        pixels = np.minimum(4 * self.cylinder_radius[number] * self.half_height[number] / middle[some] ** 2, most)
        found = np.zeros(len(coarse), bool)
        found[some] = levels.triangles[mesh, level] <= triangles_per_pixel * pixels
        return found

    def _close(self, view: View, objects: Objects, rows: Rows, limit: float) -> Rows:
        """Which (k,) of the objects `rows` (m,) a mesh may stand in for and are not too far off at first sight."""
        asset = objects.asset[rows]
        some = np.flatnonzero(self.mesh[asset] >= 0) if limit else np.zeros(0, np.intp)
        bounding_radius = view.focal_pixels / max(limit, 1e-9) * self.texel[asset[some]] + self.span[asset[some]]
        away = np.linalg.norm(objects.position[rows[some]] - view.position, axis=1)
        return some[away < bounding_radius * objects.scale[rows[some]]]

    def meshes(self, objects: Objects, rows: Rows) -> Objects:
        """The meshes (k,) that stand in for the objects `rows` (m,): each once, nearest first where those are."""
        first, order = np.unique(rows - self.part[objects.asset[rows]], return_index=True)
        return self.placed(objects, first[np.argsort(order)])

    def placed(self, objects: Objects, rows: Rows) -> Objects:
        """The meshes (k,) of the objects `rows` (k,), in the frames of their assets."""
        some = objects.take(rows)
        rotation = multiply(some.rotation, conjugate(self.turn[some.asset]).astype(np.float32))
        position = some.position - some.scale[:, None] * rotate(rotation, self.offset[some.asset])
        kind = np.full(len(rows), Representation.MESH_LOD, np.uint8)
        return Objects(
            asset=self.mesh[some.asset].astype(np.int32),
            position=position.astype(np.float32),
            rotation=rotation,
            scale=some.scale,
            representation=kind,
        )


def _corners(baked: BakedObject) -> NDArray[np.float64]:
    """Those (8, 3) of the box about a depth object, asset frame."""
    c = baked.cylinder
    signs = np.stack(np.meshgrid([-1, 1], [0, 1], [-1, 1], indexing="ij"), -1).reshape(8, 3)
    size = [min(c.half_width, c.radius), c.height, min(c.half_depth, c.radius)]
    box = signs * size + [0, c.bottom, 0]
    return np.asarray(baked.position, np.float64) + rotate(np.asarray(baked.rotation, np.float64), box)
