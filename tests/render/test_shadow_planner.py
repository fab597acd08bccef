"""Which maps a frame has, without anything to draw into them."""

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from pyglm import glm

from depthwalk.gpu.timers import PassTimers
from depthwalk.render import shadow_planner
from depthwalk.render.lighting.irradiance import lighting
from depthwalk.render.shadows.cascades import fit_cascades
from depthwalk.render.shadows.casters import Shadows
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.render.world.frame_residency import FrameResidency
from depthwalk.render.world.render_world import RenderWorld
from depthwalk.scene.arrays import Camera
from depthwalk.scene.effect_settings import ShadowParams
from depthwalk.scene.environment import Environment, LampParams
from depthwalk.types import Rows

VIEW = View(Camera((0.0, 1.0, 5.0), (0.0, 1.0, 0.0), 1.0), (320, 200), near=0.5, far=40.0)
OBJECTS = SimpleNamespace(asset=np.arange(2))  # the asset of each of two objects
NONE = np.zeros(0, np.int64)
DARK = {"sun": {"intensity": 0.0}}


@dataclass(frozen=True)
class Planned:
    """A map that tells what it was made of."""

    view: Any
    rows: list[int]
    rule: Any
    provisional: bool = False
    origin: Any = field(default=None, compare=False)
    entering: Any = field(default=None, compare=False)


@pytest.fixture
def plan(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Plans with two objects in sight, the second of which is not on the GPU; maps tell what they were made of."""
    monkeypatch.setattr(
        shadow_planner,
        "shadow_map",
        lambda view, rows, scene, rule, chooses: Planned(view=view, rows=rows.tolist(), rule=rule),
    )
    bounds = Bounds(np.array([[0, 1, 0], [0, 1, 500]], np.float32), np.ones(2, np.float32))
    world = SimpleNamespace(
        bounds=lambda: bounds,
        objects=lambda: OBJECTS,
        ground_height=0.0,
        arrays=lambda: None,
        changes=0,
        moving_rows=lambda: NONE,
    )
    uploads = SimpleNamespace(resident=lambda rows: rows == 0, are_resident=lambda assets: assets == 0)
    uploads.is_mesh_resident = None
    residency = cast(FrameResidency, uploads)
    planner = shadow_planner.ShadowPlanner(
        cast(RenderWorld, world), cast(PassTimers, SimpleNamespace(measure_cpu=lambda name: nullcontext()))
    )

    def planned(
        params: ShadowParams, lamps: tuple[Any, ...] = (), detail: float = 1.0, **environment: dict[str, float]
    ) -> Shadows:
        light = lighting(Environment.model_validate({**environment}))
        return planner.plan(
            VIEW, light, lamps, params, magnification=2.0, uploads=residency, may_wait=True, detail=detail
        )

    return planned


def lamp(x: float, **more: float) -> LampParams:
    return LampParams.model_validate({"position": (x, 3.0, 0.0), "direction": (0, -1, 0), "shadow": True, **more})


def test_the_sun_has_maps_of_what_is_on_the_gpu_and_farther_ones_are_coarser(plan: Callable[..., Any]) -> None:
    shadows = plan(ShadowParams(enabled=True, triangles_per_texel=16.0))
    assert [map_.rule.triangles_per_pixel for map_ in shadows.sun] == [16, 4, 1]
    assert {row for map_ in shadows.sun for row in map_.rows} == {0}
    assert shadows.may_wait and shadows.lamps == shadows.tiles == {}
    assert shadows.sun[0].rule.magnification == 2.0


@pytest.mark.parametrize("detail", [0.25, 1.0])
def test_coarser_maps_of_the_sun_are_provisional(plan: Callable[..., Any], detail: float) -> None:
    """Else the nearest is drawn again as a whole in the second frame of a walk, which stutters there."""
    shadows = plan(ShadowParams(enabled=True, triangles_per_texel=16.0), [lamp(0.0)], detail=detail)
    assert [map_.rule.triangles_per_pixel for map_ in shadows.sun] == [16 * detail, 4 * detail, detail]
    assert [map_.provisional for map_ in shadows.sun] == [detail < 1] * 3
    assert [map_.provisional for map_ in shadows.lamps.values()] == [False]  # they are never drawn by and by


@pytest.mark.parametrize(("params", "environment"), [(ShadowParams(enabled=True), DARK), (ShadowParams(), {})])
def test_no_sun_or_no_shadows_are_no_maps(
    plan: Callable[..., Any], params: ShadowParams, environment: dict[str, Any]
) -> None:
    assert plan(params, **environment).sun is None


def test_the_brightest_lamps_in_sight_have_maps_and_too_many_are_told_of_once(
    plan: Callable[..., Any], caplog: pytest.LogCaptureFixture
) -> None:
    lamps = [
        lamp(0.0),
        lamp(1.0, intensity=5.0),
        LampParams.model_validate({"position": (0, 3, 0)}),
        lamp(-1.0, intensity=9.0),
    ]
    params = ShadowParams(lamps=2, triangles_per_texel=16.0)
    shadows = plan(params, lamps, **DARK)
    assert set(shadows.tiles) == {1, 3} and set(shadows.lamps) == set(shadows.tiles.values())
    for number, tile in shadows.tiles.items():
        map_ = shadows.lamps[tile]
        assert map_.view.centre == lamps[number].position and map_.rule.triangles_per_pixel == 16
    plan(params, lamps, **DARK)
    assert caplog.text.count("3 visible lamps should cast shadows, but render.shadows.lamps allows only 2") == 1


def test_maps_are_planned_again_only_when_something_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    """What they see, the objects, what is on the GPU, the rule, or which meshes may be drawn."""
    bounds = Bounds(np.array([[0, 1, 0], [0, 1, 500]], np.float32), np.ones(2, np.float32))
    planned, searched = [], []

    def shadow_map(view: Any, rows: Rows, scene: Any, rule: Any, chooses: bool) -> Planned:
        rule.is_resident(np.array([7]))
        planned.append(view)
        return Planned(view=view, rows=rows.tolist(), rule=rule)

    def find_casters(view: Any, bounds: Bounds) -> Rows:
        searched.append(view)
        return np.arange(2)

    monkeypatch.setattr(shadow_planner, "shadow_map", shadow_map)
    monkeypatch.setattr(shadow_planner, "find_casters", find_casters)
    world = SimpleNamespace(
        bounds=lambda: bounds,
        objects=lambda: OBJECTS,
        ground_height=0.0,
        arrays=lambda: None,
        changes=0,
        moving_rows=lambda: NONE,
    )
    on_gpu, meshes = [True, False], [False]
    uploads = SimpleNamespace(
        resident=lambda rows: np.array(on_gpu)[rows],
        are_resident=lambda assets: np.array(on_gpu)[assets],
        is_mesh_resident=lambda asked: np.array(meshes),
    )
    residency = cast(FrameResidency, uploads)
    timers = SimpleNamespace(measure_cpu=lambda name: nullcontext())
    planner = shadow_planner.ShadowPlanner(cast(RenderWorld, world), cast(PassTimers, timers))
    params = ShadowParams(enabled=True, cascades=2, distance=50.0)

    def maps(eye: float = 0.0, magnification: float = 2.0) -> tuple[int, int]:
        """Plan a frame, and return how many maps were planned for it, and how many were searched for casters."""
        planned.clear()
        searched.clear()
        view = replace(VIEW, camera=VIEW.camera.moved(glm.dvec3(eye, 0, 0)))
        light = lighting(Environment())
        shadows = planner.plan(view, light, (), params, magnification=magnification, uploads=residency, may_wait=True)
        assert shadows.sun is not None and len(shadows.sun) == 2
        assert shadows.sun[0].view.centre == fit_cascades(view, light.to_sun, params)[0].centre
        return len(planned), len(searched)

    assert maps() == (2, 2)
    assert maps() == maps(0.01) == (0, 0)
    assert maps(eye=5.0) == (1, 1)  # the nearest map moved, the other did not
    assert maps(eye=5.0, magnification=3.0) == (2, 0)
    on_gpu[1] = True
    assert maps(5.0, 3.0) == (2, 0)
    meshes[0] = True
    assert maps(5.0, 3.0) == (2, 0)
    assert maps(5.0, 3.0) == (0, 0)
    world.changes += 1
    assert maps(5.0, 3.0) == (2, 2)
