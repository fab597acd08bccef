"""Draw a scene: find what is in sight, plan the frame, run its passes in order and time each.

`Renderer._render` is the outline of a frame, `render.passes` the order of its passes, `render.frame.Pass` what a pass
may rely on; docs/images/frame.svg shows the passes and the targets between them.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import moderngl
import numpy as np
from pyglm import glm

from depthwalk.gpu.device import Device
from depthwalk.gpu.timers import PassTimers
from depthwalk.render.antialiasing.modes import hardware_samples, supersampled
from depthwalk.render.culling.objects_part import MOST_OBJECTS, Part, objects_part
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.draw.material_depth import MaterialRecords, least_footprints, material_records
from depthwalk.render.draw.object_colours import polygon_errors
from depthwalk.render.draw.translucency_planner import TranslucencyPlanner, TranslucentDraws
from depthwalk.render.frame import Common, Frame, Pass, common_settings
from depthwalk.render.frame_memory import FRAME, FrameMemory, PictureKind
from depthwalk.render.image import has_texture
from depthwalk.render.lighting.image_sky import SkyImages
from depthwalk.render.lighting.irradiance import lighting
from depthwalk.render.lighting.sky import environment_sky
from depthwalk.render.occlusion_phases import InSight, PhaseInputs
from depthwalk.render.pass_sequence import PassSequence
from depthwalk.render.passes import default_passes
from depthwalk.render.pixel_shares import PixelShares
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.resources.library import Library
from depthwalk.render.shadow_planner import ShadowPlanner
from depthwalk.render.shadows.casters import Shadows
from depthwalk.render.targets import Targets
from depthwalk.render.view.framing import camera_on, facing
from depthwalk.render.view.view import View, view_distance
from depthwalk.render.world.frame_residency import FrameResidency
from depthwalk.render.world.render_world import RenderWorld
from depthwalk.scene.arrays import Camera
from depthwalk.scene.scene import Scene

# Triangles per frame into shadow maps that may wait where frames follow each other without a window, so that they take
# equally long.
_SHADOW_TRIANGLES = 400_000
_FIRST_DETAIL = 0.1  # part of the shadow maps' triangles that a window's first picture draws, so that it appears soon


class Renderer:
    """Draw one scene, frame by frame. Its settings and `scene.environment` may change between frames.

    Parameters
    ----------
    device : the GPU, whose context must be current whenever the renderer is used.
    scene : what is drawn; `world` must be told when its objects move.
    library : reads, bakes and caches the assets when they are first needed.
    passes : the passes of a frame in their order, for this renderer alone; None: `default_passes()`.

    Raises
    ------
    InputError
        For the picture of a sky that cannot be used.

    Attributes
    ----------
    settings : the render settings of the scene.
    passes : the passes in their order.
    remembers : whether a frame uses what earlier frames found, such as impostor tiles and what was in sight. If not, no
        frame depends on another.
    upload_seconds : seconds per frame for uploading assets, to keep the frame rate even; None: upload until all are
        resident (see `AssetStore.stream`), and draw shadow maps whole.
    warp_limit : triangles that a frame may warp, to keep the frame rate even. Tiles beyond the limit that cannot wait
        are warped at a coarser level, and again in later frames; None: no limit.
    keeps : names of targets that are read after the frame, besides those that the last pass writes. They are written
        even where passes share a program, which otherwise stores nothing in between (see `render.pixel_pass`).
    world : the objects in arrays, which must be told when they move.
    assets : the assets on the GPU.
    targets : the textures that passes draw into; None before the first frame.
    timers : milliseconds of each pass and of the steps on the CPU.
    plan : the draw lists of the frame drawn last; None before the first.
    view : the view of the frame drawn last, near and far plane fitted; None before the first.
    auxiliary_view : the same for the last picture of `auxiliary_steps`.
    """

    def __init__(
        self, device: Device, scene: Scene, library: Library, passes: Sequence[Pass[Any]] | None = None
    ) -> None:
        self._sky_images = SkyImages(library.sky_image)
        environment_sky(scene.environment, self._sky_images)  # finds files that cannot be used before the first frame
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
        self.plan: FrameDrawLists | None = None
        self.view: View | None = None
        self.auxiliary_view: View | None = None
        self.timers = PassTimers(device)
        self._memories: dict[PictureKind, FrameMemory] = {}
        self._last_shadows = Shadows()
        self._shadows = ShadowPlanner(self.world, self.timers)
        self._translucency = TranslucencyPlanner(self.world, self.assets)
        self._shares: PixelShares | None = None  # made on first use
        self._sequence = PassSequence(
            device, self.settings, self.timers, default_passes() if passes is None else passes
        )

    @property
    def passes(self) -> list[Pass[Any]]:
        """The passes in their order."""
        return self._sequence.passes

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

        Until the last step, the scene and its settings must not change, and no other picture may be begun. Whatever
        the caller draws in between must restore GL state and not touch the targets. Parameters: see `render`.

        Yields
        ------
        The name of the pass whose commands were just submitted to the GPU; all names, where several share a program.
        """
        for lens_point, seen in enumerate(self._sequence.views(view)):
            yield from self._render(FRAME, seen, screen, transparent, lens_point)
        self.timers.end_frame()

    def auxiliary_steps(self, kind: PictureKind, view: View, screen: moderngl.Framebuffer) -> Iterator[str]:
        """Draw a picture that is not a frame, in steps as `steps` does.

        What later frames remember stays as it is; only the contents of `targets` change. The caller may stop after any
        step.

        Parameters
        ----------
        kind : what it is for, such as `REFINED` or `SURROUNDING`.
        view, screen : see `render`.

        Yields
        ------
        As `steps` does.
        """
        try:
            yield from self._render(kind, view, screen)
        finally:
            self.timers.drop_frame()

    def rehearse(self, view: View, screen: moderngl.Framebuffer) -> None:
        """Draw a picture as `render` does and forget it, so that later ones need not wait for the shader compiler."""
        before, self.remembers = (self.remembers, self.plan, self.view), False
        try:
            self.render(view, screen)
        finally:
            self.remembers, self.plan, self.view = before
            self._forget_assets()

    def _render(
        self,
        kind: PictureKind,
        view: View,
        screen: moderngl.Framebuffer,
        transparent: bool = False,
        lens_point: int = 0,
    ) -> Iterator[str]:
        """Draw one picture in the steps that docs/architecture.md numbers; yield the names of the passes (`steps`)."""
        # 1. Cull: what the settings ask for, textures to draw into, and the objects that may be seen.
        self.device.state.restore()
        memory, common = self._memory(kind), self._common(view, screen, kind)
        view = replace(view, size=(view.size[0] * common.aa.samples, view.size[1] * common.aa.samples))
        targets = self._prepare_targets(view, common, memory)
        targets.screen = screen
        self.world.take_arrivals(view.position)
        self.world.show_moment(view.camera.time)
        self.world.table()  # loads what is not loaded yet
        in_sight = memory.phases.in_sight(view)
        view = in_sight.fitted(view, self.scene.environment.ground)

        # 2. Draw the objects: each phase is planned, uploaded and drawn, and hides some of those that are left.
        self.assets.budget = self.settings.gpu_memory
        residency = FrameResidency(self.world, self.assets, self.upload_seconds, releases=not kind.yields)
        light = lighting(self.scene.environment, self._sky_images)
        frame_of = partial(
            Frame,
            view=view,
            common=common,
            environment=self.scene.environment,
            light=light,
            assets=self.assets,
            targets=targets,
            transparent=transparent,
            lens_point=lens_point,
            objects_part=self._objects_part(view, in_sight),
        )
        materials_of = partial(self._materials, view, fits=not kind.yields)
        phases = PhaseInputs(
            view=view,
            targets=targets,
            residency=residency,
            remembers=self.remembers and kind.is_frame,
            warp_limit=self.warp_limit if kind.is_frame else None,
            tile_light=light.key if common.lit_tiles else None,
        )
        plans: list[FrameDrawLists] = []
        for plan in memory.phases.plans(phases, in_sight):
            plans.append(plan)
            if common.lit_tiles:
                materials_of(plan)  # pass 1 looks textures up
            yield from self._sequence.draw_objects(frame_of(plan=plan))

        # 3. Join the phases: what is shaded, what lets light through, and what the shadow maps hold.
        whole = FrameDrawLists.joined(plans)
        if self.settings.inspection.how_drawn == "error":
            allowed = self.settings.mesh.error
            whole.polygon_error = polygon_errors(view, whole.polygons, self.world.table(), allowed)
        frame = frame_of(plan=whole, materials=materials_of(whole), translucent=self._translucent(view))
        frame = replace(frame, shadows=self._shadow_maps(kind, frame, residency))

        # 4. Finish, once for all phases: materials, shadows, light, post-processing.
        yield from self._sequence.finish(frame, self.keeps)
        self._note(kind, whole, view)

    def _note(self, kind: PictureKind, whole: FrameDrawLists, view: View) -> None:
        """Keep the view of a picture and, of a frame, its draw lists with further counts for the HUD."""
        whole.noted["full_triangles"] = self.world.table().full_triangles
        whole.noted["assets"] = self.assets.depth_count
        whole.noted["gpu_mb"] = self.assets.gpu_bytes / 1e6
        if kind.is_frame:
            self.plan, self.view = whole, view
        else:
            self.auxiliary_view = view

    def _memory(self, kind: PictureKind) -> FrameMemory:
        """Return the memory that pictures of a kind share, made when the first is drawn."""
        if kind not in self._memories:
            self._memories[kind] = FrameMemory(self.device, self.settings, self.world, self.timers)
        return self._memories[kind]

    def _common(self, view: View, screen: moderngl.Framebuffer, kind: PictureKind) -> Common:
        """Return the settings that several passes read, for a picture of `view` in `screen`."""
        shared = common_settings(self.settings)
        if kind.supersampled:
            shared = replace(shared, aa=supersampled(shared.aa))
        if "lit" in self.keeps or not has_texture(screen, view.size):
            shared = replace(shared, aa=replace(shared.aa, shown=False))
        return shared

    def _prepare_targets(self, view: View, common: Common, memory: FrameMemory) -> Targets:
        """Return cleared targets for `view`, reusing those of the last picture where they fit."""
        samples = hardware_samples(self.settings, self.device)
        size, atlas = view.size, memory.atlas(view, common.lit_tiles)
        targets = self.targets
        same = targets is not None and (targets.size, targets.samples) == (size, samples)
        if targets is None or not same or targets.tile_atlas is not atlas:
            self._release_targets()
            targets = Targets(self.device, size, samples, atlas)
            try:
                self._sequence.use(targets)
            except BaseException:
                targets.release()
                raise
            self.targets = targets
        # Only GPAA reads albedo and normals where nothing is drawn.
        cleared = targets.polygons if common.aa.geometric else targets.visibility
        cleared.clear(depth=1.0)
        return targets

    def _objects_part(self, view: View, in_sight: InSight) -> Part | None:
        """Return the part of the picture that holds all surfaces.

        None where there are too many, or a ground, and where `PixelPrograms` draws the whole picture anyway.
        """
        environment = self.scene.environment
        if not self.device.software or environment.sky is not None or environment.ground is not None:
            return None
        if in_sight.batches or len(in_sight.far_cells) or len(in_sight.rows) > MOST_OBJECTS:
            return None
        with self.timers.measure_cpu("plan"):
            return objects_part(view, self.world.cylinders(in_sight.rows))

    def _materials(self, view: View, plan: FrameDrawLists, *, fits: bool) -> MaterialRecords:
        """Return the records of the depth-image objects of `plan` for `material_resolve`, and stream their textures.

        fits: whether textures that are on the GPU may become finer or coarser, as this view needs them.
        """
        with self.timers.measure_cpu("plan"):
            materials = material_records(view, self.world.arrays(), plan.object_rows, plan.tiled)
        if self.assets.textures.has_partial:
            with self.timers.measure_cpu("upload"):
                asset = self.world.objects().asset[plan.object_rows]
                footprint = least_footprints(view, asset, materials, self.world.table())
                numbers, exact = materials.assets.tolist(), not self.remembers
                self.assets.textures.fit(numbers, footprint, self.upload_seconds, exact=exact, changes=fits)
        return materials

    def _translucent(self, view: View) -> TranslucentDraws:
        """Return the draws of what lets light through or glows in `view`."""
        with self.timers.measure_cpu("plan"):
            smallest, wait = self.settings.culling.min_pixels, self.assets.background is None
            return self._translucency.plan(view, smallest, wait=wait)

    def _shadow_maps(self, kind: PictureKind, frame: Frame, residency: FrameResidency) -> Shadows:
        """Return what the shadow maps of sun and lamps are to show in `frame`."""
        if not kind.is_frame:
            return replace(self._last_shadows, portion=0) if kind.yields else self._last_shadows
        settings, lamps, limit = self.settings, frame.environment.lights, self.warp_limit
        planned = self._shadows.plan(
            frame.view,
            frame.light,
            lamps,
            settings.shadows,
            magnification=settings.lod.magnification,
            uploads=residency,
            may_wait=self.remembers,
            detail=_FIRST_DETAIL if limit is not None and self.plan is None else 1.0,
        )
        portion = _SHADOW_TRIANGLES if self.upload_seconds is None else None
        if limit is not None:
            portion = limit // 2
        self._last_shadows = replace(planned, portion=portion, interactive=limit is not None)
        return self._last_shadows

    def sample_shares(self) -> PixelShares:
        """Sample which representation drew the pixels of the frame drawn last, without waiting for the GPU.

        Returns
        -------
        The sampler, the same in every call; its `count` returns the numbers of pixels and waits for the GPU.
        """
        if self._shares is None:
            self._shares = PixelShares(self.device)
        if self.targets is not None and self.plan is not None:
            self._shares.sample(self.targets, self.plan)
        return self._shares

    def distance_at(self, across: float = 0.5, down: float = 0.5) -> float:
        """Return the distance of the surface at a place of the frame drawn last. Waits for that frame.

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
        """Return the surface point at a place of the frame drawn last, in the world, metres. Waits for that frame.

        The place is given as in `distance_at`. None where no surface is, or before the first frame.
        """
        distance = self.distance_at(across, down)
        if self.view is None or np.isinf(distance):
            return None
        return self.view.unproject(across, down, distance)

    def frame_all(
        self, aspect: float, fov: float = math.pi / 3, away: glm.dvec3 | None = None, turns: bool = False
    ) -> Camera:
        """Return a camera that sees every object of the scene; see `render.view.framing.camera_on`.

        Where `away` is None, `render.view.framing.facing` chooses the direction.
        """
        shown = self.world.objects(), self.world.bounds(), self.world.extremes
        return camera_on(*shown, aspect=aspect, fov=fov, away=away or facing(*shown), turns=turns)

    def _forget_assets(self) -> None:
        self._last_shadows = Shadows()
        self._sequence.forget_assets()

    def release(self) -> None:
        """Free everything on the GPU. The passes may then serve another renderer."""
        self.assets.release()
        self._sequence.release()
        if self._shares is not None:
            self._shares.release()
            self._shares = None
        self._release_targets()
        for memory in self._memories.values():
            memory.release_atlas()

    def _release_targets(self) -> None:
        for memory in self._memories.values():
            memory.phases.resized()
        if self.targets is not None:
            self.targets.release()
        self.targets = None
