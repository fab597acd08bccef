"""The depth buffer in cells, against the NumPy twin."""

import numpy as np
import pytest

from depthwalk.gpu.device import Device
from depthwalk.reference.occlusion import farthest_cells
from depthwalk.render.culling.depth_readback import DepthReadback, cell_side
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from shapes import ShapeLibrary, scene_of, sphere


@pytest.mark.parametrize(("size", "side"), [((161, 121), 2), ((1024, 768), 2), ((1920, 1080), 2), ((2561, 1441), 4)])
def test_cells_are_as_in_the_reference(gl_device: Device, size: tuple[int, int], side: int) -> None:
    assert cell_side(size) == side
    renderer = Renderer(
        gl_device, scene_of((0, (0, 0, 0), 0.3, 1.0)), ShapeLibrary([sphere(0.5, 32, 16)], resolution=64)
    )
    scope = gl_device.scope("test")
    renderer.render(View(Camera((0, 0.5, 1.2), (0.4, 0.5, 0), 1.0), size), scope.framebuffer([scope.texture(size, 4)]))
    cells = DepthReadback(gl_device, size)
    assert renderer.targets is not None
    depth = np.frombuffer(renderer.targets.depth.read(alignment=1), np.float32).reshape(size[::-1])
    assert 0.1 < (depth < 1).mean() < 0.9
    cells.reduce(renderer.targets)
    np.testing.assert_allclose(cells.read(), farthest_cells(depth, side), rtol=2e-7)
    for each in (cells, renderer, scope):
        each.release()
