"""Colour and normal are looked up once per pixel of a depth-image object, and lit there in forward mode."""

from types import SimpleNamespace
from typing import Any, Literal, cast

import numpy as np
import pytest

from alone import MakeAlone
from depthwalk.gpu.device import Device
from depthwalk.render.draw.material_depth import MaterialRecords
from depthwalk.render.passes.material_resolve import MaterialResolvePass, _alone
from depthwalk.scene.environment import Environment
from depthwalk.scene.render_settings import RenderSettings
from shapes import ShapeLibrary, box, scene_of
from stage import OnScreen, view_of


def draw_lists(meshes: int = 0) -> SimpleNamespace:
    return SimpleNamespace(mesh=SimpleNamespace(records=np.zeros(meshes)), clusters=(), captured={})


@pytest.mark.parametrize(
    ("assets", "meshes", "environment", "settings", "expected"),
    [
        (1, 0, {}, {}, True),
        (2, 0, {}, {}, False),
        (1, 3, {}, {}, False),
        (1, 0, {"ground": {"height": 0.0}}, {}, False),
        (1, 0, {}, {"light": {"mode": "forward"}}, False),
        (1, 0, {}, {"aa": "coverage"}, False),
    ],
)
def test_the_depth_buffer_suffices_for_one_asset_alone(
    alone: MakeAlone, assets: int, meshes: int, environment: dict[str, Any], settings: dict[str, Any], expected: bool
) -> None:
    resolve = alone(MaterialResolvePass())
    frame = resolve.frame(
        settings=RenderSettings.model_validate(settings),
        plan=draw_lists(meshes),
        environment=Environment(**environment),
    )
    assert _alone(frame, cast(MaterialRecords, SimpleNamespace(assets=np.arange(assets)))) is expected


@pytest.mark.parametrize(("shading", "expected"), [(None, False), (0, False), (2, True)])
def test_without_depth_images_there_is_nothing_to_look_up(
    alone: MakeAlone, shading: int | None, expected: bool
) -> None:
    resolve = alone(MaterialResolvePass())
    records = None if shading is None else SimpleNamespace(assets=np.arange(shading))
    assert resolve.pass_.enabled(resolve.frame(materials=records), resolve.pass_.params) is expected


@pytest.mark.parametrize("mode", ["deferred", "forward"])
def test_what_is_lit_forward_is_marked_so(gl_device: Device, mode: Literal["deferred", "forward"]) -> None:
    """By a shininess of 0 in the G-buffer, for `light` to leave it alone."""
    scene = scene_of((0, (0, 0, 0), 0.3, 1.0))
    scene.render.light.mode = mode
    with OnScreen(gl_device, scene, ShapeLibrary([box(0.8, 0.8, 0.8)], resolution=48)) as stage:
        stage.renderer.keeps = frozenset({"lit"})
        stage.draw(view_of((0.5, 1.0, 3.0), (0.0, 0.4, 0.0)))
        targets = stage.renderer.targets
        assert targets is not None
        width, height = targets.size
        shown = np.frombuffer(targets.visibility_texture.read(alignment=1), np.uint32).reshape(height, width, 2)[..., 0]
        surface = np.frombuffer(targets.surface.read(alignment=1), np.uint32).reshape(height, width, 2)
        light = np.frombuffer(targets.lit_texture.read(alignment=1), np.float16).reshape(height, width, 4)
    assert (shown > 0).sum() > 500
    assert ((surface[shown > 0, 1] >> 24 == 0) == (mode == "forward")).all()
    assert (light[shown > 0, 3] == 1).all() and light[shown > 0, :3].max() > 0.1
