"""The part of the picture that holds all objects: nothing is missing outside it, and it is no larger than need be."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.render import renderer as renderer_module
from depthwalk.render.culling.objects_part import Part, objects_part
from depthwalk.render.image import read_pixels
from depthwalk.render.view.bounds import Cylinders
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.types import Picture
from shapes import ShapeLibrary, box, scene_of, sphere
from stage import OnScreen, set_all

SIZE = (160, 120)
PLACES = [(0, (0.4, 0.2, 0.0), 0.3, 1.0), (1, (-0.5, 0.0, -1.0), 1.1, 0.5)]
VIEWS = {
    "middle": Camera((0.0, 0.8, 6.0), (0.0, 0.5, 0.0), 0.9),
    "corner": Camera((0.0, 0.8, 6.0), (2.2, -1.2, 0.0), 0.9),
    "beside": Camera((0.0, 0.8, 6.0), (-3.2, 0.5, 0.0), 0.9),
    "near": Camera((0.4, 0.5, 1.0), (0.3, 0.4, 0.0), 0.9),
}


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([sphere(0.5, 48, 24), box(1.0, 1.0, 0.6, (0, 0.5, 0))], resolution=64)


def cylinder(*centre: float, half_height: float = 1.0, radius: float = 0.5) -> Cylinders:
    return Cylinders(np.array([centre]), np.array([[0.0, 1.0, 0.0]]), np.array([half_height]), np.array([radius]))


def test_the_part_holds_a_cylinder_and_little_more() -> None:
    view = View(Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), np.pi / 2), (400, 400), near=0.1, far=50.0)
    part = objects_part(view, cylinder(0.0, 0.0, -10.0))
    assert part is not None
    x, y, width, height = part
    assert x + width / 2 == y + height / 2 == 200
    assert 200 * 2 * 0.5 / 9.5 <= width <= 200 * 2 * 0.5 / 9.5 + 8
    assert 200 * 2 * 1.0 / 9.5 <= height <= 200 * 2 * 1.0 / 9.5 + 8


@pytest.mark.parametrize("centre", [(0.0, 0.0, -0.3), (0.0, 0.0, 5.0), (0.0, 0.0, -0.9)])
def test_what_is_near_or_fills_the_picture_has_no_part(centre: tuple[float, float, float]) -> None:
    view = View(Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), np.pi / 2), (400, 400), near=0.1, far=50.0)
    assert objects_part(view, cylinder(*centre)) is None


def test_nothing_has_no_part() -> None:
    view = View(Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 1.0), SIZE, near=0.1, far=50.0)
    none = cylinder(0, 0, 0)
    assert objects_part(view, Cylinders(none.centre[:0], none.axis[:0], none.half_height[:0], none.radius[:0])) is None


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"aa": "msaa"},
        {"aa": "ssaa"},
        {"aa": "coverage"},
        {"aa": "gpaa-edge"},
        {"dof.mode": "gather"},
        {"dof.mode": "accumulate", "dof.samples": 4},
        {"fused": False},
        {"shadows.enabled": True},
    ],
)
@pytest.mark.parametrize("representation", [Representation.DPCI, Representation.MESH, Representation.DMESH])
def test_pictures_are_those_of_drawing_it_all(
    gl_device: Device,
    library: ShapeLibrary,
    monkeypatch: pytest.MonkeyPatch,
    representation: Representation,
    settings: dict[str, Any],
) -> None:
    monkeypatch.setattr(gl_device, "software", True)  # a GPU draws the whole picture
    parts: list[Part | None] = []

    def pictures(part_of: Callable[[View, Cylinders], Part | None]) -> list[Picture]:
        monkeypatch.setattr(renderer_module, "objects_part", part_of)
        scene = scene_of(*PLACES, representation=representation)
        set_all(scene.render, settings)
        drawn = []
        with OnScreen(gl_device, scene, library, SIZE) as stage:
            for camera in VIEWS.values():
                stage.draw(View(camera, SIZE))
                drawn.append(read_pixels(stage.screen))
        return drawn

    def seen(view: View, enclosing: Cylinders) -> Part | None:
        parts.append(objects_part(view, enclosing))
        return parts[-1]

    np.testing.assert_array_equal(pictures(seen), pictures(lambda view, enclosing: None))
    assert sum(part is not None for part in parts) >= 3 and None in parts


def test_with_a_ground_surfaces_may_be_anywhere(gl_device: Device, library: ShapeLibrary) -> None:
    scene = scene_of(*PLACES, ground={})
    with OnScreen(gl_device, scene, library, SIZE) as stage:
        stage.draw(View(VIEWS["corner"], SIZE))
        above, below = read_pixels(stage.screen)[[0, -1], SIZE[0] // 2].astype(int)
    assert np.abs(above - below).max() > 20
