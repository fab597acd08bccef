"""What a map of the sun keeps when it moves with the viewer, and what is drawn into the rest."""

from dataclasses import replace

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.render import shadow_planner
from depthwalk.render.image import read_pixels
from depthwalk.render.shadows.cascades import Cascade, light_axes
from depthwalk.render.shadows.scrolled_map import MapOrigin, moved_texels, reach_beyond
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.scene import Scene
from shapes import ShapeLibrary, box, scene_of, sphere
from stage import OnScreen

AXES = light_axes(np.array([0.4, 0.8, -0.3]))
SIZE = (96, 72)
NOBODY = np.zeros(0, np.int64)


def cascade(right: float = 0.0, up: float = 0.0, toward: float = 0.0, half: float = 8.0) -> Cascade:
    """A map of the sun of 64 texels of 25 cm, whose middle is so many metres from the origin along its axes."""
    x, y, z = (np.array([right, up, toward]) @ AXES).tolist()
    return Cascade(centre=(x, y, z), half=half, axes=AXES, resolution=64)


@pytest.mark.parametrize(
    ("view", "moved"),
    [
        (cascade(2.0, -1.25), (8, -5)),
        (cascade(-15.75), (-63, 0)),
        (cascade(), None),  # it has not moved
        (cascade(16.0), None),  # nothing is left
        (cascade(2.1), None),  # no whole texels: edges would swim
        (cascade(2.0, 0, 1.0), None),  # depths would be others
        (cascade(2.0, half=8.5), None),
        (replace(cascade(2.0), resolution=32), None),
        (replace(cascade(2.0), axes=light_axes(np.array([0.4, 0.8, 0.3]))), None),
    ],
)
def test_maps_share_texels_after_steps_of_whole_texels_across_the_light(
    view: Cascade, moved: tuple[int, int] | None
) -> None:
    assert moved_texels(view, cascade()) == moved


def test_only_what_reaches_into_the_new_part_is_drawn() -> None:
    """Also beyond the edge that stays where it is: what is cut off there was so before."""
    places = {(0, 0): False, (7.8, 0): True, (12, 0): True, (-7.8, 0): False, (3, 7.9): False, (7.5, 7.9): True}
    centres = np.array([[x, y, 0] for x, y in places], np.float32) @ AXES.astype(np.float32)
    bounds = Bounds(centres, np.full(len(places), 0.5, np.float32))
    assert reach_beyond(cascade(4.0), cascade(), bounds).tolist() == list(places.values())


def test_texels_are_kept_only_of_the_same_casters() -> None:
    rows, mesh = np.arange(4), np.array([7])
    before = MapOrigin(changes=(0, 1), detail=2.0, rows=rows, asked=[(mesh, np.array([False]))])
    assert before.casts_same(before, rows[1:]) and before.casts_same(replace(before, asked=[]), NOBODY)
    for later in (
        replace(before, changes=(0, 2)),  # something moved
        replace(before, detail=1.0),
        replace(before, asked=[(mesh, np.array([True]))]),  # a mesh has come to the GPU
    ):
        assert not before.casts_same(later, NOBODY)
    assert not before.casts_same(before, np.array([3, 4]))  # an object has come to the GPU


def avenue() -> Scene:
    """Balls and pillars along a way on which the viewer goes, and the sun above it."""
    places = [(k % 2, (1.5 * (-1) ** k + 0.3 * np.sin(k), 0, -1.7 * k), 0.7 * k, 1.0) for k in range(-6, 30)]
    places.append((0, (0, 0, 400.0), 0.0, 1.0))  # so that shadows go on beyond all maps
    scene = scene_of(*places, ground={"height": 0.0}, sun={"direction": (-0.5, -1.5, -1.0)})
    scene.render.shadows.enabled = True
    return scene


def test_who_walks_on_sees_the_same_shadows_of_fewer_triangles(
    gl_device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    library = ShapeLibrary([box(0.5, 3.0, 0.5, (0, 1.5, 0)), sphere(0.6, 32, 16)], resolution=64)
    views = [View(Camera((0, 1.5, -0.5 * k), (0, 1.2, -0.5 * k - 1), 1.0), SIZE) for k in range(40)]
    pictures, drawn, maps = [], [], []
    for keeps in (False, True):
        if not keeps:
            monkeypatch.setattr(shadow_planner, "moved_texels", lambda view, before: None)
        with OnScreen(gl_device, avenue(), library, SIZE) as stage:
            stage.renderer.remembers = True
            counts = [stage.draw(view) for view in views]
            pictures.append(read_pixels(stage.screen).astype(int))
        monkeypatch.undo()
        drawn.append(sum(count.get("shadow_triangles", 0) for count in counts[1:]))
        maps.append(sum(count.get("shadow_maps", 0) for count in counts[1:]))
    assert maps[0] == maps[1] > 3
    assert drawn[1] < 0.7 * drawn[0]
    off = np.abs(pictures[0] - pictures[1]).max(-1) > 2
    assert off.mean() < 1e-3
