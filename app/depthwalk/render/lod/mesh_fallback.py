"""Hold which meshes may replace which depth images, and how to place them; `fallback_rule` says when they may.

Meshes are fallbacks only in scenes that are drawn as their files say. Where one representation is asked for, only that
is drawn.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.face_grid import square_texel
from depthwalk.bake.images import BakedObject
from depthwalk.geometry.quaternions import conjugate, multiply, rotate
from depthwalk.render import kernels
from depthwalk.render.view.bounds import outside
from depthwalk.render.view.view import View, viewer_in_object
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.types import Array, Ints, Mask, Rows

_NO_MESHES = Objects(
    asset=np.zeros(0, np.int32),
    position=np.zeros((0, 3), np.float32),
    rotation=np.zeros((0, 4), np.float32),
    scale=np.zeros(0, np.float32),
    representation=np.zeros(0, np.uint8),
)


@dataclass(kw_only=True, eq=False)
class MeshFallbacks:
    """Hold which mesh may replace each depth object (see `CookedParts`, which gives `a` numbers).

    What describes the asset is stored by the number of its mesh, too.

    Attributes
    ----------
    mesh : (a,) number of the mesh that shows the same asset as the depth object; −1 where none does.
    triangles : (a,) of the mesh with each number, as stored with its depth images; +inf where it is not stored.
    part : (a,) which part of its asset each depth object shows.
    offset : (a, 3) position of each depth object in its asset's frame, metres.
    turn : (a, 4) rotation of each depth object in its asset's frame, unit quaternion (x, y, z, w).
    texel : (a,) edge of the coarsest texel of the asset's depth objects, metres.
    centre : (a, 3) middle of an upright cylinder that encloses the asset, asset frame, metres.
    half_height : (a,) half the height of that cylinder, metres.
    cylinder_radius : (a,) radius of that cylinder, metres.
    has_interior : (a,) whether depth images lack what a viewer within sees, see `BakedObject`.
    span : (a,) distance from the depth object's own origin to the farthest corner of the asset, metres.
    """

    mesh: Ints
    triangles: Array
    part: Ints
    offset: Array
    turn: Array
    texel: Array
    centre: Array
    half_height: Array
    cylinder_radius: Array
    has_interior: Mask
    span: Array

    @classmethod
    def empty(cls, count: int) -> "MeshFallbacks":
        """Return a table for `count` numbers of `CookedParts`, in which no depth object has a mesh."""
        return cls(
            mesh=np.full(count, -1),
            triangles=np.full(count, np.inf),
            part=np.full(count, -1),
            offset=np.zeros((count, 3)),
            turn=np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
            texel=np.zeros(count),
            centre=np.zeros((count, 3)),
            half_height=np.zeros(count),
            cylinder_radius=np.zeros(count),
            has_interior=np.zeros(count, bool),
            span=np.zeros(count),
        )

    def add(self, mesh: int, numbers: range, objects: list[BakedObject]) -> None:
        """Let a mesh replace the depth objects that show the same asset.

        Parameters
        ----------
        mesh : the number of the mesh in `CookedParts`.
        numbers : the numbers of the depth objects in `CookedParts`.
        objects : the depth images that these show.
        """
        corners = np.concatenate([_corners(baked) for baked in objects])
        low, high = corners.min(0), corners.max(0)
        centre = (low + high) / 2
        rows = slice(numbers.start, numbers.stop)
        self.mesh[rows], self.part[rows] = mesh, np.arange(len(objects))
        self.triangles[mesh] = objects[0].mesh_triangles or np.inf
        of_asset = [*numbers, mesh]
        self.has_interior[of_asset] = any(baked.has_interior for baked in objects)
        self.texel[of_asset] = max(map(square_texel, objects))
        self.centre[of_asset], self.half_height[of_asset] = centre, (high - low)[1] / 2
        self.cylinder_radius[of_asset] = np.hypot(*(corners - centre).T[[0, 2]]).max()
        for number, baked in zip(numbers, objects, strict=True):
            self.offset[number], self.turn[number] = baked.position, baked.rotation
            self.span[number] = np.linalg.norm(corners - self.offset[number], axis=1).max()

    def nearer_than(self, view: View, objects: Objects, rows: Rows, reach: Array) -> tuple[Rows, Array]:
        """Return which of the objects `rows` have a mesh and are nearer to the viewer than `reach`.

        Parameters
        ----------
        view : the view of the picture.
        objects : all objects of the scene.
        rows : (m,) rows of the objects.
        reach : (a,) metres, object frames, from the cylinder that encloses the asset of each depth object.

        Returns
        -------
        (k,) indices into `rows`, rising, and (k,) metres, object frames, from the viewer to the cylinder that encloses
        the asset.
        """
        loops = kernels.loaded()
        if loops is not None:
            near, nearest = loops.nearer_than(
                rows=rows,
                position=objects.position,
                rotation=objects.rotation,
                scale=objects.scale,
                asset=objects.asset,
                eye=view.position,
                mesh=self.mesh,
                part=self.part,
                offset=self.offset,
                turn=self.turn,
                reach=reach,
                span=self.span,
                asset_centre=self.centre,
                half_height=self.half_height,
                cylinder_radius=self.cylinder_radius,
            )
            return near, nearest
        asset = objects.asset[rows]
        near = (self.mesh[asset] >= 0).nonzero()[0]  # a quick test first leaves few to test exactly
        limit = reach[asset[near]] + self.span[asset[near]]
        distance = np.linalg.norm(objects.position[rows[near]] - view.position, axis=1)
        near = near[distance < limit * objects.scale[rows[near]]]
        first = rows[near] - self.part[asset[near]]
        asset = objects.asset[first]
        viewer = viewer_in_object(view, objects.position[first], objects.rotation[first], objects.scale[first])
        viewer = rotate(self.turn[asset], viewer) + self.offset[asset]
        nearest = outside(viewer, self.centre[asset], self.half_height[asset], self.cylinder_radius[asset])
        is_nearer = nearest < reach[asset]
        return near[is_nearer], nearest[is_nearer]

    def pixels(self, number: Rows, middle: Array, max_pixels: float = np.inf) -> Array:
        """Return the pixels (m,) of the rectangle about the asset of each depth object.

        Parameters
        ----------
        number : (m,) numbers of the depth objects in `CookedParts`.
        middle : (m,) length that a pixel covers at the middle of each object, metres in its frame.
        max_pixels : the most pixels that any object may cover.
        """
        return np.minimum(4 * self.cylinder_radius[number] * self.half_height[number] / middle**2, max_pixels)

    def seen(self, view: View, number: Rows, nearest: Array) -> tuple[Array, Array]:
        """Return the length that a pixel covers at the middle of each asset (m,), metres, and its `pixels` (m,).

        Parameters
        ----------
        view : the view of the picture.
        number : (m,) numbers of the depth objects, or of their meshes, in `CookedParts`.
        nearest : (m,) from the viewer to the cylinder that encloses each asset, metres in its frame.
        """
        middle = (nearest + self.cylinder_radius[number]) / view.detail_pixels
        return middle, self.pixels(number, middle, math.prod(view.whole_size))

    def has_fewer_triangles(self, number: Rows, triangles: Ints) -> Mask:
        """Return which (m,) depth objects have a mesh with fewer triangles than all depth objects of the asset.

        Parameters
        ----------
        number : (m,) numbers of the depth objects in `CookedParts`.
        triangles : (m,) of each depth object; the other parts of its asset are assumed to have as many.
        """
        parts = np.bincount(self.mesh[self.mesh >= 0], minlength=len(self.mesh))
        mesh = self.mesh[number]
        return (mesh >= 0) & (self.triangles[mesh] < parts[mesh] * triangles)

    def meshes(self, objects: Objects, rows: Rows) -> Objects:
        """Return the meshes that replace the objects `rows`, each mesh once.

        Parameters
        ----------
        objects : all objects of the scene.
        rows : (m,) rows of the objects that are replaced, nearest first.

        Returns
        -------
        The k meshes as objects, nearest first.
        """
        if not len(rows):  # as in most frames
            return _NO_MESHES
        first, order = np.unique(rows - self.part[objects.asset[rows]], return_index=True)
        return self.placed(objects, first[np.argsort(order)])

    def placed(self, objects: Objects, rows: Rows) -> Objects:
        """Return the mesh of each of the objects `rows`, placed so that it shows the asset where the object does.

        Parameters
        ----------
        objects : all objects of the scene.
        rows : (k,) rows of the objects.

        Returns
        -------
        The k meshes as objects; `asset` holds their numbers in `CookedParts`.
        """
        replaced = objects.take(rows)
        asset = replaced.asset
        rotation = multiply(replaced.rotation, conjugate(self.turn[asset]).astype(np.float32))
        position = replaced.position - replaced.scale[:, None] * rotate(rotation, self.offset[asset])
        kind = np.full(len(rows), Representation.MESH_LOD, np.uint8)
        return Objects(
            asset=self.mesh[asset].astype(np.int32),
            position=position.astype(np.float32),
            rotation=rotation,
            scale=replaced.scale,
            representation=kind,
        )


def _corners(baked: BakedObject) -> NDArray[np.float64]:
    """Return the corners (8, 3) of the box about a depth object, asset frame, metres."""
    c = baked.cylinder
    signs = np.stack(np.meshgrid([-1, 1], [0, 1], [-1, 1], indexing="ij"), -1).reshape(8, 3)
    size = [min(c.half_width, c.radius), c.height, min(c.half_depth, c.radius)]
    box = signs * size + [0, c.bottom, 0]
    return np.asarray(baked.position, np.float64) + rotate(np.asarray(baked.rotation, np.float64), box)
