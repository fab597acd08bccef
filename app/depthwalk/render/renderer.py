"""A scene to pictures: plans the frame, runs the passes in order, times each.

GL state between passes: whichever framebuffer the last one used; a pass sets what it needs by `enable_only`, and
wireframe is off. Depth function LESS, counter-clockwise faces are front.
"""

import logging
import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import moderngl
import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.gpu.device import Device
from depthwalk.gpu.timers import PassTimers
from depthwalk.render.antialiasing import geometric, hardware_samples, sample_views, samples
from depthwalk.render.assets import AssetStore, Library
from depthwalk.render.bounds import depth_range, ground_range
from depthwalk.render.cascades import fit_cascades
from depthwalk.render.casters import MapView, Shadows, find_casters, shadow_map
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.frame_plan import FramePlan
from depthwalk.render.lens import lens_views
from depthwalk.render.passes import PASSES
from depthwalk.render.placed import Placed, Uploads
from depthwalk.render.rounds import InSight, Rounds
from depthwalk.render.shading import shading
from depthwalk.render.sky import direction_to_sun, sunlight
from depthwalk.render.spots import assign_tiles, shadowing, spot_of
from depthwalk.render.stand_ins import StandInRule
from depthwalk.render.targets import Targets
from depthwalk.render.view import View, view_distance
from depthwalk.render.view_block import PICTURE_VIEW, ViewBlock
from depthwalk.scene.arrays import Camera
from depthwalk.scene.scene import Scene

log = logging.getLogger(__name__)

_IN_FRONT = glm.dvec3(0, 0.25, 1)  # the direction from which all is seen, a little from above


class Renderer:
    """Draws one scene. `settings` and `scene.environment` may change between frames."""

    def __init__(self, device: Device, scene: Scene, library: Library) -> None:
        self.device = device
        self.scene = scene
        self.settings = scene.render
        self.assets = AssetStore(device, library)
        self.assets.before_release = self._forget_arrays
        self.placed = Placed(scene, library, self.assets)
        self.remembers = False  # frames use what those before found: tiles, what was seen; else none depends on another
        self.upload_seconds: float | None = None  # of a frame, see `AssetStore.stream`
        self.targets: Targets | None = None
        self.timers = PassTimers(device)
        self._rounds = Rounds(device, scene.render, self.placed, self.timers)
        self.passes: list[Pass] = []
        self._gl = device.scope("view")
        self._view_block = ViewBlock(self._gl, PICTURE_VIEW)
        try:
            self.passes += (make(device) for make in PASSES)
        except BaseException:
            self.release()
            raise
        self._told_of_lamps = False
        self.plan: FramePlan | None = None  # of the frame drawn last
        self.view: View | None = None  # of the frame drawn last, near and far plane fitted

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
        targets = self._targets(view.size, hardware_samples(settings, self.device))
        self.placed.table()  # loads what is not loaded yet
        in_sight = self._rounds.in_sight(view)
        view = self._fitted(view, in_sight)
        # Only GPAA reads albedo and normals where nothing is.
        cleared = targets.polygons if geometric(settings) else targets.visible
        cleared.use()
        cleared.clear(depth=1.0)
        surroundings = self.scene.environment, self.assets, targets, screen
        self.assets.budget = settings.gpu_memory
        uploads = Uploads(self.placed, self.assets, self.upload_seconds)
        draw_objects = [each for each in self.passes if each.draws_objects]
        rounds: list[FramePlan] = []
        for plan in self._rounds.plans(view, in_sight, targets, uploads, self.remembers):
            rounds.append(plan)
            self._draw(draw_objects, Frame(view, plan, settings, *surroundings, transparent))
        self.plan, self.view = FramePlan.joined(rounds), view
        with self.timers.measure_cpu("plan"):
            drawn, placed = self.plan.numbered, self.placed
            shaded = shading(view, placed.objects().take(drawn), placed.bounds().take(drawn), self.plan.tiled)
        shadows = self._shadows(view, uploads)
        frame = Frame(view, self.plan, settings, *surroundings, transparent, shaded, shadows, lens_point)
        others = [each for each in self.passes if not each.draws_objects]
        for per_sample, passes in groupby(others, lambda each: each.per_sample):
            several = per_sample and targets.samples > 1
            together, views = list(passes), sample_views(view, targets.offsets) if several else [view]
            for number, seen in enumerate(views):
                self._draw(together, replace(frame, view=seen, sample=number))
        self.plan.counts["assets"] = self.assets.depth_count
        self.plan.counts["gpu_mb"] = self.assets.gpu_bytes / 1e6

    def _draw(self, passes: Sequence[Pass], frame: Frame) -> None:
        self._view_block.show(frame.view)
        for each in passes:
            with self.timers.measure(each.name):
                each.draw(frame)

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
        bounds = self.placed.bounds()
        if not len(bounds.reach):
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
        seen_ground = ground_range(view, ground.height, ground.size) if ground is not None else None
        near, far = depth_range(in_sight.forward, in_sight.reach, seen_ground)
        return replace(view, near=near, far=far)

    def _shadows(self, view: View, uploads: Uploads) -> Shadows:
        """The shadow maps of sun and lamps, and what casts shadows in each."""
        params, environment, placed = self.settings.shadows, self.scene.environment, self.placed
        with self.timers.measure_cpu("cull"):
            by_sun = params.enabled and sunlight(environment).any()
            cascades = fit_cascades(view, direction_to_sun(environment), params) if by_sun else ()
            chosen = shadowing(view, environment.lights)
            tiles = assign_tiles(chosen[: params.lamps], environment.lights, params.lamps)
            self._tell_of_lamps(len(chosen), params.lamps)
            spots = [spot_of(environment.lights[number], params.lamp_resolution) for number in tiles]
            views: list[MapView] = [*cascades, *spots]
            found = [find_casters(each, placed.bounds()) for each in views]
        with self.timers.measure_cpu("upload"):
            casters = [rows[uploads.there(rows)] for rows in found]
        with self.timers.measure_cpu("plan"):
            scene = placed.arrays()
            fewer = [4.0**-k for k in range(len(cascades))] + [1.0] * len(spots)  # far from the viewer, edges are small
            rule = StandInRule(self.settings.lod.magnification, uploads.stand_in, params.error)
            maps = [
                shadow_map(each, rows, scene, rule, params.triangles_per_texel * part)
                for each, rows, part in zip(views, casters, fewer, strict=True)
            ]
        of_lamps = dict(zip(tiles.values(), maps[len(cascades) :], strict=True))
        return Shadows(tuple(maps[: len(cascades)]) if by_sun else None, self.remembers, of_lamps, tiles)

    def _tell_of_lamps(self, wanted: int, allowed: int) -> None:
        """Warns once that some of the lamps in sight cast no shadows, though they should."""
        if wanted > allowed > 0 and not self._told_of_lamps:
            self._told_of_lamps = True
            log.warning("%d lamps in sight are to cast shadows; render.shadows.lamps allows %d", wanted, allowed)

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
        self._rounds.resized()
        if self.targets is not None:
            self.targets.release()
        self.targets = None

    def _targets(self, size: tuple[int, int], samples: int) -> Targets:
        if self.targets is None or (self.targets.size, self.targets.samples) != (size, samples):
            self._release_targets()
            self.targets = Targets(self.device, size, samples)
            for each in self.passes:
                each.resize(size)
        return self.targets


def read_pixels(framebuffer: moderngl.Framebuffer) -> NDArray[np.uint8]:
    """The picture (H, W, 4) uint8, top row first."""
    width, height = framebuffer.size
    data = framebuffer.read(components=4, alignment=1)
    return np.frombuffer(data, np.uint8).reshape(height, width, 4)[::-1]
