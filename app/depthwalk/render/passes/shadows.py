"""Draw the shadow maps of sun and lamps: depth seen along their light (Williams 1978).

`frame.shadows` lists the maps with their casters. Depth samples are warped in 3-D straight into a map, without an
impostor, and polygons are projected. Maps are kept from frame to frame; a map is drawn again only if it would change.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import moderngl

from depthwalk.cook.lod_geometry import GRID_LAYOUT
from depthwalk.gpu.device import DEPTH_CLAMP, Scope
from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import ALWAYS, LESS
from depthwalk.render.draw.draw_lists import PART_TRIANGLES, DrawBatch, DrawList
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.depth_image_object import DEPTH_OBJECT_BLOCK
from depthwalk.render.resources.mesh_object import CUT_OUT_LAYOUT, POSITION_LAYOUT, MeshObject
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.render.shadows.cascades import Cascade
from depthwalk.render.shadows.casters import Rectangle, ShadowMap
from depthwalk.render.shadows.moving_shadows import MovingShadows
from depthwalk.render.shadows.shadow_atlas import ShadowAtlas
from depthwalk.render.shadows.sun_uniforms import COLUMNS, LampMaps, SunMaps
from depthwalk.render.view.view_block import MAP_VIEW, ViewBlock
from depthwalk.scene.effect_settings import ShadowParams

_CUT_OUT = ("CUT_OUT",)
_CLAMPED = (DEPTH_CLAMP,)  # casters in front of the near plane of a map of the sun count, too


@dataclass(frozen=True, kw_only=True)
class _UnfinishedMap:
    """Hold a map that is drawn over several frames, the tile that it goes to, and what is still to be drawn.

    drawn: all that is drawn, beside what is copied from the map before; rest: what is left of its depth images.
    """

    tile: int
    map: ShadowMap
    drawn: ShadowMap
    rest: list[DrawList]


class ShadowsPass(Pass[ShadowParams]):
    """Draw what `frame.shadows` asks for into shadow maps that the pass owns."""

    name = "shadows"
    writes = ("sun_maps", "lamp_maps")

    def setup(self, gl: Scope) -> None:
        """Prepare programs, vertex arrays and the atlases of maps; `gl` owns them."""
        self._view = ViewBlock(gl, MAP_VIEW)
        shaders = "shadows/grid.vert", "shadows/map.frag"
        self._grid = Variants(lambda defines: Program(gl, *shaders, defines, DEPTH_OBJECT_BLOCK | {"View": MAP_VIEW}))
        self._grid_arrays = Variants(lambda defines: AssetArrays(gl, self._grid[defines], *GRID_LAYOUT))
        self._mesh = Program(gl, "shadows/mesh.vert", "shadows/map.frag", blocks={"View": MAP_VIEW})
        self._mesh_arrays = AssetArrays(gl, self._mesh, *POSITION_LAYOUT)
        of_meshes = "shadows/mesh.vert", "shadows/map.frag"
        self._cut_out = Variants(lambda defines: Program(gl, *of_meshes, defines, {"View": MAP_VIEW}))
        self._cut_out_arrays = Variants(lambda defines: AssetArrays(gl, self._cut_out[defines], *CUT_OUT_LAYOUT))
        self._instances = InstanceStream(gl, PLACED_RECORD)
        self._of_sun = ShadowAtlas(gl, columns=COLUMNS)
        self._of_lamps = ShadowAtlas(gl, columns=4)
        self._beside = ShadowAtlas(gl, columns=1)  # one map of the sun, drawn over several frames
        self._copy = Program(gl, "common/fullscreen.vert", "shadows/copy.frag")
        # The same maps, with what moves by itself.
        self._sun_with_moving = MovingShadows(ShadowAtlas(gl, columns=COLUMNS))
        self._lamps_with_moving = MovingShadows(ShadowAtlas(gl, columns=4))
        self._unfinished: _UnfinishedMap | None = None
        self._shown = False  # whether the last frame had shadow maps

    def enabled(self, frame: Frame, params: ShadowParams) -> bool:
        """Return whether anything casts shadows in `frame`, or did in the last one, whose maps must be dropped then.

        The `params` do not matter.
        """
        return bool(frame.shadows.lamps) or frame.shadows.sun is not None or self._shown

    def draw(self, frame: Frame, params: ShadowParams) -> None:
        """Draw the maps of `frame` that are out of date, at the resolutions of `params`.

        Afterwards `sun_maps` and `lamp_maps` hold all maps, new and old; None where nothing casts shadows.
        """
        for _ in self.parts(frame, params):
            pass

    def parts(self, frame: Frame, params: ShadowParams) -> Iterator[None]:
        """Draw as `draw` does; stop after each map, and within a map after every `PART_TRIANGLES`."""
        shadows, targets = frame.shadows, frame.targets
        targets.lamp_maps = targets.sun_maps = None
        if shadows.lamps:
            texture = self._of_lamps.fit(params.lamps, params.lamp_resolution)
            yield from self._draw_maps(frame, self._of_lamps, self._of_lamps.stale(shadows.lamps))
            moving = self._lamps_with_moving
            if self._moves(shadows.lamps, moving):
                texture = moving.atlas.fit(params.lamps, params.lamp_resolution)
                yield from self._draw_moving(frame, self._of_lamps, moving, shadows.lamps)
            targets.lamp_maps = LampMaps(texture=texture, params=params)
        if shadows.sun:
            yield from self._draw_sun_maps(frame, params, shadows.sun)
        if shadows.sun is None:
            self._of_sun.release()
            self._beside.release()
            self._sun_with_moving.release()
            self._unfinished = None
        self._shown = bool(shadows.lamps or shadows.sun)

    def _draw_sun_maps(self, frame: Frame, params: ShadowParams, maps: tuple[ShadowMap, ...]) -> Iterator[None]:
        texture = self._of_sun.fit(len(maps), params.resolution)
        requested = dict(enumerate(maps))
        stale = self._of_sun.stale(requested)
        last = len(maps) - 1 if frame.shadows.interactive else None
        waiting = self._of_sun.waiting(stale, last) if frame.shadows.may_wait else {}
        due = {tile: map_ for tile, map_ in stale.items() if tile not in waiting}
        yield from self._draw_maps(frame, self._of_sun, due, _CLAMPED)
        yield from self._draw_portion(frame, waiting)
        frame.plan.noted["shadow_maps_waiting"] = len(self._of_sun.stale(waiting))
        moving = self._sun_with_moving
        if self._moves(requested, moving):
            texture = moving.atlas.fit(len(maps), params.resolution)
            yield from self._draw_moving(frame, self._of_sun, moving, requested, _CLAMPED)
        shown = [self._of_sun.shown(tile).view for tile in requested]
        cascades = tuple(view for view in shown if isinstance(view, Cascade))
        frame.targets.sun_maps = SunMaps(texture=texture, cascades=cascades, params=params)

    def _draw_maps(
        self, frame: Frame, atlas: ShadowAtlas, maps: Mapping[int, ShadowMap], direct: tuple[int, ...] = ()
    ) -> Iterator[None]:
        """Draw `maps`, which are given by their tiles in `atlas`, in parts. direct: see `gpu.state.State`."""
        for tile, shadow_map in maps.items():
            atlas.begin(tile, shadow_map)
            parts = list(shadow_map.grids.parts(PART_TRIANGLES))
            yield from self._draw_parts(frame, shadow_map, parts, atlas.framebuffer(tile), direct)
            self._finish(frame, shadow_map, atlas.framebuffer(tile), direct)

    def _moves(self, requested: Mapping[int, ShadowMap], moving: MovingShadows) -> bool:
        """Return whether any of the maps has casters that move by themselves; if none has, `moving` is released."""
        moves = any(map_.moving is not None for map_ in requested.values())
        if not moves:
            moving.release()
        return moves

    def _draw_moving(
        self,
        frame: Frame,
        still: ShadowAtlas,
        moving: MovingShadows,
        requested: Mapping[int, ShadowMap],
        direct: tuple[int, ...] = (),
    ) -> Iterator[None]:
        """Draw what moves by itself into copies of the maps of `still`; stop after each map.

        Only where it was before is the map copied again. A frame draws about as many triangles as it has time for;
        other maps show it where it was. direct: see `gpu.state.State`.
        """
        assert still.texture is not None
        still.texture.compare_func = ""  # it is copied, not compared with
        most, drawn = frame.shadows.portion, 0
        for late in moving.late(requested, still.shown):
            if most is not None and drawn and drawn + late.triangles > most and not late.is_new:
                continue
            drawn += late.triangles
            self._copy_part(still, moving.atlas.framebuffer(late.tile), moving.begin(late))
            if late.casters is not None:
                parts = list(late.casters.map.grids.parts(PART_TRIANGLES))
                yield from self._draw_parts(frame, late.casters.map, parts, moving.atlas.framebuffer(late.tile), direct)
                with self.gl.state(into=moving.atlas.framebuffer(late.tile), depth_test=LESS, direct=direct):
                    self._draw_meshes(frame, late.casters.map)
                yield
        still.texture.compare_func = "<="

    def _copy_part(
        self, source: ShadowAtlas, target: moderngl.Framebuffer, part: Rectangle, corner: tuple[int, int] = (0, 0)
    ) -> None:
        """Copy depths of an atlas, which does not compare meanwhile, into a `part` of the tile `target`.

        corner: where the first texel of the source would come to lie in the framebuffer, of which the tile is a part.
        """
        left, bottom, width, height = part
        if not width * height:
            return
        assert source.texture is not None
        source.texture.use(0)
        self._copy.set(map_texture=0, corner=corner)
        target.scissor = target.viewport[0] + left, target.viewport[1] + bottom, width, height
        with self.gl.state(into=target, depth_test=ALWAYS):
            self._copy.fill()
        target.scissor = None  # type: ignore[assignment]  # moderngl's "no scissor", which its stubs forget

    def _draw_portion(self, frame: Frame, waiting: Mapping[int, ShadowMap]) -> Iterator[None]:
        """Continue one of the sun's maps that may wait, by as many triangles as a frame has time for, or to its end.

        It is drawn into a texture of its own, and copied to its tile when it is finished.
        """
        unfinished = self._unfinished
        if unfinished is None or unfinished.tile not in waiting or not waiting[unfinished.tile].follows(unfinished.map):
            unfinished = self._unfinished = self._begin_map(waiting)
        if unfinished is None:
            return
        rest, triangles = unfinished.rest, frame.shadows.portion
        count = len(rest) if triangles is None else max(triangles // PART_TRIANGLES, 1)
        portion, rest[:count] = rest[:count], []
        yield from self._draw_parts(frame, unfinished.drawn, portion, self._beside.framebuffer(0), _CLAMPED)
        if rest:
            return
        self._finish(frame, unfinished.drawn, self._beside.framebuffer(0), _CLAMPED)
        yield
        self._of_sun.begin(unfinished.tile, unfinished.map)
        target = self._of_sun.framebuffer(unfinished.tile)
        left, bottom, width, height = target.viewport
        self._copy_part(self._beside, target, (0, 0, width, height), (left, bottom))
        self._unfinished = None

    def _begin_map(self, waiting: Mapping[int, ShadowMap]) -> "_UnfinishedMap | None":
        """Begin the first of the maps that may wait, given by tile; None where there is none.

        Maps that replace provisional ones come first, those with the fewest triangles before the others: the far maps
        of a scene take a few frames where the near ones take dozens.
        """
        if not waiting:
            return None
        provisional = self._of_sun.provisional(waiting)
        tile = min(provisional, key=lambda tile: waiting[tile].triangles, default=next(iter(waiting)))
        shadow_map = waiting[tile]
        self._beside.fit(1, shadow_map.view.resolution).compare_func = ""  # it is copied, not compared with
        self._beside.begin(0, shadow_map)
        drawn = self._keep(tile, shadow_map) or shadow_map
        return _UnfinishedMap(tile=tile, map=shadow_map, drawn=drawn, rest=list(drawn.grids.parts(PART_TRIANGLES)))

    def _keep(self, tile: int, shadow_map: ShadowMap) -> ShadowMap | None:
        """Copy what a map keeps of the one that its tile shows, and return what is to be drawn besides.

        None where it keeps nothing.
        """
        entering = None if shadow_map.entering is None else shadow_map.entering(self._of_sun.shown(tile))
        if entering is None:
            return None
        (right, up), side = entering.moved, shadow_map.view.resolution
        left, bottom = self._of_sun.framebuffer(tile).viewport[:2]
        shared = max(-right, 0), max(-up, 0), side - abs(right), side - abs(up)
        assert self._of_sun.texture is not None
        self._of_sun.texture.compare_func = ""  # it is copied, not compared with
        self._copy_part(self._of_sun, self._beside.framebuffer(0), shared, (-left - right, -bottom - up))
        self._of_sun.texture.compare_func = "<="
        return entering.map

    def _draw_parts(
        self,
        frame: Frame,
        shadow_map: ShadowMap,
        parts: Sequence[DrawList],
        into: moderngl.Framebuffer,
        direct: tuple[int, ...],
    ) -> Iterator[None]:
        """Draw `parts` of the depth images of a map, and stop after each. direct: see `gpu.state.State`."""
        self._view.show(shadow_map.view)
        for part in parts:
            with self.gl.state(into=into, depth_test=LESS, direct=direct):
                self._draw_grids(frame, part)
            yield

    def _finish(self, frame: Frame, shadow_map: ShadowMap, into: moderngl.Framebuffer, direct: tuple[int, ...]) -> None:
        """Draw the meshes of a map, after its depth images, and count it."""
        with self.gl.state(into=into, depth_test=LESS, direct=direct):
            self._draw_meshes(frame, shadow_map)
        frame.plan.note("shadow_maps", 1)
        frame.plan.note("shadow_triangles", shadow_map.triangles)

    def _draw_grids(self, frame: Frame, part: DrawList) -> None:
        """Draw depth images, front and back faces: the back faces close gaps in the front faces."""
        for number, batches in part.by_asset():
            asset = frame.assets.depth_object(number)
            asset.use_geometry(self._grid[asset.defines], frame.common.lod)
            arrays = self._grid_arrays[asset.defines]
            for batch in batches:
                asset.draw(arrays, number, batch.indices, self._instances, part.records_of(batch))

    def _draw_meshes(self, frame: Frame, shadow_map: ShadowMap) -> None:
        for batch in shadow_map.meshes.batches:
            self._instances.upload(shadow_map.meshes.records_of(batch))
            asset = frame.assets.meshes.object(batch.asset, batch.level)
            if asset.look.has_cut_outs:
                self._draw_cut_outs(asset, batch)
                continue
            array = self._mesh_arrays.get((batch.asset, batch.level), asset.vertices, asset.indices)
            self._instances.bind(array)
            with self.gl.state(cull=asset.look.solid):
                array.render(instances=batch.count)

    def _draw_cut_outs(self, asset: MeshObject, batch: DrawBatch) -> None:
        """Draw a mesh part by part, each with the alpha test of its material."""
        program, key = self._cut_out[_CUT_OUT], (batch.asset, batch.level)
        array = self._cut_out_arrays[_CUT_OUT].get(key, asset.vertices, asset.indices)
        self._instances.bind(array)
        for part in asset.parts:
            look = asset.look.materials[part.material]
            look.texture.use(0)
            program.set(base_texture=0, cutoff=look.cutoff or 0.0)
            array.render(vertices=3 * part.face_count, first=3 * part.first_face, instances=batch.count)

    def forget_assets(self) -> None:
        """Drop the vertex arrays over buffers of assets, and the maps that show these assets."""
        for arrays in self._grid_arrays.values():
            arrays.forget()
        self._mesh_arrays.forget()
        for arrays in self._cut_out_arrays.values():
            arrays.forget()
        self._of_sun.forget()
        self._of_lamps.forget()
        self._sun_with_moving.forget()
        self._lamps_with_moving.forget()
        self._unfinished = None
