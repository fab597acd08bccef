"""Divide a frame into phases, and cull what earlier phases hide: two-phase occlusion culling, with further phases.

A renderer that remembers first draws what the last frame showed, then tests everything else against that depth, as in
two-phase occlusion culling. Without memory, or after a jump, the first phase draws the nearest objects, and each later
phase draws eight times as many of those that pass the test (`render.culling.object_occlusion`). Far clusters
(`render.draw.far_cluster_planner`) come last.
"""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass

import numpy as np

from depthwalk.gpu.device import Device
from depthwalk.gpu.timers import PassTimers
from depthwalk.render.antialiasing.modes import tile_layout
from depthwalk.render.culling.object_occlusion import ObjectOcclusion, Occluders
from depthwalk.render.culling.occlusion_test import FIRST_BATCH, FIRST_PHASE, GROWTH
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.draw.far_cluster_planner import FarClusterPlanner
from depthwalk.render.draw.plan_settings import PlanSettings
from depthwalk.render.draw.planner import Planner
from depthwalk.render.targets import Targets
from depthwalk.render.view.bounds import depth_range, ground_range
from depthwalk.render.view.view import View
from depthwalk.render.world.frame_residency import FrameResidency
from depthwalk.render.world.render_world import RenderWorld
from depthwalk.render.world.spatial_cells import in_sight, nearest, nearest_first
from depthwalk.scene.environment import GroundParams
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.types import Array, Mask, Rows


@dataclass(frozen=True, kw_only=True)
class InSight:
    """Hold what a view may show, before occlusion culling.

    Attributes
    ----------
    rows : (m,) rows of the objects, neighbours close together.
    distance : (m,) distances of their centres, metres along the view axis.
    batches : (c,) numbers of spatial cells in each batch, whose objects are farther than those of `rows`, nearest
        first.
    far_cells : (f,) numbers of the spatial cells whose objects may be drawn as far clusters.
    forward : (k,) distances along the view axis, metres, of the single objects, then of all cells as wholes.
    bounding_radius : (k,) how far each reaches to either side of that distance, metres.
    """

    rows: Rows
    distance: Array
    batches: list[Rows]
    far_cells: Rows
    forward: Array
    bounding_radius: Array

    def fitted(self, view: View, ground: GroundParams | None) -> View:
        """Return `view` with near and far plane fitted to what is in sight and to the ground, unless it sets both."""
        if view.near is not None and view.far is not None:
            return view
        seen_ground = ground_range(view, ground.height, ground.half_size) if ground is not None else None
        return view.fitted(*depth_range(self.forward, self.bounding_radius, seen_ground))


@dataclass(frozen=True, kw_only=True)
class PhaseInputs:
    """Hold what the phases of a frame are drawn with.

    Attributes
    ----------
    view : the view of the picture, near and far plane fitted.
    targets : the textures that the phases are drawn into; their depth is read between the phases.
    residency : brings to the GPU what the frame draws.
    remembers : whether what earlier frames found may be used.
    warp_limit : how many triangles may be warped, see `PlanSettings`.
    tile_light : what the light in impostor tiles depends on, see `PlanSettings`.
    """

    view: View
    targets: Targets
    residency: FrameResidency
    remembers: bool
    warp_limit: int | None
    tile_light: Hashable


@dataclass(kw_only=True)
class _Pending:
    """Hold what a frame has neither drawn nor found to be hidden yet.

    rows: (m,) objects; until the first test in spatial order, with distance (m,), metres along the view axis; after it
    nearest first, and distance is None. batches, far_cells: as in `InSight`.
    """

    rows: Rows
    distance: Array | None
    batches: list[Rows]
    far_cells: Rows

    def __bool__(self) -> bool:
        return bool(len(self.rows) or self.batches or len(self.far_cells))


class OcclusionPhases:
    """Decide what each phase of a frame draws.

    Keeps from frame to frame the impostor tiles (in its planner) and which objects the last frame showed.

    Parameters
    ----------
    device : the GPU that draws, whose depth buffer is read.
    settings : the render settings of the scene; they may change between frames.
    world : the objects of the scene.
    timers : measure the steps "cull", "occlusion", "upload" and "plan", and on a GPU "occlusion_depth".
    """

    def __init__(self, device: Device, settings: RenderSettings, world: RenderWorld, timers: PassTimers) -> None:
        self._settings, self._world, self._timers = settings, world, timers
        self._planner = Planner()
        self._cluster_planner = FarClusterPlanner(world, self._planner.tiles)
        self._occlusion = ObjectOcclusion(device, settings, world, timers)
        self._last_seen = np.zeros(0, bool)  # (n,), objects that the last frame found in sight
        self._ahead: Rows = np.zeros(0, np.int64)  # objects of the batches that this frame drew first, from memory

    def in_sight(self, view: View) -> InSight:
        """Return the objects in the frustum of a view.

        Far objects are returned as whole cells, or, without occlusion culling, object by object.

        Parameters
        ----------
        view : the view of the picture; near and far plane need not be fitted.

        Returns
        -------
        The objects and cells in sight.
        """
        culling, bounds, cells = self._settings.culling, self._world.bounds(), self._world.cells()
        with self._timers.measure_cpu("cull"):
            batches = cells.batches(view, culling.min_pixels, FIRST_BATCH)
            visible_cells, ends = np.concatenate(batches), np.cumsum([len(batch) for batch in batches])
            is_far = self._cluster_planner.far_cells(view, visible_cells, self._settings)
            if (far_cells := visible_cells[is_far]).size:
                batches = [batch[~far] for batch, far in zip(batches, np.split(is_far, ends[:-1]), strict=True)]
            first, *others = batches
            rows, forward = cells.visible(view, bounds, culling.min_pixels, first)
            cells_forward, cells_reach = cells.along(view, np.concatenate([far_cells, *others]))
            reach, distance = bounds.bounding_radius[rows], forward
            if not culling.occlusion and others:
                more, farther = cells.visible(view, bounds, culling.min_pixels, np.concatenate(others))
                rows, distance, others = np.append(rows, more), np.append(forward, farther), []
            return InSight(
                rows=rows,
                distance=distance,
                batches=others,
                far_cells=far_cells,
                forward=np.concatenate([forward, cells_forward]),
                bounding_radius=np.concatenate([reach, cells_reach]),
            )

    def plans(self, frame: PhaseInputs, in_sight: InSight) -> Iterator[FrameDrawLists]:
        """Yield the plan of each phase; the caller draws it into the targets before it asks for the next one.

        Parameters
        ----------
        frame : what the phases are drawn with.
        in_sight : the result of the method `in_sight`.

        Yields
        ------
        What the passes draw in the next phase.
        """
        pending = _Pending(
            rows=in_sight.rows,
            distance=in_sight.distance,
            batches=list(in_sight.batches),
            far_cells=in_sight.far_cells,
        )
        rows, settings = self._first_phase(frame, pending), self._plan_settings(frame)
        size = max(len(rows), FIRST_PHASE)
        plan: FrameDrawLists | None = None
        while plan is None or len(rows):
            from_memory = plan is None and frame.remembers and len(rows) > FIRST_PHASE
            plan = self._plan(frame, rows, settings, plan)
            yield plan
            self._last_seen[rows] = True
            retested = rows if from_memory else rows[:0]
            if not self._settings.culling.occlusion or not (pending or len(retested)):
                break
            self._drop_hidden(frame, pending, retested, plan)
            size *= GROWTH
            rows, pending.rows = pending.rows[:size], pending.rows[size:]
        if len(pending.far_cells):
            yield self._plan_clusters(frame, pending.far_cells, settings, plan)

    def _first_phase(self, frame: PhaseInputs, pending: _Pending) -> Rows:
        """Return the objects (m,), nearest first, to draw before any is tested; the others stay `pending`.

        With memory these are what the last frame showed, near or far; if that is too few, as after a jump, the nearest
        ones too.
        """
        count, culling = len(self._world.objects()), self._settings.culling
        if len(self._last_seen) != count:
            self._last_seen = np.zeros(count, bool)
        assert pending.distance is not None  # before the first test
        visible, distance = self._resident(frame, pending.rows, pending.distance)
        ahead: Rows = np.zeros(0, np.int64)
        farther: Array = np.zeros(0)
        first: Mask = np.ones(len(visible), bool)
        if culling.occlusion:
            first = self._last_seen[visible] & frame.remembers
            if frame.remembers and pending.batches:
                ahead, farther = self._resident(frame, *self._remembered(frame.view, pending.batches))
            self._last_seen[:] = False
            if first.sum() + len(ahead) < FIRST_PHASE:
                first[nearest(distance, FIRST_PHASE)] = True
        self._ahead = ahead
        pending.rows, pending.distance = visible[~first], distance[~first]
        return nearest_first(np.append(visible[first], ahead), np.append(distance[first], farther))

    def _remembered(self, view: View, batches: list[Rows]) -> tuple[Rows, Array]:
        """Return the objects (m,) in `batches` of cells that the last frame showed and this one may show.

        Also returns their distances (m,) along the view axis, metres.
        """
        with self._timers.measure_cpu("cull"):
            cells, (rows,) = self._world.cells(), self._last_seen.nonzero()
            in_batches = np.zeros(len(cells.low), bool)
            in_batches[np.concatenate(batches)] = True
            rows = rows[in_batches[cells.cell_of_row[rows]]]
            return in_sight(view, self._world.bounds(), self._settings.culling.min_pixels, rows)

    def _drop_hidden(self, frame: PhaseInputs, pending: _Pending, retested: Rows, plan: FrameDrawLists) -> None:
        """Drop hidden objects from `pending`, and open batches of cells where few objects are left.

        Parameters
        ----------
        retested : (k,) objects just drawn from memory; those hidden by now need not be drawn in the next frame.
        plan : of the phase just drawn; its count of hidden objects is filled in.
        """
        with self._timers.measure_cpu("occlusion"):
            drawn = self._occlusion.drawn(frame.view, frame.targets)
            hidden = (drawn.hide if pending.distance is None else drawn.hide_neighbours)(pending.rows)
            self._last_seen[retested[drawn.hide(retested)]] = False
            occluded = int(hidden.sum()) + self._drop_cells(pending, drawn)
            pending.rows = pending.rows[~hidden]
            if pending.distance is not None:
                pending.rows, pending.distance = nearest_first(pending.rows, pending.distance[~hidden]), None
        if len(self._ahead) and pending.batches:  # most of what the batches show is drawn: test the rest at once
            pending.batches = [np.concatenate(pending.batches)]
        while pending.batches and (len(pending.rows) < FIRST_PHASE or len(self._ahead)):
            opened, distance, hidden_objects = self._open_batch(frame.view, pending.batches.pop(0), drawn)
            opened, distance = self._resident(frame, opened, distance)
            pending.rows = np.append(pending.rows, nearest_first(opened, distance))
            occluded += hidden_objects
        plan.note("occluded", occluded)

    def _drop_cells(self, pending: _Pending, drawn: Occluders) -> int:
        """Drop the cells that are hidden as a whole from the `pending` batches; return how many objects that hides."""
        if not pending.batches:
            return 0
        cells, ends = self._world.cells(), np.cumsum([len(batch) for batch in pending.batches])
        tested = np.concatenate(pending.batches)
        hidden = drawn.hide_cylinders(cells.cylinders(tested))
        ahead = np.bincount(cells.cell_of_row[self._ahead], minlength=len(cells.low))[tested[hidden]].sum()
        left = [batch[~gone] for batch, gone in zip(pending.batches, np.split(hidden, ends[:-1]), strict=True)]
        pending.batches = [batch for batch in left if len(batch)]
        return cells.count_objects(tested[hidden]) - int(ahead)

    def _open_batch(self, view: View, batch: Rows, drawn: Occluders) -> tuple[Rows, Array, int]:
        """Return the objects of the cells `batch` (k,) that are neither drawn nor hidden, and how many are hidden.

        Objects are returned as rows (m,) and distances (m,), metres along the view axis.
        """
        with self._timers.measure_cpu("cull"):
            culling, bounds = self._settings.culling, self._world.bounds()
            rows, distance = self._world.cells().visible(view, bounds, culling.min_pixels, batch)
            if len(self._ahead):
                is_ahead = np.zeros(len(self._last_seen), bool)
                is_ahead[self._ahead] = True
                left = ~is_ahead[rows]
                rows, distance = rows[left], distance[left]
        with self._timers.measure_cpu("occlusion"):
            hidden = drawn.hide_neighbours(rows)
            return rows[~hidden], distance[~hidden], int(hidden.sum())

    def _plan(
        self, frame: PhaseInputs, rows: Rows, settings: PlanSettings, before: FrameDrawLists | None
    ) -> FrameDrawLists:
        """Plan the phase that draws the objects `rows` (m,). before: the plan of the phase before."""
        with self._timers.measure_cpu("plan"):
            planned = self._planner.plan(
                frame.view,
                self._world.arrays(),
                rows,
                settings,
                continues=before is not None,
                first_object_id=1 if before is None else before.next_object_id,
                is_resident=frame.residency.is_mesh_resident,
            )
        if before is not None:
            planned.polygons_before = before.polygons_after
        return planned

    def _plan_clusters(
        self, frame: PhaseInputs, cells: Rows, settings: PlanSettings, before: FrameDrawLists
    ) -> FrameDrawLists:
        """Plan the phase that draws the clusters of `cells` (m,). before: the plan of the phase before."""
        clusters = self._cluster_planner.clusters()
        with self._timers.measure_cpu("cull"):
            numbers = clusters.visible(frame.view, cells)
        if self._settings.culling.occlusion:
            with self._timers.measure_cpu("occlusion"):
                drawn = self._occlusion.drawn(frame.view, frame.targets)
                hidden = drawn.hide_cylinders(clusters.cylinders(numbers))
            before.note("occluded", int(clusters.sizes(numbers[hidden]).sum()))
            numbers = numbers[~hidden]
        with self._timers.measure_cpu("upload"):
            numbers = numbers[clusters.resident(numbers, frame.residency.resident)]
        with self._timers.measure_cpu("plan"):
            planned = self._cluster_planner.plan(frame.view, numbers, settings, before.next_object_id)
        planned.polygons_before = before.polygons_after
        return planned

    def _plan_settings(self, frame: PhaseInputs) -> PlanSettings:
        """Return the settings that the plans of a frame follow."""
        settings = self._settings
        return PlanSettings(
            lod=settings.lod,
            layout=tile_layout(settings, settings.warp, frame.remembers),
            polygons=settings.mesh,
            atlas_size=frame.targets.atlas_size,
            warp_limit=frame.warp_limit,
            tile_light=frame.tile_light,
        )

    def _resident(self, frame: PhaseInputs, rows: Rows, distance: Array) -> tuple[Rows, Array]:
        """Return those of the objects `rows` (m,) whose assets are on the GPU, with their `distance` (m,)."""
        with self._timers.measure_cpu("upload"):
            resident = frame.residency.resident(rows, distance)
            return (rows, distance) if resident.all() else (rows[resident], distance[resident])

    def resized(self) -> None:
        """Release what depends on the size of the targets; must be called whenever that size changes."""
        self._occlusion.resized()
