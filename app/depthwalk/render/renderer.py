"""Draw a scene: find what is in sight, plan the frame, run its passes in order and time each.

`Renderer._render` is the outline of a frame; docs/images/frame.svg shows its passes and the targets between them, and
`render.frame.Pass` says what a pass may rely on.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.geometry.vectors import components
from depthwalk.gpu.device import Device
from depthwalk.gpu.timers import PassTimers
from depthwalk.render.antialiasing.modes import hardware_samples, sample_views, supersampled
from depthwalk.render.declared_targets import declared
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.draw.material_depth import MaterialRecords, least_footprints, material_records
from depthwalk.render.frame import Common, Frame, Pass, common
from depthwalk.render.lighting.irradiance import lighting
from depthwalk.render.occlusion_phases import InSight, OcclusionPhases
from depthwalk.render.passes import default_passes
from depthwalk.render.pixel_pass import DrawnPass, PixelPrograms, neighbours
from depthwalk.render.pixel_shares import PixelShares
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.resources.library import Library
from depthwalk.render.shadow_planner import ShadowPlanner
from depthwalk.render.shadows.casters import Shadows
from depthwalk.render.targets import Targets, TileAtlas, atlas_size
from depthwalk.render.view.bounds import depth_range, ground_range
from depthwalk.render.view.view import View, view_distance
from depthwalk.render.view.view_block import PICTURE_VIEW, ViewBlock
from depthwalk.render.world.render_world import FrameResidency, RenderWorld
from depthwalk.scene.arrays import Camera
from depthwalk.scene.scene import Scene

_SHADOW_TRIANGLES = 2_000_000  # of shadow maps that may wait, in a frame of a window where nobody moves
_OF_LIMIT = 5  # for each triangle of these, a frame with a limit to its work may warp so many
_FIRST_DETAIL = 0.1  # of the triangles of shadow maps, in a first picture that somebody waits for
_END = object()  # of a pass: it has no further part
_IN_FRONT = glm.dvec3(0, 0.25, 1)  # world, from the objects to a camera that sees them all, a little from above


@dataclass(kw_only=True)
class _Memory:
    """Hold what frames of one kind keep for the next ones: what was in sight, and the impostor tiles."""

    phases: OcclusionPhases
    atlas: TileAtlas | None = None


class Renderer:
    """Draw one scene, frame by frame. Its settings and `scene.environment` may change between frames.

    Parameters
    ----------
    device : the GPU, whose context must be current whenever the renderer is used.
    scene : what is drawn; `world` must be told when its objects move.
    library : reads, bakes and caches the assets when they are first needed.
    passes : the passes of a frame in their order, for this renderer alone; None: `default_passes()`.

    Attributes
    ----------
    settings : the render settings of the scene.
    passes : the passes in their order.
    remembers : whether a frame uses what earlier frames found, such as impostor tiles and what was in sight. If not, no
        frame depends on another.
    upload_seconds : how long a frame may bring assets to the GPU, seconds, where frames should take equally long; None:
        until all are resident (see `AssetStore.stream`), and shadow maps are drawn whole.
    warp_limit : how many triangles a frame may warp, where frames should take equally long. What is beyond and cannot
        wait is warped coarser, and again in later frames; None: everything is warped as finely as it should be.
    keeps : names of the targets that somebody reads when a frame is over, which are not among the results of the last
        pass: a pass that is drawn together with the next one writes nothing (see `render.pixel_pass`).
    world : the objects in arrays, which must be told when they move.
    assets : the assets on the GPU.
    targets : the textures that passes draw into; None before the first frame.
    timers : milliseconds of each pass and of the steps on the CPU.
    plan : the draw lists of the frame drawn last; None before the first.
    view : the view of the frame drawn last, near and far plane fitted; None before the first.
    """

    def __init__(
        self, device: Device, scene: Scene, library: Library, passes: Sequence[Pass[Any]] | None = None
    ) -> None:
        self.device = device
        self.scene = scene
        self.settings = scene.render
        self.assets = AssetStore(device, library)
        self.assets.before_release = self._forget_assets
        self.world = RenderWorld(scene, library, self.assets)
        self.remembers = False
        self.upload_seconds: float | None = None
        self.warp_limit: int | None = None
        self.keeps: frozenset[str] = frozenset()
        self.targets: Targets | None = None
        self._declared: dict[Pass[Any], Targets] = {}  # the targets as each pass may use them
        self.plan: FrameDrawLists | None = None
        self.view: View | None = None
        self.timers = PassTimers(device)
        self._frames = self._new_memory()
        self._fine: _Memory | None = None  # made when somebody asks for such frames
        self._last_shadows = Shadows()
        self._gl = device.scope("view")
        self._view_block = ViewBlock(self._gl, PICTURE_VIEW)
        self._pixel_programs = PixelPrograms(self._gl)
        self._shadows = ShadowPlanner(self.world, self.timers)
        self._shares: PixelShares | None = None  # made when somebody asks for it
        self.passes: list[Pass[Any]] = []
        try:
            for pass_ in default_passes() if passes is None else passes:
                pass_.attach(device)
                self.passes.append(pass_)
        except BaseException:
            self.release()
            raise

    def render(self, view: View, screen: moderngl.Framebuffer, transparent: bool = False) -> None:
        """Draw a picture of the scene.

        Parameters
        ----------
        view : the camera, and the size of `screen`. With supersampling, the passes before `output` see a larger size.
        screen : the framebuffer to draw into.
        transparent : whether pixels where nothing is drawn get alpha 0; otherwise they show the sky or the background.
        """
        for _ in self.steps(view, screen, transparent):
            pass

    def steps(self, view: View, screen: moderngl.Framebuffer, transparent: bool = False) -> Iterator[str]:
        """Draw a picture as `render` does, but stop after each pass, and between the parts of long ones (`Pass.parts`).

        Neither the scene nor its settings may change before the last step, nor another picture be begun. What the
        caller draws meanwhile must leave GL state as it was, and the targets alone.

        Parameters
        ----------
        view : the camera, and the size of `screen`. With supersampling, the passes before `output` see a larger size.
        screen : the framebuffer to draw into.
        transparent : whether pixels where nothing is drawn get alpha 0; otherwise they show the sky or the background.

        Yields
        ------
        The name of the pass whose commands were just given to the GPU; of several that share a program, all names.
        """
        views = [view]
        for pass_ in self.passes:
            views = [seen for whole in views for seen in pass_.views(whole, pass_.params_in(self.settings))]
        for lens_point, seen in enumerate(views):
            yield from self._render(seen, screen, transparent, lens_point, self._frames)
        self.timers.end_frame()

    def fine_steps(self, view: View, screen: moderngl.Framebuffer) -> Iterator[str]:
        """Draw a picture as `steps` does, with four samples per pixel, as a more exact one of the frame before.

        It shows the shadow maps of that frame, and changes nothing that later frames remember, but what `targets` hold.
        The caller may stop after any step.

        Parameters
        ----------
        view : the camera of the frame before, or a part of its picture.
        screen : the framebuffer to draw into, of the size of `view`.

        Yields
        ------
        The name of the pass whose commands were just given to the GPU.
        """
        if self._fine is None:
            self._fine = self._new_memory()
        try:
            yield from self._render(view, screen, False, 0, self._fine)
        finally:
            self.timers.drop_frame()

    def _new_memory(self) -> _Memory:
        return _Memory(phases=OcclusionPhases(self.device, self.scene.render, self.world, self.timers))

    def rehearse(self, view: View, screen: moderngl.Framebuffer) -> None:
        """Draw a picture that does not count, so that later ones need not wait for the compiler of the driver.

        Parameters
        ----------
        view : the camera, and the size of `screen`.
        screen : the framebuffer to draw into.
        """
        before, self.remembers = (self.remembers, self.plan, self.view), False
        try:
            self.render(view, screen)
        finally:
            self.remembers, self.plan, self.view = before
            self._forget_assets()

    def _render(
        self, view: View, screen: moderngl.Framebuffer, transparent: bool, lens_point: int, memory: _Memory
    ) -> Iterator[str]:
        """Draw one frame: what is in sight, the objects phase by phase, then everything that follows from them.

        memory: of its kind. Yields the names of the passes, see `steps`.
        """
        fine, shared = memory is self._fine, common(self.settings)
        if fine:
            shared = replace(shared, aa=supersampled(shared.aa))
        view = replace(view, size=(view.size[0] * shared.aa.samples, view.size[1] * shared.aa.samples))
        targets = self._prepare_targets(view, hardware_samples(self.settings, self.device), shared, memory)
        targets.screen = screen
        self.world.take_arrivals(view.position)
        self.world.table()  # loads what is not loaded yet
        in_sight = memory.phases.in_sight(view)
        view = self._fitted(view, in_sight)
        self.assets.budget = self.settings.gpu_memory
        residency = FrameResidency(self.world, self.assets, self.upload_seconds)
        light = lighting(self.scene.environment)
        frame_of = partial(
            Frame,
            view=view,
            common=shared,
            environment=self.scene.environment,
            light=light,
            assets=self.assets,
            targets=targets,
            transparent=transparent,
            lens_point=lens_point,
        )
        plans: list[FrameDrawLists] = []
        remembers, limit = (False, None) if fine else (self.remembers, self.warp_limit)
        tile_light = light.key if shared.lit_tiles else None
        for plan in memory.phases.plans(view, in_sight, targets, residency, remembers, limit, tile_light):
            plans.append(plan)
            if shared.lit_tiles:
                self._materials(view, plan)  # pass 1 looks textures up
            yield from self._draw([pass_ for pass_ in self.passes if pass_.draws_objects], frame_of(plan=plan))
        whole = FrameDrawLists.joined(plans)
        frame = frame_of(plan=whole, materials=self._materials(view, whole))
        frame = replace(frame, shadows=self._last_shadows if fine else self._shadow_maps(frame, residency))
        yield from self._draw_samples([pass_ for pass_ in self.passes if not pass_.draws_objects], frame)
        whole.noted["assets"] = self.assets.depth_count
        whole.noted["gpu_mb"] = self.assets.gpu_bytes / 1e6
        if not fine:
            self.plan, self.view = whole, view

    def _prepare_targets(self, view: View, samples: int, shared: Common, memory: _Memory) -> Targets:
        """Return cleared targets for `view`; those of the last frame where they fit."""
        size, atlas = view.size, self._atlas_for(view, shared.lit_tiles, memory)
        targets = self.targets
        same = targets is not None and (targets.size, targets.samples) == (size, samples)
        if targets is None or not same or targets.tile_atlas is not atlas:
            self._release_targets()
            targets = Targets(self.device, size, samples, atlas)
            try:
                self._declared = {
                    pass_: declared(targets, pass_.name, pass_.reads, pass_.writes) for pass_ in self.passes
                }
            except BaseException:
                targets.release()
                raise
            self.targets = targets
            for pass_ in self.passes:
                pass_.resize(size)
        # Only GPAA reads albedo and normals where nothing is.
        cleared = targets.polygons if shared.aa.geometric else targets.visibility
        cleared.clear(depth=1.0)
        return targets

    def _atlas_for(self, view: View, lit: bool, memory: _Memory) -> TileAtlas:
        """Return an atlas for the impostor tiles of `view`, `lit` or not; that of the last such frame where it fits."""
        size = atlas_size(view.whole_size, self.device.max_texture_size)
        if memory.atlas is None or memory.atlas.size != size or memory.atlas.lit != lit:
            if memory.atlas is not None:
                memory.atlas.release()
            memory.atlas = None  # should there be no memory for the next
            memory.atlas = TileAtlas(self.device, size, lit)
        return memory.atlas

    def _fitted(self, view: View, in_sight: InSight) -> View:
        """Return `view` with near and far plane about what is `in_sight` and about the ground."""
        if view.near is not None and view.far is not None:
            return view
        ground = self.scene.environment.ground
        seen_ground = ground_range(view, ground.height, ground.half_size) if ground is not None else None
        near, far = depth_range(in_sight.forward, in_sight.bounding_radius, seen_ground)
        return replace(view, near=near, far=far)

    def _materials(self, view: View, plan: FrameDrawLists) -> MaterialRecords:
        """Return what `material_resolve` looks up of the depth-image objects of `plan`, and upload their textures."""
        with self.timers.measure_cpu("plan"):
            materials = material_records(view, self.world.arrays(), plan.object_rows, plan.tiled)
        if self.assets.has_partial:
            with self.timers.measure_cpu("upload"):
                asset = self.world.objects().asset[plan.object_rows]
                footprint = least_footprints(view, asset, materials, self.world.table())
                numbers, exact = materials.assets.tolist(), not self.remembers
                self.assets.fit_textures(numbers, footprint, self.upload_seconds, exact=exact)
        return materials

    def _shadow_maps(self, frame: Frame, residency: FrameResidency) -> Shadows:
        """Return what the shadow maps of sun and lamps are to show in `frame`."""
        settings, lamps, limit = self.settings, frame.environment.lights, self.warp_limit
        planned = self._shadows.plan(
            frame.view,
            frame.light,
            lamps,
            settings.shadows,
            settings.lod.magnification,
            residency,
            self.remembers,
            detail=_FIRST_DETAIL if limit is not None and self.plan is None else 1.0,
        )
        portion = _SHADOW_TRIANGLES if limit is None else limit // _OF_LIMIT
        self._last_shadows = replace(
            planned, portion=None if self.upload_seconds is None else portion, hurried=limit is not None
        )
        return self._last_shadows

    def _draw_samples(self, passes: Sequence[Pass[Any]], frame: Frame) -> Iterator[str]:
        """Run neighbouring passes that are `per_sample` once for each of a pixel's samples, the others once.

        Yields the names as `_draw` does.
        """
        if frame.targets.samples == 1:
            yield from self._draw(passes, frame)
            return
        for per_sample, run in groupby(passes, lambda pass_: pass_.per_sample):
            together = list(run)
            views = sample_views(frame.view, frame.targets.offsets) if per_sample else [frame.view]
            for number, seen in enumerate(views):
                yield from self._draw(together, replace(frame, view=seen, sample=number))

    def _draw(self, passes: Sequence[Pass[Any]], frame: Frame) -> Iterator[str]:
        """Run those of `passes` that have anything to draw, neighbours in one program where that is possible.

        Yields the name of each after it ran, of several the names joined by plus signs.
        """
        self._view_block.show(frame.view)
        groups = neighbours(self._enabled(passes, frame), self.passes, self.keeps if self.settings.fused else None)
        for group in groups:
            name, (pass_, own_frame, params) = " + ".join(each.pass_.name for each in group), group[0]
            parts = pass_.parts(own_frame, params) if len(group) == 1 else self._pixel_programs.parts(group)
            unfinished = True
            while unfinished:
                with self.timers.measure(name):
                    unfinished = next(parts, _END) is not _END
                if self.timers.may_be_long:  # each part by itself, lest a driver's watchdog end them all
                    self.device.context.finish()
                yield name

    def _enabled(self, passes: Sequence[Pass[Any]], frame: Frame) -> Iterator[DrawnPass]:
        """Yield those of `passes` that have anything to draw, each with the targets that it declares."""
        for pass_ in passes:
            if pass_.representation is not None and not frame.plan.draws(pass_.representation):
                continue
            drawn = DrawnPass(pass_, replace(frame, targets=self._declared[pass_]), pass_.params_in(self.settings))
            if pass_.enabled(drawn.frame, drawn.params):
                yield drawn

    def sample_shares(self) -> PixelShares:
        """Ask the GPU which representation drew the pixels of the frame drawn last; waits for nothing.

        Returns
        -------
        The object whose `count` counts these pixels, and waits for the GPU; it is the same in every call.
        """
        if self._shares is None:
            self._shares = PixelShares(self.device)
        if self.targets is not None and self.plan is not None:
            self._shares.sample(self.targets, self.plan)
        return self._shares

    def distance_at(self, across: float = 0.5, down: float = 0.5) -> float:
        """Return how far away the surface is that the frame drawn last shows at a place. Waits for that frame.

        Parameters
        ----------
        across : part of the picture's width, from the left edge, 0 to 1.
        down : part of the picture's height, from the upper edge, 0 to 1.

        Returns
        -------
        Metres along the view axis; +inf where no surface is, or before the first frame.
        """
        if self.targets is None or self.view is None:
            return float("inf")
        width, height = self.targets.size
        column, row = int(across * width), height - 1 - int(down * height)
        texel = min(max(column, 0), width - 1), min(max(row, 0), height - 1), 1, 1
        depth = np.frombuffer(self.targets.gbuffer.read(texel, attachment=-1, dtype="f4"), np.float32)
        return float(view_distance(depth, *self.view.depth_range)[0])

    def point_at(self, across: float, down: float) -> glm.dvec3 | None:
        """Return the world point that the frame drawn last shows at a place. Waits for that frame.

        Parameters
        ----------
        across : part of the picture's width, from the left edge, 0 to 1.
        down : part of the picture's height, from the upper edge, 0 to 1.

        Returns
        -------
        The point, metres, world; None where no surface is, or before the first frame.
        """
        distance = self.distance_at(across, down)
        if self.view is None or np.isinf(distance):
            return None
        return self.view.unproject(across, down, distance)

    def frame_all(self, aspect: float, fov: float = math.pi / 3, away: glm.dvec3 = _IN_FRONT) -> Camera:
        """Return a camera that sees every object of the scene.

        Parameters
        ----------
        aspect : width of the picture over its height.
        fov : vertical angle of view, radians.
        away : direction from the objects to the camera, world, of any length.

        Returns
        -------
        The camera, world, which looks at the middle of all objects; one near the origin where the scene has none.
        """
        bounds = self.world.bounds()
        if not len(bounds.bounding_radius):
            return Camera((0.0, 1.6, 5.0), (0.0, 1.0, 0.0), fov)
        middle, radius = bounds.sphere()
        narrower = min(fov, 2 * math.atan(math.tan(fov / 2) * aspect))
        target = glm.dvec3(middle)
        place = target + glm.normalize(away) * (radius / math.sin(narrower / 2))
        return Camera(components(place), components(target), fov)

    def _forget_assets(self) -> None:
        self._last_shadows = Shadows()
        for pass_ in self.passes:
            pass_.forget_assets()

    def release(self) -> None:
        """Free everything on the GPU. The passes may then serve another renderer."""
        self.assets.release()
        for pass_ in self.passes:
            pass_.release()
        if self._shares is not None:
            self._shares.release()
            self._shares = None
        self._gl.release()
        self._release_targets()
        for memory in (self._frames, self._fine):
            if memory is not None and memory.atlas is not None:
                memory.atlas.release()
                memory.atlas = None

    def _release_targets(self) -> None:
        self._frames.phases.resized()
        if self._fine is not None:
            self._fine.phases.resized()
        if self.targets is not None:
            self.targets.release()
        self.targets = None


def read_pixels(framebuffer: moderngl.Framebuffer) -> NDArray[np.uint8]:
    """Return the picture in a framebuffer. Waits until it is drawn.

    Parameters
    ----------
    framebuffer : what the picture was drawn into.

    Returns
    -------
    (H, W, 4) uint8, top row first.
    """
    width, height = framebuffer.size
    data = framebuffer.read(components=4, alignment=1)
    return np.frombuffer(data, np.uint8).reshape(height, width, 4)[::-1]
