"""A scene to pictures: plans the frame, runs the passes in order, times each.

GL state between passes: whichever framebuffer the last one used; a pass sets what it needs by `enable_only`, and
wireframe is off. Depth function LESS, counter-clockwise faces are front.
"""

from collections.abc import Iterator
from dataclasses import replace

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.gpu.timers import PassTimers
from depthwalk.render.antialiasing import samples, tile_layout
from depthwalk.render.assets import AssetStore, Library
from depthwalk.render.bounds import Bounds, depth_range, object_bounds
from depthwalk.render.cascades import fit_cascades
from depthwalk.render.casters import ShadowMap, find_casters, shadow_map
from depthwalk.render.catalogue import asset_table, place_objects, placed_rows
from depthwalk.render.cells import Cells, sort_into_cells
from depthwalk.render.depth_cells import DepthCells
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.lens import lens_views
from depthwalk.render.occlusion import FIRST_PORTION, FIRST_ROUND, Cylinders, Hider, cylinders, growth, hidden, outlines
from depthwalk.render.passes import PASSES
from depthwalk.render.plan import AssetTable, FramePlan, Planner
from depthwalk.render.prepared import Form
from depthwalk.render.shading import shading
from depthwalk.render.sky import direction_to_sun, sunlight
from depthwalk.render.targets import Targets
from depthwalk.render.view import View, view_distance
from depthwalk.scene.arrays import Camera, Objects, Representation
from depthwalk.scene.scene import Scene

Rows = NDArray[np.integer]


class Renderer:
    """Draws one scene. `settings` and `scene.environment` may change between frames."""

    def __init__(self, device: Device, scene: Scene, library: Library) -> None:
        self.device = device
        self.scene = scene
        self.settings = scene.render
        self.assets = AssetStore(device, library)
        self.assets.before_release = self._forget_arrays
        self.remembers = False  # frames use what those before found: tiles, what was seen; else none depends on another
        self.upload_seconds: float | None = None  # of a frame, see `AssetStore.stream`
        self.targets: Targets | None = None
        self._depth_cells: DepthCells | None = None  # of the size of `targets`, from when there is something to cull
        self.passes: list[Pass] = []
        try:
            self.passes += (make(device) for make in PASSES)
        except BaseException:
            self.release()
            raise
        self.timers = PassTimers(device)
        self._representation: Representation | None = None
        self.plan: FramePlan | None = None  # of the frame drawn last
        self.view: View | None = None  # of the frame drawn last, near and far plane fitted
        self._library = library
        self._planner = Planner()
        self._table: AssetTable | None = None
        self._objects: Objects | None = None
        self._bounds: Bounds | None = None
        self._cells: Cells | None = None
        self._shown = np.zeros(0, bool)  # (n,), objects that the last frame found in sight

    def render(self, view: View, screen: moderngl.Framebuffer, transparent: bool = False) -> None:
        """Draws what `view` sees of the scene into `screen`, which has the view's size. Supersampled, the targets and
        the view of the passes before `output` are larger by that."""
        for lens_point, seen in enumerate(lens_views(view, self.settings.dof)):
            self._render(seen, screen, transparent, lens_point)
        self.timers.end_frame()

    def _render(self, view: View, screen: moderngl.Framebuffer, transparent: bool, lens_point: int) -> None:
        settings, (width, height) = self.settings, view.size
        finer = samples(settings)
        view = replace(view, size=(width * finer, height * finer))
        targets = self._targets(view.size)
        self.table()  # loads what is not loaded yet
        bounds, cells = self.bounds(), self._sorted()
        with self.timers.measure_cpu("cull"):
            smallest = settings.culling.min_pixels
            nearest, *others = cells.portions(view, smallest, FIRST_PORTION)
            visible, forward = cells.visible(view, bounds, smallest, nearest)
            farther = cells.along(view, np.concatenate([nearest[:0], *others]))
            if not settings.culling.occlusion:
                visible = np.concatenate(
                    [visible, *(cells.visible(view, bounds, smallest, each)[0] for each in others)]
                )
                others = []
            along = (forward, bounds.reach[visible[: len(forward)]]), farther
            view = self._fitted(view, *map(np.concatenate, zip(*along, strict=True)))
        targets.gbuffer.use()
        targets.gbuffer.clear(depth=1.0)
        surroundings = self.scene.environment, self.assets, targets, screen
        rounds: list[FramePlan] = []
        needed: list[int] = []
        for plan in self._rounds(view, visible, others, needed):
            rounds.append(plan)
            self._draw(Frame(view, plan, settings, *surroundings, transparent), objects=True)
        self.plan, self.view = FramePlan.joined(rounds), view
        with self.timers.measure_cpu("plan"):
            drawn, tiled = self.plan.numbered, self.plan.tiled
            shaded = shading(view, self.objects().take(drawn), bounds.take(drawn), tiled)
        shadows = self._shadows(view, needed)
        frame = Frame(view, self.plan, settings, *surroundings, transparent, shaded, shadows, lens_point)
        self._draw(frame, objects=False)
        self.plan.counts["assets"] = self.assets.depth_count
        self.plan.counts["gpu_mb"] = self.assets.depth_bytes / 1e6

    def _rounds(self, view: View, left: Rows, portions: list[Rows], needed: list[int]) -> Iterator[FramePlan]:
        """The plans of rounds, each to be drawn before the next is asked for: first of the objects `left` (m,), nearest
        first, then of those in `portions` of cells, less what is hidden behind the rounds before. needed: see
        `_uploaded`."""
        now, left = self._first_round(self._uploaded(left, needed))
        size, number = max(len(now), FIRST_ROUND), 1
        goes_on = False
        while not goes_on or len(now):
            plan = self._plan(view, now, goes_on, number)
            goes_on, number = True, number + len(plan.numbered)
            yield plan
            self._shown[now] = True
            tested_again = now if self.remembers and len(now) > FIRST_ROUND else now[:0]
            if not self.settings.culling.occlusion or not (len(left) or portions or len(tested_again)):
                return
            with self.timers.measure_cpu("occlusion"):
                behind = self._hider(view)
                unseen, forgotten = np.split(behind(self._held(np.append(left, tested_again))), [len(left)])
            self._shown[tested_again[forgotten]] = False
            plan.counts["occluded"] = int(unseen.sum())
            size *= growth(unseen)
            left = left[~unseen]
            while not len(left) and portions:
                left, occluded = self._come_into_sight(view, portions.pop(0), behind)
                left = self._uploaded(left, needed)
                plan.counts["occluded"] += occluded
            now, left = left[:size], left[size:]

    def _first_round(self, visible: Rows) -> tuple[Rows, Rows]:
        """Which of the objects `visible` (m,), nearest first, are drawn before any is tested, and the others. With
        memory, what the last frame showed; where that is too little, as after a jump, the nearest too."""
        if len(self._shown) != len(self.objects()):
            self._shown = np.zeros(len(self.objects()), bool)
        if not self.settings.culling.occlusion:
            return visible, visible[:0]
        first = self._shown[visible] & self.remembers
        self._shown[:] = False
        if first.sum() < FIRST_ROUND:
            first[:FIRST_ROUND] = True
        return visible[first], visible[~first]

    def _come_into_sight(self, view: View, cells: Rows, behind: Hider) -> tuple[Rows, int]:
        """The objects (m,) of `cells` that are not `behind` what is drawn, nearest first, and how many are; cells that
        are hidden count whole."""
        sorted_cells, bounds = self._sorted(), self.bounds()
        with self.timers.measure_cpu("occlusion"):
            unseen = behind(sorted_cells.cylinders(cells))
        with self.timers.measure_cpu("cull"):
            rows, _ = sorted_cells.visible(view, bounds, self.settings.culling.min_pixels, cells[~unseen])
        with self.timers.measure_cpu("occlusion"):
            hidden_rows = behind(self._held(rows))
        return rows[~hidden_rows], sorted_cells.objects(cells[unseen]) + int(hidden_rows.sum())

    def _plan(self, view: View, rows: Rows, goes_on: bool, number: int) -> FramePlan:
        """Of a round that draws the objects `rows` (n,); goes_on, number: see `Planner.plan`."""
        table, objects, bounds, settings = self.table(), self.objects(), self.bounds(), self.settings
        groups = settings.lod, tile_layout(settings, settings.warp, self.remembers), settings.mesh
        atlas_size = self._targets(view.size).atlas_size
        with self.timers.measure_cpu("plan"):
            return self._planner.plan(view, objects, bounds, rows, table, *groups, atlas_size, goes_on, number)

    def _draw(self, frame: Frame, objects: bool) -> None:
        """Runs the passes that draw objects, or those that do not."""
        for each in self.passes:
            if each.draws_objects == objects:
                with self.timers.measure(each.name):
                    each.draw(frame)

    def _held(self, rows: Rows) -> Cylinders:
        """What holds the objects `rows` (n,)."""
        table = self.table()
        return cylinders(self.objects().take(rows), self.bounds().centre[rows], table.half_height, table.girth)

    def _hider(self, view: View) -> Hider:
        """Tells which cylinders are hidden behind what is drawn so far."""
        lod, warp = self.settings.lod, self.settings.warp
        if self._depth_cells is None:
            self._depth_cells = DepthCells(self.device, view.size)
        farthest, side = self._depth_cells.read(self._targets(view.size)), self._depth_cells.side
        # Tiles, and geometry, may be coarser than pixels. That a kept tile would show its object elsewhere, beside what
        # hides it, is no reason to draw it: what is seen there instead is nearer to the truth.
        margin = max(1, 1 / warp.tile_scale, lod.error * 2**lod.bias)
        return lambda held: hidden(outlines(view, held, margin), farthest, side)

    def objects(self) -> Objects:
        """The scene's objects as they are drawn, by the representation asked for: a row for each part of their depth
        images, in its frame. `asset` holds numbers of `AssetStore`."""
        if self._objects is None:
            self._objects = place_objects(self.scene, self._library, self.assets, self._representation)
        return self._objects

    def objects_moved(self, changed: slice | None = None) -> None:
        """To be called after `set_node_transform`, with the slice of the scene's objects that it returned; None: any
        may have moved."""
        if changed is None or self._cells is None or self._bounds is None:
            self._objects = self._bounds = self._cells = None
            return
        if changed.start == changed.stop:
            return
        context = self.scene, self._library, self.assets, self._representation
        table, objects, rows = self.table(), self.objects(), placed_rows(*context, changed)
        objects.put(rows, place_objects(*context, changed))
        self._bounds.put(rows, object_bounds(objects.take(rows), table.centre, table.reach))
        self._cells.refit(self._bounds, rows)

    def bounds(self) -> Bounds:
        """Where the objects are."""
        if self._bounds is None:
            table = self.table()
            self._bounds = object_bounds(self.objects(), table.centre, table.reach)
        return self._bounds

    def _sorted(self) -> Cells:
        if self._cells is None:
            self._cells = sort_into_cells(self.bounds())
        return self._cells

    @property
    def representation(self) -> Representation | None:
        """How all objects are drawn whose asset allows it; None: as the scene says."""
        return self._representation

    @representation.setter
    def representation(self, wanted: Representation | None) -> None:
        if wanted is not self._representation:
            self._representation = wanted
            self._objects = self._table = self._bounds = self._cells = None

    def table(self) -> AssetTable:
        """Bounds, cylinders and index ranges of the assets, which are loaded for it."""
        lod = self.settings.lod
        stepped = "paper" in (lod.mode, lod.cases) or self.settings.warp.order == "epipole"
        form = Form(stepped, lod.cases == "paper")
        if self.assets.form != form:
            self._forget_assets()
            self.assets.form, self._table = form, None
        if self._table is None:
            self._table = asset_table(self.objects(), self._library, self.assets)
        return self._table

    def middle_distance(self) -> float:
        """Metres along the view axis to what the frame drawn last shows in its middle; +inf where nothing is. Waits
        for that frame."""
        if self.targets is None or self.view is None:
            return float("inf")
        width, height = self.targets.size
        middle = width // 2, height // 2, 1, 1
        depth = np.frombuffer(self.targets.gbuffer.read(middle, attachment=-1, dtype="f4"), np.float32)
        return float(view_distance(depth, *self.view.depth_range)[0])

    def frame_all(self, aspect: float, fov: float = np.pi / 3) -> Camera:
        """A camera that sees every object, from the front and a little above. aspect: width / height of the picture;
        fov: vertical angle of view, radians."""
        bounds = self.bounds()
        if not len(bounds.reach):
            return Camera((0.0, 1.6, 5.0), (0.0, 1.0, 0.0), fov)
        reach = bounds.reach[:, None]
        low, high = (bounds.centre - reach).min(0), (bounds.centre + reach).max(0)
        middle, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
        narrower = min(fov, 2 * np.arctan(np.tan(fov / 2) * aspect))
        away = np.array([0.0, 0.25, 1.0]) / np.hypot(0.25, 1.0) * radius / np.sin(narrower / 2)
        return Camera(tuple(middle + away), tuple(middle), fov)

    def _fitted(self, view: View, forward: NDArray[np.floating], reach: NDArray[np.floating]) -> View:
        """`view` with near and far plane about what is at `forward` (m,) and has `reach` (m,) along the view axis, and
        about the ground."""
        if view.near is not None and view.far is not None:
            return view
        ground = self.scene.environment.ground
        seen = None
        if ground is not None:
            above = abs(float(view.position[1]) - ground.height)
            steepest = max(abs(view.axes[2, 1]) + sum(np.abs(view.axes[:2, 1]) * view.half_extent), 1e-6)
            seen = above / steepest, float(np.linalg.norm(view.position)) + 2 * ground.size + above
        near, far = depth_range(forward, reach, seen)
        return replace(view, near=near, far=far)

    def _shadows(self, view: View, needed: list[int]) -> tuple[ShadowMap, ...] | None:
        """The sun's shadow maps and what casts shadows in each; None where there are to be none. needed: see
        `_uploaded`."""
        params, environment = self.settings.shadows, self.scene.environment
        if not params.enabled or not sunlight(environment).any():
            return None
        with self.timers.measure_cpu("cull"):
            cascades = fit_cascades(view, direction_to_sun(environment), params)
            found = [find_casters(cascade, self.bounds()) for cascade in cascades]
        casters = [self._uploaded(rows, needed) for rows in found]
        with self.timers.measure_cpu("plan"):
            pairs = zip(cascades, casters, strict=True)
            return tuple(shadow_map(*each, self.objects(), self.table(), params) for each in pairs)

    def _uploaded(self, rows: Rows, needed: list[int]) -> Rows:
        """Those of the objects `rows` (m,), nearest first, whose assets are on the GPU, once what fits the time and the
        budget has been brought there. needed: what the frame needs so far, to which is added what they do."""
        with self.timers.measure_cpu("upload"):
            asset = self.objects().asset[rows]
            numbers, first = np.unique(asset, return_index=True)
            depth = numbers[np.argsort(first)]
            needed += (number for number in depth[depth >= len(self._library)].tolist() if number not in needed)
            self.assets.budget = self.settings.gpu_memory
            there = self.assets.stream(needed, self.upload_seconds)
            return rows if there[numbers].all() else rows[there[asset]]

    def _forget_arrays(self) -> None:
        for each in self.passes:
            each.forget_assets()

    def _forget_assets(self) -> None:
        self._forget_arrays()
        self.assets.release()

    def release(self) -> None:
        self._forget_assets()
        for each in self.passes:
            each.release()
        self._release_targets()

    def _release_targets(self) -> None:
        for each in (self.targets, self._depth_cells):
            if each is not None:
                each.release()
        self.targets = self._depth_cells = None

    def _targets(self, size: tuple[int, int]) -> Targets:
        if self.targets is None or self.targets.size != size:
            self._release_targets()
            self.targets = Targets(self.device, size)
            for each in self.passes:
                each.resize(size)
        return self.targets


def read_pixels(framebuffer: moderngl.Framebuffer) -> NDArray[np.uint8]:
    """The picture (H, W, 4) uint8, top row first."""
    width, height = framebuffer.size
    data = framebuffer.read(components=4, alignment=1)
    return np.frombuffer(data, np.uint8).reshape(height, width, 4)[::-1]
