"""Pass 2 goes on behind cracks of intermediate images, and shows what is behind wider gaps and between surfaces."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import cast

import moderngl
import numpy as np
import pytest

from depthwalk.gpu.device import Device, Scope
from depthwalk.render.culling.depth_readback import DepthReadback
from depthwalk.render.frame import Frame, common_settings
from depthwalk.render.passes.composite import CompositePass
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from modes import AaName
from shapes import ShapeLibrary, box, scene_of

SIZE = (96, 96)
CAMERA = Camera((0, 0.5, 3), (0, 0.5, 0), 0.7)


@pytest.fixture
def wall(gl_device: Device) -> Iterator[tuple[Renderer, Scope, moderngl.Framebuffer]]:
    """A renderer of a box that fills the middle of the picture, a scope and a screen."""
    renderer = Renderer(gl_device, scene_of((0, (0, 0, 0), 0.0, 1.0)), ShapeLibrary([box(1, 1, 1, (0, 0.5, 0))]))
    scope = gl_device.scope("test")
    yield renderer, scope, scope.framebuffer([scope.texture(SIZE, 4)])
    renderer.release()
    scope.release()


@pytest.mark.parametrize(("aa", "widest"), [("none", 1), ("gpaa-edge", 2), ("msaa", 1)])
@pytest.mark.parametrize("along", [0, 1])
def test_cracks_are_bridged_and_gaps_are_not(
    wall: tuple[Renderer, Scope, moderngl.Framebuffer], aa: AaName, widest: int, along: int
) -> None:
    """Texels of the atlas along a line through the tile are emptied, what is beyond them may be moved away,
    and pass 2 draws it again."""
    renderer, scope, screen = wall
    renderer.settings.aa = aa
    renderer.render(View(CAMERA, SIZE), screen)
    targets, plan = renderer.targets, renderer.plan
    assert targets is not None
    stored = np.frombuffer(targets.atlas_depth.read(alignment=4), np.float32).reshape(targets.atlas_size[::-1])
    assert plan is not None
    x, y, width, height = plan.composite.records["tile"][0].astype(int)
    middle = (y + height // 2, x + width // 2)[along]
    cells = DepthReadback(renderer.device, targets.size)
    rows, columns = (slice(pixels // cells.side // 3, pixels // cells.side * 2 // 3) for pixels in targets.size[::-1])
    composite = next(each for each in renderer.passes if isinstance(each, CompositePass))
    for count, farther, holes in ((widest, 1.0, False), (2 * widest, 1.0, True), (widest, 1.1, True)):
        cut = stored.copy()
        lines = np.moveaxis(cut, along, 0)
        lines[middle : middle + count] = 1.0
        lines[middle + count :] = 1 - (1 - lines[middle + count :]) / farther
        targets.atlas_depth = scope.texture(targets.atlas_size, 1, "f4", cut.tobytes())
        targets.polygons.clear(depth=1.0)
        frame = SimpleNamespace(
            view=renderer.view, plan=plan, common=common_settings(renderer.settings), targets=targets
        )
        composite.draw(cast(Frame, frame), renderer.settings.composite)
        cells.reduce(targets)
        farthest = cells.read()[rows, columns]  # of all samples, well within the wall
        assert (farthest == 1.0).any() == holes
    cells.release()
