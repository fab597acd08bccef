"""Plan the shadow maps of a frame: which maps of sun and lamps it has, and what is drawn into each."""

import logging
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from depthwalk.gpu.timers import PassTimers
from depthwalk.render.lighting.irradiance import Lighting
from depthwalk.render.lod.mesh_fallback import MeshFallbackRule
from depthwalk.render.shadows.cascades import fit_cascades
from depthwalk.render.shadows.casters import MapView, Shadows, find_casters, shadow_map
from depthwalk.render.shadows.seen_prism import SeenPrism
from depthwalk.render.shadows.spot_maps import assign_tiles, choose_shadow_lamps, lamp_spot
from depthwalk.render.view.view import View
from depthwalk.render.world.render_world import FrameResidency, RenderWorld
from depthwalk.scene.render_settings import ShadowParams

if TYPE_CHECKING:
    from depthwalk.scene.environment import LampParams

log = logging.getLogger(__name__)

_LIFTED = 4.0  # texels, and what the filter is wide: where a map is read, from the point that it is read for


class ShadowPlanner:
    """Plan the shadow maps of each frame, by what casts shadows among the objects of a world.

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

    def plan(
        self,
        view: View,
        light: Lighting,
        lamps: Sequence["LampParams"],
        params: ShadowParams,
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
            Whether maps of the sun may be redrawn some frames later. If not, no other frame uses them: they hold what
            casts its shadow on something in the view alone.
        detail
            Part of the triangles that `params` allow, above 0; less than 1 for provisional maps.

        Returns
        -------
        Shadows
            The maps of the sun and of the lamps, with what is drawn into each.
        """
        with self._timers.measure_cpu("cull"):
            by_sun = params.enabled and bool(light.sun.any())
            cascades = fit_cascades(view, light.to_sun, params, self._world.extent()) if by_sun else ()
            chosen = choose_shadow_lamps(view, lamps)
            self._warn_of_lamps(len(chosen), params.lamps)
            tiles = assign_tiles(chosen[: params.lamps], lamps, params.lamps)
            spots = [lamp_spot(lamps[number], params.lamp_resolution) for number in tiles]
            views: list[MapView] = [*cascades, *spots]
            bounds = self._world.bounds()
            found = [find_casters(map_view, bounds) for map_view in views]
            if cascades and not may_wait:
                prism = SeenPrism.of(view, cascades[0].axes, params.distance)
                margins = [(params.filter_width + _LIFTED) * cascade.texel for cascade in cascades]
                for number, margin in enumerate(margins):
                    found[number] = found[number][prism.meets(bounds.take(found[number]), margin)]
        with self._timers.measure_cpu("upload"):
            casters = [rows[uploads.resident(rows)] for rows in found]
        with self._timers.measure_cpu("plan"):
            scene = self._world.arrays()
            # Far from the viewer edges are small, so that farther maps of the sun may have fewer triangles.
            fraction = [4.0**-k for k in range(len(cascades))] + [1.0] * len(spots)
            rule = MeshFallbackRule(
                magnification=magnification, is_resident=uploads.is_mesh_resident, error=params.error
            )
            maps = [
                shadow_map(map_view, rows, scene, rule, params.triangles_per_texel * part * detail)
                for map_view, rows, part in zip(views, casters, fraction, strict=True)
            ]
        of_lamps = dict(zip(tiles.values(), maps[len(cascades) :], strict=True))
        of_sun = tuple(replace(map_, provisional=detail < 1) for map_ in maps[: len(cascades)]) if by_sun else None
        return Shadows(sun=of_sun, may_wait=may_wait, lamps=of_lamps, tiles=tiles)

    def _warn_of_lamps(self, requested: int, allowed: int) -> None:
        """Warn, once, that some of the lamps in sight cast no shadows though the scene wants them to."""
        if requested > allowed > 0 and not self._warned:
            self._warned = True
            log.warning("%d lamps in sight are to cast shadows; render.shadows.lamps allows %d", requested, allowed)
