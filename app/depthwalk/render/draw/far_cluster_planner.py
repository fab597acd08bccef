"""Plan the last phase of a frame: far clusters, each of which is drawn as one impostor.

This decides when far clusters (`render.world.far_clusters`) may be drawn, updates them when objects move, and hands
them to the tile scheduler like objects. Pass 1 warps all members of a cluster into one tile, on the cluster's plane.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import ALL_PIECES
from depthwalk.cook.lod_geometry import IMAGE_BITS
from depthwalk.geometry.bounding_hull import box_corners
from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.geometry.spatial_order import within_runs
from depthwalk.render.draw.draw_lists import DrawList, FrameDrawLists, ImpostorDraws, draw_batches
from depthwalk.render.draw.object_detail import ObjectDetail, describe, lasting_pieces
from depthwalk.render.draw.plan_settings import PlanSettings
from depthwalk.render.draw.planner import drawn_tiles
from depthwalk.render.impostors.tile_mapping import Tiles
from depthwalk.render.impostors.tile_placement import ImpostorObjects
from depthwalk.render.impostors.tile_records import warp_records
from depthwalk.render.impostors.tile_scheduler import TileScheduler, TileWork
from depthwalk.render.impostors.warp_planes import Planes, Volumes
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.render.view.view import View
from depthwalk.render.world.far_clusters import FarClusters, make_far_clusters
from depthwalk.render.world.render_world import RenderWorld, SceneArrays
from depthwalk.render.world.spatial_cells import SpatialCells
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.types import Array, Ints, Mask, Rows


class FarClusterPlanner:
    """Keep the far clusters of a world, and plan how those in sight are drawn.

    Parameters
    ----------
    world : the world whose objects are clustered.
    tiles : the scheduler of all impostor tiles, in which the rows of clusters follow those of objects.
    """

    def __init__(self, world: RenderWorld, tiles: TileScheduler) -> None:
        self._world, self._tiles = world, tiles
        self._clusters: FarClusters | None = None
        self._made_of: SpatialCells | None = None  # the cells that the clusters divide
        self._tile_version: Ints = np.zeros(0, np.int64)  # of each cluster, when its tile was warped

    def far_cells(self, view: View, cells: Rows, settings: RenderSettings) -> Mask:
        """Return which of the `cells` are drawn by clusters.

        None are where `warp.cluster_pixels` is 0, or while `lod.freeze`, the paper's level of detail or its drawing
        order is on, since these treat single objects.

        Parameters
        ----------
        view : the view of the picture.
        cells : (m,) numbers of the cells.
        settings : the render settings.

        Returns
        -------
        (m,) whether each cell is drawn by clusters.
        """
        lod, warp = settings.lod, settings.warp
        if not warp.cluster_pixels or lod.freeze or lod.mode == "paper" or warp.order == "epipole":
            return np.zeros(len(cells), bool)
        return self.clusters().far(view, self._world.cells(), cells, warp.cluster_pixels)

    def clusters(self) -> FarClusters:
        """Return the clusters of the world's cells, fitted to where its objects are."""
        cells, bounds = self._world.cells(), self._world.bounds()
        if self._clusters is None or self._made_of is not cells:
            objects, all_round = self._world.objects(), self._world.table().volumes.has_side
            shareable = (objects.representation == Representation.DPCI) & all_round[objects.asset]
            self._clusters, self._made_of = make_far_clusters(cells, bounds, shareable), cells
            self._tile_version = np.full(len(self._clusters), -1)
        self._clusters.follow(cells, bounds)
        return self._clusters

    def plan(self, view: View, numbers: Rows, settings: PlanSettings, first_object_id: int) -> FrameDrawLists:
        """Plan the phase that draws the clusters `numbers`.

        Parameters
        ----------
        view : the view of the picture, near and far plane fitted.
        numbers : (m,) numbers of the clusters, nearest first.
        settings : the settings that decide how detail is chosen and tiles are laid out.
        first_object_id : the number that passes write for the first member, see `FrameDrawLists`.

        Returns
        -------
        The draws of passes 1 and 2.
        """
        scene, clusters = self._world.arrays(), self.clusters()
        self._invalidate_changed(numbers, len(scene.objects))
        typical = describe(view, scene, clusters.first_members(numbers).astype(np.int64), settings.lod)
        impostors = _impostors(view, scene, clusters, numbers, typical)
        error = self._tiles.begin_phase(view, impostors, settings.layout, continues=True)
        work = self._tiles.plan(view, impostors, error, settings.layout)
        warp = _warp_list(view, scene, clusters, numbers[work.warped], work, settings)

        object_rows, count = clusters.members(numbers[work.drawn])
        work.composite["objects"] = np.column_stack([np.cumsum(count) - count, count])
        composite = ImpostorDraws(records=work.composite, aligned=work.aligned, rows=impostors.row[work.drawn])
        nothing = DrawList(records=np.zeros(0, PLACED_RECORD))
        return FrameDrawLists(
            warp=warp,
            composite=composite,
            dmesh=nothing,
            mesh=nothing,
            cleared=work.slots,
            noted={
                "objects": len(scene.objects),
                "clusters": len(composite.records),
                "provisional": work.provisional,
                "atlas_used": work.atlas_used,
            },
            tiles=drawn_tiles(work, typical.step, count),
            object_rows=object_rows,
            drawn_as=np.full(len(object_rows), Representation.DPCI, np.uint8),
            first_object_id=first_object_id,
            continues=True,
        )

    def _invalidate_changed(self, numbers: Rows, objects: int) -> None:
        """Mark the tiles of those clusters among `numbers` (m,) whose members moved, to be warped again.

        In the tile cache the rows of clusters follow those of all `objects`.
        """
        version = self.clusters().version
        self._tiles.reserve(objects + len(version))
        changed = numbers[version[numbers] != self._tile_version[numbers]]
        self._tiles.invalidate(objects + changed)
        self._tile_version[changed] = version[changed]


def _impostors(
    view: View, scene: SceneArrays, clusters: FarClusters, numbers: Rows, typical: ObjectDetail
) -> ImpostorObjects:
    """Return the clusters `numbers` (m,) as objects in the middle of their boxes, upright and of scale 1.

    The cost of warping each is estimated from `typical`, the detail of its first member.
    """
    bounds, half = clusters.bounds(numbers), (clusters.high[numbers] - clusters.low[numbers]).astype(np.float64) / 2
    count = len(numbers)
    upright = np.broadcast_to(np.array([0, 0, 0, 1], np.float32), (count, 4))
    dpci = np.full(count, Representation.DPCI, np.uint8)
    return ImpostorObjects(
        row=len(clusters.order) + numbers,
        at=np.arange(count),
        objects=Objects(
            asset=scene.objects.asset[typical.row],
            position=bounds.centre,
            rotation=upright,
            scale=np.ones(count, np.float32),
            representation=dpci,
        ),
        bounds=bounds,
        volume=np.arange(count, dtype=np.int32),
        volumes=Volumes(
            radius=np.hypot(half[:, 0], half[:, 2]),
            bottom=-half[:, 1],
            top=half[:, 1],
            hull=box_corners(half),
            has_side=np.ones(count, bool),
        ),
        viewer=view.position - bounds.centre,
        level=typical.level,
        pieces=np.full(count, ALL_PIECES),
        triangles=typical.triangles * clusters.sizes(numbers),
        provisional=np.zeros(count, bool),
    )


def _warp_list(
    view: View, scene: SceneArrays, clusters: FarClusters, warped: Rows, work: TileWork, settings: PlanSettings
) -> DrawList:
    """Return the draws of pass 1 that warp all members of the clusters `warped` (k,) into their tiles."""
    rows, count = clusters.members(warped)
    tile = np.repeat(np.arange(len(count)), count)  # of each member
    members, seen = scene.objects.take(rows), describe(view, scene, rows.astype(np.int64), settings.lod)
    viewer, level = seen.viewer, seen.level
    pieces = lasting_pieces(members.asset, level, viewer, scene.table, settings.lod)
    whole = work.whole[tile]
    order = np.lexsort((~whole, pieces, level, members.asset))
    tile, members = tile[order], members.take(order)
    batches = draw_batches(scene.table, members.asset, level[order], pieces[order], ~whole[order])
    records = member_records(
        work.planes.take(tile),
        work.tiles.take(tile),
        work.slots[tile, :2],
        settings.atlas_size,
        members,
        viewer[order],
        within_runs(count)[order],
    )
    return DrawList(records=records, batches=batches)


def member_records(
    planes: Planes,
    tiles: Tiles,
    corners: Rows,
    atlas_size: tuple[int, int],
    members: Objects,
    viewer: Array,
    number: Rows,
) -> NDArray[np.void]:
    """Return the warp records of n objects, each a member of a cluster and warped onto the cluster's plane.

    A member sees the same plane in its own frame: directions turn, lengths shrink by the object's scale, λ stays.

    Parameters
    ----------
    planes : the plane of each member's cluster.
    tiles : the tile of each member's cluster.
    corners : (n, 2) where the tile of each member's cluster lies, texels of the atlas.
    atlas_size : width and height of the atlas, texels.
    members : the n objects.
    viewer : (n, 3) the viewer in the frames of the members, metres.
    number : (n,) number of each member within its cluster, which pass 1 stores beside the number of the image.

    Returns
    -------
    (n,) WARP_RECORD.
    """
    turned, scale = conjugate(members.rotation), members.scale[:, None]
    right, up, normal = (rotate(turned, axis) for axis in (planes.right, planes.up, planes.normal))
    epipole = np.stack([np.einsum("ni,ni->n", viewer, axis) for axis in (right, up)], -1)
    distance = planes.distance / members.scale
    own = Planes(
        face=planes.face,
        right=right,
        up=up,
        normal=normal,
        distance=distance,
        epipole=epipole,
        offset=np.einsum("ni,ni->n", viewer, normal) - distance,
        low=planes.low / scale,
        high=planes.high / scale,
        diagonals=planes.diagonals / scale,
    )
    texel = tiles.texel * np.concatenate([scale, scale, np.ones_like(scale)], 1)[:, None]
    scaled = Tiles(texel=texel, nearest=tiles.nearest, size=tiles.size, pixel=tiles.pixel)
    records = warp_records(own, scaled, corners, atlas_size, members.rotation)
    records["depths"][:, 2] = number << IMAGE_BITS
    return records
