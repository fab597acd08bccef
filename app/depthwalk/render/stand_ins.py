"""Meshes in the stead of depth images: near by, polygons have detail that images would only magnify."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject, square_texel
from depthwalk.render.bounds import outside
from depthwalk.render.mesh_lod import MeshLevels, mesh_level
from depthwalk.render.planes import viewer_in_object
from depthwalk.render.rotation import conjugate, multiply, rotate
from depthwalk.render.view import View
from depthwalk.scene.arrays import Objects, Representation

Array = NDArray[np.floating]
Rows = NDArray[np.integer]
HasCome = Callable[[Rows], NDArray[np.bool_]]  # meshes (n,), nearest first, to which of them (n,) may be drawn

# With so many a walk through the garden takes two cores as long as with images alone; with any number, half as long
# again.
_TRIANGLES_PER_PIXEL = 2


@dataclass(frozen=True)
class StandIns:
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
    girth: Array
    span: Array

    @classmethod
    def empty(cls, count: int) -> "StandIns":
        """For `count` numbers, none of which has one."""
        none, zero = np.full(count, -1), np.zeros(count)
        turn = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))
        return cls(none, none.copy(), np.zeros((count, 3)), turn, zero, np.zeros((count, 3)), *np.zeros((3, count)))

    def add(self, mesh: int, numbers: range, objects: list[BakedObject]) -> None:
        """Mesh `mesh` may stand in for all the depth objects `objects`, which have these `numbers`."""
        corners = np.concatenate([_corners(each) for each in objects])
        low, high = corners.min(0), corners.max(0)
        centre = (low + high) / 2
        among = slice(numbers.start, numbers.stop)
        self.mesh[among], self.part[among] = mesh, np.arange(len(objects))
        self.texel[among] = max(map(square_texel, objects))
        self.centre[among], self.half_height[among] = centre, (high - low)[1] / 2
        self.girth[among] = np.hypot(*(corners - centre).T[[0, 2]]).max()
        for number, each in zip(numbers, objects, strict=True):
            self.offset[number], self.turn[number] = each.position, each.rotation
            self.span[number] = np.linalg.norm(corners - self.offset[number], axis=1).max()

    def near_by(
        self,
        view: View,
        objects: Objects,
        rows: Rows,
        limit: float,
        has_come: HasCome,
        levels: MeshLevels,
        error: float,
    ) -> NDArray[np.bool_]:
        """Whether (m,) a texel of the objects `rows` (m,) of all `objects`, nearest first, may cover more than `limit`
        pixels, and a mesh that `has_come` may stand in for it and has few triangles for its pixels. error: in pixels,
        see `mesh_level`. Never, where `limit` is 0. All that show one asset in one place agree."""
        found = np.zeros(len(rows), bool)
        near = self._close(view, objects, rows, limit)  # of few it is asked in earnest
        if not len(near):
            return found
        number = objects.asset[rows[near]]
        meshes = self.placed(objects, rows[near] - self.part[number])
        viewer = viewer_in_object(view, meshes.position, meshes.rotation, meshes.scale)
        nearest = outside(viewer, self.centre[number], self.half_height[number], self.girth[number])
        magnified = nearest * limit < view.focal_pixels * self.texel[number]
        magnified[magnified] = has_come(meshes.asset[magnified])
        level = mesh_level(view, meshes, nearest, levels.error, error)
        area, middle = 4 * self.girth[number] * self.half_height[number], nearest + self.girth[number]
        pixels = np.minimum(area * (view.focal_pixels / middle) ** 2, view.size[0] * view.size[1])
        found[near] = magnified & (levels.triangles[meshes.asset, level] <= _TRIANGLES_PER_PIXEL * pixels)
        return found

    def _close(self, view: View, objects: Objects, rows: Rows, limit: float) -> Rows:
        """Which (k,) of the objects `rows` (m,) a mesh may stand in for and are not too far off at first sight."""
        asset = objects.asset[rows]
        some = np.flatnonzero(self.mesh[asset] >= 0) if limit else np.zeros(0, np.intp)
        reach = view.focal_pixels / max(limit, 1e-9) * self.texel[asset[some]] + self.span[asset[some]]
        away = np.linalg.norm(objects.position[rows[some]] - view.position, axis=1)
        return some[away < reach * objects.scale[rows[some]]]

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
        return Objects(self.mesh[some.asset].astype(np.int32), position.astype(np.float32), rotation, some.scale, kind)


def _corners(baked: BakedObject) -> NDArray[np.float64]:
    """Those (8, 3) of the box about a depth object, asset frame."""
    c = baked.cylinder
    signs = np.stack(np.meshgrid([-1, 1], [0, 1], [-1, 1], indexing="ij"), -1).reshape(8, 3)
    size = [min(c.half_width, c.radius), c.height, min(c.half_depth, c.radius)]
    box = signs * size + [0, c.bottom, 0]
    return np.asarray(baked.position, np.float64) + rotate(np.asarray(baked.rotation, np.float64), box)
