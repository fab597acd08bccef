from types import SimpleNamespace

import numpy as np
import pytest

from depthwalk.render.frame import common
from depthwalk.render.targets import Targets, declared
from depthwalk.render.view.view import View
from depthwalk.render.view.view_block import PICTURE_VIEW, ViewBlock
from depthwalk.scene.arrays import Camera
from depthwalk.scene.render_settings import RenderSettings

SIZE = (12, 8)
VIEW = View(Camera((0.0, 1.5, 0.0), (0.0, 1.0, -4.0), 0.9), SIZE, near=0.1, far=50.0)


class Alone:
    """A pass by itself, on targets that tests fill and read. Row 0 of all arrays is at the bottom."""

    def __init__(self, device, pass_, view=VIEW, samples=1):
        self.scope = device.scope("test")
        self.pass_, self.view = pass_, view
        pass_.attach(device)
        pass_.resize(view.size)
        self.targets = Targets(device, view.size, samples)
        self.targets.screen = self.scope.framebuffer([self.scope.texture(view.size, 4)])
        self._block = ViewBlock(self.scope, PICTURE_VIEW)

    def release(self):
        self.pass_.release()
        self.targets.release()
        self.scope.release()

    def frame(self, settings=None, **values):
        """A frame as the pass sees it; values: those of its fields that the pass looks at."""
        pass_ = self.pass_
        targets = declared(self.targets, pass_.name, pass_.reads, pass_.writes)
        fields = {"view": self.view, "common": common(settings or RenderSettings()), "transparent": False}
        return SimpleNamespace(**fields | {"targets": targets} | values)

    def draw(self, params=None, **values):
        self._block.show(self.view)
        self.pass_.draw(self.frame(**values), self.pass_.params if params is None else params)

    def fill_lit(self, colour):
        """colour: (H, W, 4), or what becomes it, linear."""
        texels = np.broadcast_to(np.asarray(colour, np.float16), (*self.view.size[::-1], 4))
        self.targets.lit_texture.write(texels.tobytes())

    def lit(self):
        return self.read("lit_texture", np.float16, 4).astype(float)

    def read(self, name, dtype, components):
        """A target (H, W, components)."""
        data = getattr(self.targets, name).read(alignment=1)
        return np.frombuffer(data, dtype).reshape(*self.view.size[::-1], components)


@pytest.fixture
def alone(gl_device):
    """Makes `Alone`s of passes, and releases them."""
    made = []

    def make(pass_, **options):
        made.append(Alone(gl_device, pass_, **options))
        return made[-1]

    yield make
    for each in made:
        each.release()
