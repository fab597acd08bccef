"""A scene to pictures: plans the frame, runs the passes in order, times each.

GL state between passes: the defaults of `gpu.state.State`, and whichever framebuffer the last one used.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.gpu.device import Device
from depthwalk.gpu.timers import PassTimers
from depthwalk.render.antialiasing.modes import AntiAliasing, hardware_samples, sample_views
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.draw.material_depth import MaterialRecords, shading
from depthwalk.render.frame import Frame, Pass, common
from depthwalk.render.lighting.irradiance import lighting
from depthwalk.render.occlusion_phases import InSight, OcclusionPhases
from depthwalk.render.passes import default_passes
from depthwalk.render.resources.asset_store import AssetStore, Library
from depthwalk.render.shadow_planner import ShadowPlanner
from depthwalk.render.targets import Targets, declared
from depthwalk.render.view.bounds import depth_range, ground_range
from depthwalk.render.view.view import View, view_distance
from depthwalk.render.view.view_block import PICTURE_VIEW, ViewBlock
from depthwalk.render.world.render_world import FrameResidency, RenderWorld
from depthwalk.scene.arrays import Camera
from depthwalk.scene.scene import Scene

_IN_FRONT = glm.dvec3(0, 0.25, 1)  # the direction from which all is seen, a little from above


class Renderer:
    """Draws one scene. `settings` and `scene.environment` may change between frames.

    passes: what a frame consists of, in this order, for this renderer alone; None: `default_passes()`.
    """

    def __init__(
        self, device: Device, scene: Scene, library: Library, passes: Sequence[Pass[Any]] | None = None
    ) -> None:
        self.device = device
        self.scene = scene
        self.settings = scene.render
        self.assets = AssetStore(device, library)
        self.assets.before_release = self._forget_arrays
        self.world = RenderWorld(scene, library, self.assets)
        self.remembers = False  # frames use what those before found: tiles, what was seen; else none depends on another
        self.upload_seconds: float | None = None  # of a frame, see `AssetStore.stream`
        self.targets: Targets | None = None
        self.timers = PassTimers(device)
        self._phases = OcclusionPhases(device, scene.render, self.world, self.timers)
        self._gl = device.scope("view")
        self._view_block = ViewBlock(self._gl, PICTURE_VIEW)
        self._shadows = ShadowPlanner(self.world, self.timers)
        self.passes: list[Pass[Any]] = []
        try:
            for each in default_passes() if passes is None else passes:
                each.attach(device)
                self.passes.append(each)
        except BaseException:
            self.release()
            raise
        self.plan: FrameDrawLists | None = None  # of the frame drawn last
        self.view: View | None = None  # of the frame drawn last, near and far plane fitted

    def render(self, view: View, screen: moderngl.Framebuffer, transparent: bool = False) -> None:
        """Draws what `view` sees of the scene into `screen`, which has the view's size. Supersampled, the targets and
        the view of the passes before `output` are larger by that."""
        views = [view]
        for each in self.passes:
            views = [seen for whole in views for seen in each.views(whole, each.params_in(self.settings))]
        for lens_point, seen in enumerate(views):
            self._render(seen, screen, transparent, lens_point)
        self.timers.end_frame()

    def _render(self, view: View, screen: moderngl.Framebuffer, transparent: bool, lens_point: int) -> None:
        settings, environment = self.settings, self.scene.environment
        by = common(settings)
        view = replace(view, size=(view.size[0] * by.aa.samples, view.size[1] * by.aa.samples))
        targets = self._prepare_targets(view.size, hardware_samples(settings, self.device), by.aa)
        targets.screen = screen
        self.world.table()  # loads what is not loaded yet
        in_sight = self._phases.in_sight(view)
        view = self._fitted(view, in_sight)
        self.assets.budget = settings.gpu_memory
        residency = FrameResidency(self.world, self.assets, self.upload_seconds)
        light = lighting(environment)
        frame_of = partial(
            Frame,
            view=view,
            common=by,
            environment=environment,
            light=light,
            assets=self.assets,
            targets=targets,
            transparent=transparent,
            lens_point=lens_point,
        )
        plans: list[FrameDrawLists] = []
        for plan in self._phases.plans(view, in_sight, targets, residency, self.remembers):
            plans.append(plan)
            self._draw([each for each in self.passes if each.draws_objects], frame_of(plan=plan))
        self.plan, self.view = FrameDrawLists.joined(plans), view
        shaded = self._shading(view, self.plan)
        shadows = self._shadows.plan(
            view, light, environment.lights, settings.shadows, settings.lod.magnification, residency, self.remembers
        )
        frame = frame_of(plan=self.plan, shading=shaded, shadows=shadows)
        self._draw_samples([each for each in self.passes if not each.draws_objects], frame)
        self.plan.counts["assets"] = self.assets.depth_count
        self.plan.counts["gpu_mb"] = self.assets.gpu_bytes / 1e6

    def _draw_samples(self, passes: Sequence[Pass[Any]], frame: Frame) -> None:
        """Runs of passes that are `per_sample` once for each of a pixel's samples, the others once."""
        targets = frame.targets
        for per_sample, run in groupby(passes, lambda each: each.per_sample):
            several = per_sample and targets.samples > 1
            together, views = list(run), sample_views(frame.view, targets.offsets) if several else [frame.view]
            for number, seen in enumerate(views):
                self._draw(together, replace(frame, view=seen, sample=number))

    def _draw(self, passes: Sequence[Pass[Any]], frame: Frame) -> None:
        self._view_block.show(frame.view)
        for each in passes:
            params = each.params_in(self.settings)
            own = replace(frame, targets=declared(frame.targets, each.name, each.reads, each.writes))
            if each.enabled(own, params):
                with self.timers.measure(each.name):
                    each.draw(own, params)

    def distance_at(self, across: float = 0.5, down: float = 0.5) -> float:
        """Metres along the view axis to what the frame drawn last shows there; +inf where nothing is. Waits for that
        frame. across, down: parts of the picture's width and height, from its upper left corner."""
        if self.targets is None or self.view is None:
            return float("inf")
        width, height = self.targets.size
        column, row = int(across * width), height - 1 - int(down * height)
        texel = min(max(column, 0), width - 1), min(max(row, 0), height - 1), 1, 1
        depth = np.frombuffer(self.targets.gbuffer.read(texel, attachment=-1, dtype="f4"), np.float32)
        return float(view_distance(depth, *self.view.depth_range)[0])

    def point_at(self, across: float, down: float) -> glm.dvec3 | None:
        """Return the world point that the frame drawn last shows there; None where nothing is. See `distance_at`."""
        distance = self.distance_at(across, down)
        if self.view is None or np.isinf(distance):
            return None
        return self.view.unproject(across, down, distance)

    def frame_all(self, aspect: float, fov: float = math.pi / 3, away: glm.dvec3 = _IN_FRONT) -> Camera:
        """Return a camera that sees every object.

        Parameters
        ----------
        aspect : width over height of the picture.
        fov : vertical angle of view, radians.
        away : the world direction, of any length, from the objects to the camera.
        """
        bounds = self.world.bounds()
        if not len(bounds.bounding_radius):
            return Camera((0.0, 1.6, 5.0), (0.0, 1.0, 0.0), fov)
        middle, radius = bounds.sphere()
        narrower = min(fov, 2 * math.atan(math.tan(fov / 2) * aspect))
        target = glm.dvec3(middle)
        place = target + glm.normalize(away) * (radius / math.sin(narrower / 2))
        return Camera(place.to_tuple(), target.to_tuple(), fov)

    def _fitted(self, view: View, in_sight: InSight) -> View:
        """`view` with near and far plane about what is `in_sight`, and about the ground."""
        if view.near is not None and view.far is not None:
            return view
        ground = self.scene.environment.ground
        seen_ground = ground_range(view, ground.height, ground.half_size) if ground is not None else None
        near, far = depth_range(in_sight.forward, in_sight.bounding_radius, seen_ground)
        return replace(view, near=near, far=far)

    def _shading(self, view: View, plan: FrameDrawLists) -> MaterialRecords:
        with self.timers.measure_cpu("plan"):
            objects, bounds = self.world.objects().take(plan.numbered), self.world.bounds().take(plan.numbered)
            return shading(view, objects, bounds, plan.tiled)

    def _forget_arrays(self) -> None:
        for each in self.passes:
            each.forget_assets()

    def release(self) -> None:
        self.assets.release()
        for each in self.passes:
            each.release()
        self._gl.release()
        self._release_targets()

    def _release_targets(self) -> None:
        self._phases.resized()
        if self.targets is not None:
            self.targets.release()
        self.targets = None

    def _prepare_targets(self, size: tuple[int, int], samples: int, aa: AntiAliasing) -> Targets:
        """Those of that size, cleared."""
        if self.targets is None or (self.targets.size, self.targets.samples) != (size, samples):
            self._release_targets()
            self.targets = Targets(self.device, size, samples)
            for each in self.passes:
                each.resize(size)
        # Only GPAA reads albedo and normals where nothing is.
        cleared = self.targets.polygons if aa.geometric else self.targets.visible
        cleared.clear(depth=1.0)
        return self.targets


def read_pixels(framebuffer: moderngl.Framebuffer) -> NDArray[np.uint8]:
    """The picture (H, W, 4) uint8, top row first."""
    width, height = framebuffer.size
    data = framebuffer.read(components=4, alignment=1)
    return np.frombuffer(data, np.uint8).reshape(height, width, 4)[::-1]
