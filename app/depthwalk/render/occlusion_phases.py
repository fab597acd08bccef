"""A frame's objects in rounds, from the nearest to the farthest, less what the rounds before hide. See
`render.culling.occlusion_test`."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.gpu.timers import PassTimers
from depthwalk.render.antialiasing.modes import tile_layout
from depthwalk.render.culling.depth_readback import DepthReadback
from depthwalk.render.culling.occlusion_test import (
    FIRST_PORTION,
    FIRST_ROUND,
    DepthRangeMaximum,
    Hider,
    growth,
    screen_extents,
)
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.draw.planner import Planner, PlanSettings
from depthwalk.render.targets import Targets
from depthwalk.render.view.bounds import Cylinders, cylinders
from depthwalk.render.view.view import View
from depthwalk.render.world.render_world import FrameResidency, RenderWorld
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.types import Array, Rows

_ASKED, _CROWDED = 1024, 0.25  # far objects; where more of them are hidden, one by one is quicker than in clusters


@dataclass(frozen=True, kw_only=True)
class InSight:
    """What a view may show, before anything is known to hide anything.

    rows: (m,) objects, nearest first; portions: numbers of the cells whose objects are farther, nearest first; forward,
    reach: (k,) where those objects and cells are along the view axis, and how far they reach along it, metres;
    far: numbers of the cells whose objects may be drawn in clusters.
    """

    rows: Rows
    portions: list[Rows]
    far: Rows
    forward: Array
    bounding_radius: Array


@dataclass(frozen=True, kw_only=True)
class _Given:
    """What a frame is drawn with. remembers: what the frames before found may be used."""

    view: View
    targets: Targets
    residency: FrameResidency
    remembers: bool


class OcclusionPhases:
    """Decides what each round draws. Between frames it keeps intermediate images, and what was seen last."""

    def __init__(self, device: Device, settings: RenderSettings, world: RenderWorld, timers: PassTimers) -> None:
        self._device, self._settings, self._placed, self._timers = device, settings, world, timers
        self._planner = Planner()
        self._depth_cells: DepthReadback | None = None  # from when there is something to cull
        self._shown = np.zeros(0, bool)  # (n,), objects that the last frame found in sight

    def in_sight(self, view: View) -> InSight:
        """The objects that may show, those far off in whole cells; all one by one where nothing is to hide others."""
        culling, bounds, cells = self._settings.culling, self._placed.bounds(), self._placed.cells()
        with self._timers.measure_cpu("cull"):
            portions = cells.portions(view, culling.min_pixels, FIRST_PORTION)
            far = [self._far(view, each) for each in portions]
            nearest, *others = [each[~apart] for each, apart in zip(portions, far, strict=True)]
            clustered = np.concatenate([each[apart] for each, apart in zip(portions, far, strict=True)])
            rows, forward = cells.visible(view, bounds, culling.min_pixels, nearest)
            far_forward, far_reach = cells.along(view, np.concatenate([clustered, *others]))
            near_reach = bounds.bounding_radius[rows]
            if not culling.occlusion:
                rows = np.concatenate(
                    [rows, *(cells.visible(view, bounds, culling.min_pixels, each)[0] for each in others)]
                )
                others = []
            return InSight(
                rows=rows,
                portions=others,
                far=clustered,
                forward=np.concatenate([forward, far_forward]),
                bounding_radius=np.concatenate([near_reach, far_reach]),
            )

    def _far(self, view: View, cells: Rows) -> NDArray[np.bool_]:
        """Whether (m,) the objects of `cells` (m,) are drawn in clusters."""
        lod, warp = self._settings.lod, self._settings.warp
        if not warp.cluster_pixels or lod.freeze or lod.mode == "paper" or warp.order == "epipole":
            return np.zeros(len(cells), bool)  # what is frozen, or drawn one by one, are objects
        return self._placed.clusters().far(view, self._placed.cells(), cells, warp.cluster_pixels)

    def plans(
        self, view: View, in_sight: InSight, targets: Targets, residency: FrameResidency, remembers: bool
    ) -> Iterator[FrameDrawLists]:
        """The plans of the rounds, each to be drawn into `targets` before the next is asked for: of objects, then of
        clusters, which are farther. remembers: what the frames before found may be used."""
        given = _Given(view=view, targets=targets, residency=residency, remembers=remembers)
        portions, far, occlusion = list(in_sight.portions), in_sight.far, self._settings.culling.occlusion
        now, left = self._first_round(self._there(in_sight.rows, residency), remembers)
        size, number = max(len(now), FIRST_ROUND), 1
        continues = False
        while not continues or len(now):
            plan = self._plan(given, now, continues, number)
            continues, number = True, number + len(plan.numbered)
            yield plan
            self._shown[now] = True
            tested_again = now if remembers and len(now) > FIRST_ROUND else now[:0]
            if not occlusion or not (len(left) or portions or len(tested_again) or len(far)):
                break
            with self._timers.measure_cpu("occlusion"):
                behind = self._hider(given)
                unseen, forgotten = np.split(behind(self._held(np.append(left, tested_again))), [len(left)])
                if len(far) and behind(self._held(self._placed.cells().some_objects(far, _ASKED))).mean() > _CROWDED:
                    portions, far = [*portions, far], far[:0]
            self._shown[tested_again[forgotten]] = False
            plan.counts["occluded"] = int(unseen.sum())
            size *= growth(unseen)
            left = left[~unseen]
            while len(left) < FIRST_ROUND and portions:
                farther, occluded = self._come_into_sight(view, portions.pop(0), behind)
                left = np.append(left, self._there(farther, residency))
                plan.counts["occluded"] += occluded
            now, left = left[:size], left[size:]
        if len(far):
            yield self._plan_of_clusters(given, far, plan, number)

    def _plan_of_clusters(self, given: _Given, cells: Rows, before: FrameDrawLists, number: int) -> FrameDrawLists:
        """Of the round that draws the clusters of `cells` (m,) that are in sight. before: the plan of the round
        before."""
        settings, clusters = self._settings, self._placed.clusters()
        with self._timers.measure_cpu("cull"):
            numbers = clusters.visible(given.view, cells)
        if settings.culling.occlusion:
            with self._timers.measure_cpu("occlusion"):
                unseen = self._hider(given)(clusters.cylinders(numbers))
            before.counts["occluded"] += int(clusters.members(numbers[unseen])[1].sum())
            numbers = numbers[~unseen]
        with self._timers.measure_cpu("upload"):
            numbers = numbers[clusters.whole(numbers, given.residency.there)]
        scene, plan_settings = self._placed.arrays(), self._plan_settings(given)
        with self._timers.measure_cpu("plan"):
            return self._planner.plan_clusters(given.view, scene, numbers, plan_settings, number)

    def _first_round(self, visible: Rows, remembers: bool) -> tuple[Rows, Rows]:
        """Which of the objects `visible` (m,), nearest first, are drawn before any is tested, and the others. With
        memory, what the last frame showed; where that is too little, as after a jump, the nearest too."""
        if len(self._shown) != len(self._placed.objects()):
            self._shown = np.zeros(len(self._placed.objects()), bool)
        if not self._settings.culling.occlusion:
            return visible, visible[:0]
        first = self._shown[visible] & remembers
        self._shown[:] = False
        if first.sum() < FIRST_ROUND:
            first[:FIRST_ROUND] = True
        return visible[first], visible[~first]

    def _come_into_sight(self, view: View, cells: Rows, behind: Hider) -> tuple[Rows, int]:
        """The objects (m,) of `cells` that are not `behind` what is drawn, nearest first, and how many are; cells that
        are hidden count whole."""
        sorted_cells, bounds = self._placed.cells(), self._placed.bounds()
        with self._timers.measure_cpu("occlusion"):
            unseen = behind(sorted_cells.cylinders(cells))
        with self._timers.measure_cpu("cull"):
            rows, _ = sorted_cells.visible(view, bounds, self._settings.culling.min_pixels, cells[~unseen])
        with self._timers.measure_cpu("occlusion"):
            hidden_rows = behind(self._held(rows))
        return rows[~hidden_rows], sorted_cells.objects(cells[unseen]) + int(hidden_rows.sum())

    def _there(self, rows: Rows, residency: FrameResidency) -> Rows:
        with self._timers.measure_cpu("upload"):
            there = residency.there(rows)
            return rows if there.all() else rows[there]

    def _plan(self, given: _Given, rows: Rows, continues: bool, number: int) -> FrameDrawLists:
        """Of a round that draws the objects `rows` (n,); goes_on, number: see `Planner.plan`."""
        scene, settings, is_resident = self._placed.arrays(), self._plan_settings(given), given.residency.fallback_mesh
        with self._timers.measure_cpu("plan"):
            return self._planner.plan(given.view, scene, rows, settings, continues, number, is_resident)

    def _plan_settings(self, given: _Given) -> PlanSettings:
        settings = self._settings
        layout = tile_layout(settings, settings.warp, given.remembers)
        return PlanSettings(
            lod=settings.lod, layout=layout, polygons=settings.mesh, atlas_size=given.targets.atlas_size
        )

    def _held(self, rows: Rows) -> Cylinders:
        """What holds the objects `rows` (n,)."""
        table, centre = self._placed.table(), self._placed.bounds().centre
        return cylinders(self._placed.objects().take(rows), centre[rows], table.half_height, table.cylinder_radius)

    def _hider(self, given: _Given) -> Hider:
        """Tells which cylinders are hidden behind what is drawn so far."""
        lod, warp = self._settings.lod, self._settings.warp
        if self._depth_cells is None:
            self._depth_cells = DepthReadback(self._device, given.view.size)
        windows = DepthRangeMaximum(self._depth_cells.read(given.targets), self._depth_cells.side)
        # Tiles, and geometry, may be coarser than pixels. That a kept tile would show its object elsewhere, beside what
        # hides it, is no reason to draw it: what is seen there instead is nearer to the truth.
        margin = max(1, 1 / warp.tile_scale, lod.error * 2**lod.bias)
        return lambda held: windows.hide(screen_extents(given.view, held, margin))

    def resized(self) -> None:
        """To be called when the targets have another size."""
        if self._depth_cells is not None:
            self._depth_cells.release()
        self._depth_cells = None
