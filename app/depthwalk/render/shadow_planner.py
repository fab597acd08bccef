"""Plan the shadow maps of a frame: which maps of sun and lamps it has, and what is drawn into each."""

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from depthwalk.gpu.timers import PassTimers
from depthwalk.params import Memo
from depthwalk.render.lighting.irradiance import Lighting
from depthwalk.render.lod.fallback_rule import IsResident, MeshFallbackRule
from depthwalk.render.shadows.cascades import Cascade, fit_cascades, shadow_extent
from depthwalk.render.shadows.casters import (
    EnteringCasters,
    LightView,
    MovingCasters,
    ShadowMap,
    Shadows,
    find_casters,
    sees_same,
    shadow_map,
)
from depthwalk.render.shadows.scrolled_map import MapOrigin, moved_texels, reach_beyond
from depthwalk.render.shadows.seen_prism import SeenPrism
from depthwalk.render.shadows.spot_maps import assign_tiles, choose_shadow_lamps, lamp_spot, shadow_lamps
from depthwalk.render.view.view import View
from depthwalk.render.world.frame_residency import FrameResidency
from depthwalk.render.world.render_world import RenderWorld
from depthwalk.scene.effect_settings import ShadowParams
from depthwalk.types import Array, Mask, Rows

if TYPE_CHECKING:
    from depthwalk.scene.environment import LampParams

log = logging.getLogger(__name__)

_LIFTED = 4.0  # texels: how far, besides the filter's width, from a surface point its map may be read


@dataclass(frozen=True, kw_only=True)
class _Casters:
    """Hold the objects that cast shadows in a map, and the state of the world that they were found for.

    assets: their distinct assets, in the order of the `rows`.
    """

    view: LightView
    changes: tuple[int, int]
    rows: Rows
    assets: Rows


@dataclass(frozen=True, kw_only=True)
class _Detail:
    """Set how finely a map's casters are drawn.

    magnification: texels of the map that a texel of a depth image may cover. error: geometric, texels of the map.
    triangles_per_texel: at most, of the map. chooses: whether meshes with fewer triangles than their depth images are
    read and cast instead, which pays where more frames follow.
    """

    magnification: float
    error: float
    triangles_per_texel: float
    chooses: bool


@dataclass(frozen=True, kw_only=True)
class _Planned:
    """Hold a map, and what it was planned from.

    resident: the rows of its casters that were on the GPU. asked: each query whether meshes are resident, with its
    answer.
    """

    map: ShadowMap
    changes: tuple[int, int]
    resident: Rows
    detail: _Detail
    asked: list[tuple[Rows, Mask]]


class ShadowPlanner:
    """Plan the shadow maps of each frame, from the objects of a world that cast shadows.

    Most maps stay where they are from frame to frame and show the same, so their plans are kept.

    Parameters
    ----------
    world
        The world whose objects cast shadows.
    timers
        Measure the steps "cull", "upload" and "plan".
    """

    def __init__(self, world: RenderWorld, timers: PassTimers) -> None:
        self._world, self._timers = world, timers
        self._warned = False
        self._lamps = Memo(shadow_lamps)
        self._found: dict[int, _Casters] = {}  # by the map's number in a frame
        self._planned: dict[int, _Planned] = {}
        self._shadowed: tuple[tuple[object, ...], tuple[Array, float] | None] = (), None

    def plan(
        self,
        view: View,
        light: Lighting,
        lamps: Sequence["LampParams"],
        params: ShadowParams,
        *,
        magnification: float,
        uploads: FrameResidency,
        may_wait: bool,
        detail: float = 1.0,
    ) -> Shadows:
        """Plan the maps of the sun, if it casts shadows, and of the lamps in sight that do.

        Parameters
        ----------
        view
            The view, with near and far plane fitted to what it sees.
        light
            The light of the sun, and the direction to it.
        lamps
            The lamps of the scene.
        params
            The settings of shadows.
        magnification
            Pixels that a texel of a depth image may cover before the mesh is drawn, see `MeshFallbackRule`.
        uploads
            Brings what casts shadows to the GPU; objects that are not resident in time cast none in this frame.
        may_wait
            Whether maps of the sun may be redrawn some frames later. If not, a map that is new in this frame holds only
            what casts a shadow on something in the view.
        detail
            Part of the triangles that `params` allow, above 0; less than 1 for provisional maps.

        Returns
        -------
        Shadows
            The maps of the sun and of the lamps, with what is drawn into each.
        """
        with self._timers.measure_cpu("cull"):
            by_sun = params.enabled and bool(light.sun.any())
            cascades = fit_cascades(view, light.to_sun, params, self._extent(light.to_sun)) if by_sun else ()
            tiles = self._lamp_tiles(view, lamps, params)
            spots = [lamp_spot(lamps[number], params.lamp_resolution) for number in tiles]
            views: list[LightView] = [*cascades, *spots]
            moving = self._world.moving_rows() if may_wait else np.zeros(0, np.int64)
            before = self._found.copy()
            casters = [self._casters(number, map_view, moving) for number, map_view in enumerate(views)]
            if cascades and not may_wait:
                casters[: len(cascades)] = self._casting_on_seen(view, cascades, casters, before, params)
        with self._timers.measure_cpu("upload"):
            resident = _resident(casters, uploads)
            if len(moving):
                moving = moving[uploads.resident(moving)]
        with self._timers.measure_cpu("plan"):
            # Far from the viewer edges are small on the screen, so farther maps of the sun may have fewer triangles.
            shares = [4.0**-k for k in range(len(cascades))] + [1.0] * len(spots)
            maps = []
            for number, (map_view, rows, share) in enumerate(zip(views, resident, shares, strict=True)):
                map_detail = _Detail(
                    magnification=magnification,
                    error=params.error,
                    triangles_per_texel=params.triangles_per_texel * share * detail,
                    chooses=may_wait,
                )
                maps.append(self._map(number, map_view, rows, map_detail, uploads.is_mesh_resident, moving))
        of_sun, of_lamps = maps[: len(cascades)], maps[len(cascades) :]
        if detail < 1:
            of_sun = [replace(map_, provisional=True) for map_ in of_sun]
        return Shadows(
            sun=tuple(of_sun) if by_sun else None,
            may_wait=may_wait,
            lamps=dict(zip(tiles.values(), of_lamps, strict=True)),
            tiles=tiles,
        )

    def _lamp_tiles(self, view: View, lamps: Sequence["LampParams"], params: ShadowParams) -> dict[int, int]:
        """Return which lamps have a shadow map in this frame, and in which tile; warn where these are not all."""
        chosen = choose_shadow_lamps(view, self._lamps.of(lamps))
        self._warn_of_lamps(len(chosen), params.lamps)
        return assign_tiles(chosen[: params.lamps], lamps, params.lamps)

    def _casting_on_seen(
        self,
        view: View,
        cascades: Sequence[Cascade],
        casters: Sequence[_Casters],
        before: Mapping[int, _Casters],
        params: ShadowParams,
    ) -> Iterator[_Casters]:
        """Yield of the `casters` of each map of the sun those whose shadow may fall on something in the `view`.

        Yield them all where the map was the same `before`, as in a video: then the next frames need not draw it again.
        """
        prism = SeenPrism.of(view, cascades[0].axes, params.distance)
        for number, (cascade, of_map) in enumerate(zip(cascades, casters, strict=False)):
            if of_map is before.get(number):
                yield of_map
                continue
            margin = (params.filter_width + _LIFTED) * cascade.texel
            rows = of_map.rows[prism.meets(self._world.bounds().take(of_map.rows), margin)]
            yield replace(of_map, rows=rows, assets=self._assets(rows))

    def _extent(self, to_sun: Array) -> tuple[Array, float] | None:
        """Return a sphere that holds all shadows of the sun, computed again when anything has changed."""
        state = self._world.changes, tuple(to_sun.tolist()), self._world.ground_height
        if self._shadowed[0] != state:
            self._shadowed = state, shadow_extent(self._world.bounds(), to_sun, self._world.ground_height)
        return self._shadowed[1]

    def _casters(self, number: int, view: LightView, moving: Rows) -> _Casters:
        """Return the objects that cast shadows in the map with the `number`, found again if anything has changed.

        The rows `moving` are left out.
        """
        found, changes = self._found.get(number), self._changes(moving)
        if found is None or found.changes != changes or not sees_same(found.view, view):
            rows = find_casters(view, self._world.bounds())
            rows = rows[~np.isin(rows, moving)] if len(moving) else rows
            found = self._found[number] = _Casters(view=view, changes=changes, rows=rows, assets=self._assets(rows))
        return found

    def _changes(self, moving: Rows) -> tuple[int, int]:
        """Return what changes with anything but the rows `moving`."""
        return len(moving), self._world.edits if len(moving) else self._world.changes

    def _assets(self, rows: Rows) -> Rows:
        """Return the distinct assets of the objects `rows`, in their order."""
        asset = self._world.objects().asset[rows]
        return asset[np.sort(np.unique(asset, return_index=True)[1])]

    def _map(
        self, number: int, view: LightView, rows: Rows, detail: _Detail, is_resident: IsResident, moving: Rows
    ) -> ShadowMap:
        """Return the map with the `number`, planned again only if something that it depends on has changed.

        rows: (m,) of the casters on the GPU. moving: (k,) rows that move by themselves, and are not among these.
        """
        map_ = self._still_map(number, view, rows, detail, is_resident, self._changes(moving))
        if isinstance(view, Cascade):
            map_ = replace(map_, entering=self._entering(map_, rows, detail, is_resident))
        if not len(moving):
            return map_
        rule = _rule(detail, is_resident)

        def of_view(shown: LightView) -> MovingCasters:
            bounds = self._world.bounds()
            cast = moving[find_casters(shown, bounds.take(moving))]
            drawn = shadow_map(shown, cast, self._world.arrays(), rule, detail.chooses)
            return MovingCasters(map=drawn, rectangle=shown.rectangle(bounds.take(cast)))

        return replace(map_, moving=of_view)

    def _entering(
        self, map_: ShadowMap, rows: Rows, detail: _Detail, is_resident: IsResident
    ) -> Callable[[ShadowMap], EnteringCasters | None]:
        """Return what plans the casters of a map of the sun that an earlier one does not show whole.

        rows: (m,) of all its casters.
        """

        def since(before: ShadowMap) -> EnteringCasters | None:
            view, was, origin = map_.view, before.view, before.origin
            if not (isinstance(view, Cascade) and isinstance(was, Cascade)) or before.provisional:
                return None
            moved = moved_texels(view, was)
            if origin is None or map_.origin is None or moved is None:
                return None
            beyond = reach_beyond(view, was, self._world.bounds().take(rows))
            if not origin.casts_same(map_.origin, rows[~beyond]):
                return None
            rule = _rule(detail, is_resident)
            drawn = shadow_map(view, rows[beyond], self._world.arrays(), rule, detail.chooses)
            return EnteringCasters(map=drawn, moved=moved)

        return since

    def _still_map(
        self,
        number: int,
        view: LightView,
        rows: Rows,
        detail: _Detail,
        is_resident: IsResident,
        changes: tuple[int, int],
    ) -> ShadowMap:
        planned = self._planned.get(number)
        if (
            planned is not None
            and (planned.changes, planned.detail) == (changes, detail)
            and sees_same(planned.map.view, view)
            and (planned.resident is rows or np.array_equal(planned.resident, rows))
            and all(np.array_equal(is_resident(meshes), answer) for meshes, answer in planned.asked)
        ):
            return planned.map
        asked: list[tuple[Rows, Mask]] = []

        def noted(meshes: Rows) -> Mask:
            answer = is_resident(meshes)
            asked.append((meshes, answer))
            return answer

        map_ = shadow_map(view, rows, self._world.arrays(), _rule(detail, noted), detail.chooses)
        map_ = replace(map_, origin=MapOrigin(changes=changes, detail=detail, rows=rows, asked=asked))
        self._planned[number] = _Planned(map=map_, changes=changes, resident=rows, detail=detail, asked=asked)
        return map_

    def _warn_of_lamps(self, requested: int, allowed: int) -> None:
        """Warn, once, that some of the lamps in sight cast no shadows though the scene asks for them."""
        if requested > allowed > 0 and not self._warned:
            self._warned = True
            log.warning(
                "%d visible lamps should cast shadows, but render.shadows.lamps allows only %d", requested, allowed
            )


def _rule(detail: _Detail, is_resident: IsResident) -> MeshFallbackRule:
    """Return the rule by which meshes cast in place of depth images."""
    return MeshFallbackRule(
        magnification=detail.magnification,
        is_resident=is_resident,
        error=detail.error,
        triangles_per_pixel=detail.triangles_per_texel,
    )


def _resident(casters: Sequence[_Casters], uploads: FrameResidency) -> list[Rows]:
    """Return the rows of those `casters` of each map whose assets are on the GPU, after uploading these."""
    if not casters:
        return []
    if uploads.are_resident(np.concatenate([of_map.assets for of_map in casters])).all():  # as in nearly every frame
        return [of_map.rows for of_map in casters]
    return [of_map.rows[uploads.resident(of_map.rows)] for of_map in casters]
