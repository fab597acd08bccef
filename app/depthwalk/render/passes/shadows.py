"""Shadow maps of sun and lamps: depth seen along their light."""

from collections.abc import Mapping

from depthwalk.cook.lod_geometry import GRID_LAYOUT
from depthwalk.gpu.device import DEPTH_CLAMP, Scope
from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import LESS
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.mesh_object import POSITION_LAYOUT
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.render.shadows.cascades import Cascade
from depthwalk.render.shadows.casters import ShadowMap
from depthwalk.render.shadows.shadow_atlas import ShadowAtlas
from depthwalk.render.shadows.sun_uniforms import COLUMNS, LampMaps, SunMaps
from depthwalk.render.view.view_block import MAP_VIEW, ViewBlock
from depthwalk.scene.render_settings import ShadowParams


class ShadowsPass(Pass[ShadowParams]):
    """A map that would show what it shows already is not drawn again."""

    name = "shadows"
    writes = ("sun_maps", "lamp_maps")

    def setup(self, gl: Scope) -> None:
        self._view = ViewBlock(gl, MAP_VIEW)
        shaders = "shadows/grid.vert", "shadows/map.frag"
        self._grid = Variants(lambda defines: Program(gl, *shaders, defines, {"View": MAP_VIEW}))
        self._grid_arrays = Variants(lambda defines: AssetArrays(gl, self._grid[defines].gl, *GRID_LAYOUT))
        self._mesh = Program(gl, "shadows/mesh.vert", "shadows/map.frag", blocks={"View": MAP_VIEW})
        self._mesh_arrays = AssetArrays(gl, self._mesh.gl, *POSITION_LAYOUT)
        self._instances = InstanceStream(gl, PLACED_RECORD)
        self._of_sun = ShadowAtlas(gl, columns=COLUMNS)
        self._of_lamps = ShadowAtlas(gl, columns=4)
        self._shown = False  # whether there are maps that show something

    def enabled(self, frame: Frame, params: ShadowParams) -> bool:
        return bool(frame.shadows.lamps) or frame.shadows.sun is not None or self._shown

    def draw(self, frame: Frame, params: ShadowParams) -> None:
        shadows, targets = frame.shadows, frame.targets
        if shadows.lamps:
            texture = self._of_lamps.fit(params.lamps, params.lamp_resolution)
            self._draw_maps(frame, self._of_lamps, self._of_lamps.stale(shadows.lamps))
            targets.lamp_maps = LampMaps(texture=texture, params=params)
        else:
            targets.lamp_maps = None
        targets.sun_maps = self._draw_sun_maps(frame, params, shadows.sun) if shadows.sun else None
        if shadows.sun is None:
            self._of_sun.release()
        self._shown = bool(shadows.lamps or shadows.sun)

    def _draw_sun_maps(self, frame: Frame, params: ShadowParams, maps: tuple[ShadowMap, ...]) -> SunMaps:
        texture = self._of_sun.fit(len(maps), params.resolution)
        wanted = dict(enumerate(maps))
        due = self._of_sun.due(wanted) if frame.shadows.may_wait else self._of_sun.stale(wanted)
        with self.gl.state(direct=(DEPTH_CLAMP,)):  # what is nearer to the sun than the map begins casts shadows too
            self._draw_maps(frame, self._of_sun, due)
        shown = [self._of_sun.shown(tile).view for tile in wanted]
        cascades = tuple(view for view in shown if isinstance(view, Cascade))
        return SunMaps(texture=texture, cascades=cascades, params=params)

    def _draw_maps(self, frame: Frame, atlas: ShadowAtlas, maps: Mapping[int, ShadowMap]) -> None:
        """By their tiles."""
        for tile, shadow_map in maps.items():
            atlas.begin(tile, shadow_map)
            self._view.show(shadow_map.view)
            with self.gl.state(depth_test=LESS):
                self._draw_grids(frame, shadow_map)
                self._draw_meshes(frame, shadow_map)
            frame.plan.counts["shadow_maps"] += 1
            frame.plan.counts["shadow_triangles"] += shadow_map.triangles

    def _draw_grids(self, frame: Frame, shadow_map: ShadowMap) -> None:
        """Fronts and backs: these close what images miss of the fronts."""
        self._instances.upload(shadow_map.grids.records)
        for number, groups in shadow_map.grids.by_asset():
            asset = frame.assets.depth_object(number)
            program, array = self._grid[asset.defines], asset.array(self._grid_arrays[asset.defines], number)
            asset.use_geometry(program, 0, frame.common.lod)
            for group in groups:
                self._instances.bind(array, group.first)
                asset.draw(array, group.indices, group.count)

    def _draw_meshes(self, frame: Frame, shadow_map: ShadowMap) -> None:
        self._instances.upload(shadow_map.meshes.records)
        for group in shadow_map.meshes.groups:
            asset = frame.assets.meshes.object(group.asset, group.level)
            array = self._mesh_arrays.get((group.asset, group.level), asset.vertices, asset.indices)
            self._instances.bind(array, group.first)
            with self.gl.state(cull=asset.look.solid):
                array.render(instances=group.count)

    def forget_assets(self) -> None:
        for arrays in self._grid_arrays.values():
            arrays.forget()
        self._mesh_arrays.forget()
        self._of_sun.forget()
        self._of_lamps.forget()
