"""Shadows of sun and lamps: maps of depth seen along their light, and what part of the sun's reaches each pixel."""

from collections.abc import Mapping
from typing import ClassVar

import moderngl
import numpy as np

from depthwalk.gpu.device import DEPTH_CLAMP
from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.params import Params
from depthwalk.render.cascades import MOST, Cascade, ShadowParams, light_axes
from depthwalk.render.casters import ShadowMap
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.grids import GRID_LAYOUT
from depthwalk.render.lod import error_at_a_metre
from depthwalk.render.polygons import POSITION_LAYOUT
from depthwalk.render.records import PLACED_RECORD
from depthwalk.render.shadow_atlas import ShadowAtlas
from depthwalk.render.sky import direction_to_sun
from depthwalk.render.view import matrix_bytes


class ShadowsPass(Pass):
    """A map that would show what it shows already is not drawn again."""

    name = "shadows"
    per_sample = True
    reads = ("gbuffer",)
    writes = ("shadow", "lamp_maps")
    Params: ClassVar[type[Params]] = ShadowParams

    def setup(self) -> None:
        self._grid = Variants(lambda defines: Program(self.gl, "shadows/grid.vert", "shadows/map.frag", defines))
        self._grid_arrays = Variants(lambda defines: AssetArrays(self.gl, self._grid[defines].gl, *GRID_LAYOUT))
        self._mesh = Program(self.gl, "shadows/mesh.vert", "shadows/map.frag")
        self._mesh_arrays = AssetArrays(self.gl, self._mesh.gl, *POSITION_LAYOUT)
        self._instances = InstanceStream(self.gl, PLACED_RECORD)
        self._sun = Program(self.gl, "common/far_plane.vert", "shadows/sun.frag")
        self._sun_array = self.gl.vertex_array(self._sun.gl, [])
        self._of_sun = ShadowAtlas(self.gl, columns=2)
        self._of_lamps = ShadowAtlas(self.gl, columns=4)

    def draw(self, frame: Frame) -> None:
        params, shadows = frame.settings.shadows, frame.shadows
        if shadows.lamps:
            self._of_lamps.fit(params.lamps, params.lamp_resolution)
            self._draw_maps(frame, self._of_lamps, self._of_lamps.stale(shadows.lamps))
        frame.targets.lamp_maps = self._of_lamps.texture if shadows.lamps else None
        if shadows.sun is None:
            self._of_sun.release()
            return
        if shadows.sun:
            self._of_sun.fit(len(shadows.sun), params.resolution)
            context = self.gl.device.context
            context.enable_direct(DEPTH_CLAMP)  # what is nearer to the sun than the map begins casts shadows as well
            wanted = dict(enumerate(shadows.sun))
            self._draw_maps(frame, self._of_sun, (self._of_sun.due if shadows.may_wait else self._of_sun.stale)(wanted))
            context.disable_direct(DEPTH_CLAMP)
        shown = [self._of_sun.shown(tile).view for tile in range(len(shadows.sun))]
        self._draw_shares(frame, [view for view in shown if isinstance(view, Cascade)])

    def _draw_maps(self, frame: Frame, atlas: ShadowAtlas, maps: Mapping[int, ShadowMap]) -> None:
        """By their tiles."""
        for tile, shadow_map in maps.items():
            atlas.begin(tile, shadow_map)
            self._draw_grids(frame, shadow_map)
            self._draw_meshes(frame, shadow_map)
            frame.plan.counts["shadow_maps"] += 1
            frame.plan.counts["shadow_triangles"] += shadow_map.triangles

    def _draw_grids(self, frame: Frame, shadow_map: ShadowMap) -> None:
        context, view = self.gl.device.context, shadow_map.view
        self._instances.upload(shadow_map.grids.records)
        context.enable_only(moderngl.DEPTH_TEST)  # backs, too: they close what images miss of the fronts
        for number, groups in shadow_map.grids.by_asset():
            asset = frame.assets.depth_object(number)
            program, array = self._grid[asset.defines], asset.array(self._grid_arrays[asset.defines], number)
            asset.use_geometry(program, 0, frame.settings.lod, view.texel)
            program.set(clip_from_centre=matrix_bytes(view.clip_from_centre), light=view.light)
            for group in groups:
                self._instances.bind(array, group.first)
                asset.draw(array, group.indices, group.count)

    def _draw_meshes(self, frame: Frame, shadow_map: ShadowMap) -> None:
        context = self.gl.device.context
        self._instances.upload(shadow_map.meshes.records)
        self._mesh.set(clip_from_centre=matrix_bytes(shadow_map.view.clip_from_centre))
        for group in shadow_map.meshes.groups:
            asset = frame.assets.meshes.object(group.asset, group.level)
            array = self._mesh_arrays.get((group.asset, group.level), asset.vertices, asset.indices)
            context.enable_only(moderngl.DEPTH_TEST | (moderngl.CULL_FACE if asset.look.solid else moderngl.NOTHING))
            self._instances.bind(array, group.first)
            array.render(instances=group.count)

    def _draw_shares(self, frame: Frame, cascades: list[Cascade]) -> None:
        params, targets = frame.settings.shadows, frame.targets
        targets.shadow.use()
        self.gl.device.context.enable_only(moderngl.NOTHING)
        targets.depth.use(0)
        targets.surface.use(1)
        if self._of_sun.texture is not None:
            self._of_sun.texture.use(2)
        axes = light_axes(direction_to_sun(frame.environment)) * np.array([[1], [1], [-1]])
        places = np.zeros((MOST, 4), np.float32)
        for place, cascade in zip(places, cascades, strict=False):
            place[:3] = axes @ (frame.view.position - cascade.centre) / (2 * cascade.half) + 0.5
            place[3] = 1 / (2 * cascade.half)
        self._sun.set(
            depth_texture=0,
            surface_texture=1,
            maps=2,
            depth_range=frame.view.depth_range,
            ray_from_screen=matrix_bytes(frame.view.ray_from_screen),
            cascades=len(cascades),
            light_from_world=matrix_bytes(axes),
            places=places.tobytes(),
            resolution=params.resolution,
            filter_width=params.filter_width,
            error=params.worst_error,
            seen_error=error_at_a_metre(frame.view, frame.settings.lod),
            reach=params.distance,
        )
        self._sun_array.render(moderngl.TRIANGLES, vertices=3)

    def forget_assets(self) -> None:
        for arrays in self._grid_arrays.values():
            arrays.forget()
        self._mesh_arrays.forget()
        self._of_sun.forget()
        self._of_lamps.forget()
