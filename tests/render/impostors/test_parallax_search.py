"""An impostor warped before the viewer moved shows its surface where it is now (shaders/composite/parallax.glsl)."""

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.render.view.view import View, view_distance
from depthwalk.scene.arrays import Camera
from shapes import ShapeLibrary, box, scene_of
from stage import OnScreen

SIZE = (160, 120)
EDGE = 0.8  # metres from the axis: the box stands on its corner, |x| + |z| ≤ EDGE


def distances_off(device: Device, steps: int) -> np.ndarray:
    """How far (n,), metres, two walls that recede from their common edge are shown from where they are.

    From the viewer's second place, 30 cm aside, whose picture reuses the impostor of the first.
    """
    side = EDGE * 2**0.5
    library = ShapeLibrary([box(side, 0.8, side, (0, 0.4, 0))], resolution=48, layers=1)
    scene = scene_of((0, (0, 0, 0), np.pi / 4, 1.0))
    scene.render.warp.reuse_error, scene.render.composite.parallax_steps = 16.0, steps
    with OnScreen(device, scene, library, SIZE) as stage:
        stage.renderer.remembers = True
        for x in (0.0, 0.3):
            view = View(Camera((x, 0.4, 3.0), (x, 0.4, 0.0), 0.6), SIZE)
            counts = stage.draw(view)
        assert counts["warped"] == 0 and counts["tile_error"] * 16 > 2  # pixels, that the walls may be off
        assert stage.renderer.targets is not None and stage.renderer.view is not None
        depth = np.frombuffer(stage.renderer.targets.depth.read(), np.float32).reshape(SIZE[::-1])
        seen = view_distance(depth, *stage.renderer.view.depth_range)[SIZE[1] // 2]
    across = ((np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2 - 1) * view.half_extent[0]  # metres at a distance of one
    right, left = (3.3 - EDGE) / (1 - across), (2.7 - EDGE) / (1 + across)
    wall = np.where(0.3 + across * right > 0, right, left)
    shown = np.isfinite(seen)
    assert shown.sum() > 100
    return np.asarray(np.abs(seen - wall)[shown])


@pytest.mark.parametrize(("steps", "least", "most"), [(0, 0.02, 0.1), (1, 0.0, 0.01)])
def test_walls_stay_where_they_are_while_the_viewer_walks(
    gl_device: Device, steps: int, least: float, most: float
) -> None:
    """Else what is painted on them slides along, shadows with it, and jumps back whenever the impostor is renewed.

    A flat picture, without the search, is off by centimetres.
    """
    assert least <= np.median(distances_off(gl_device, steps)) < most
