"""A pass by itself, on targets that tests fill and read."""

from types import SimpleNamespace
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from depthwalk.gpu.device import Device
from depthwalk.params import Params
from depthwalk.render.declared_targets import declared
from depthwalk.render.frame import Frame, Pass, common_settings
from depthwalk.render.targets import Targets
from depthwalk.render.view.view import View
from depthwalk.render.view.view_block import PICTURE_VIEW, ViewBlock
from depthwalk.scene.arrays import Camera
from depthwalk.scene.environment import Environment
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.types import Array

SIZE = (12, 8)
VIEW = View(Camera((0.0, 1.5, 0.0), (0.0, 1.0, -4.0), 0.9), SIZE, near=0.1, far=50.0)


class Alone:
    """A pass by itself, on targets that tests fill and read. Row 0 of all arrays is at the bottom."""

    def __init__(self, device: Device, pass_: Pass[Any], view: View = VIEW, samples: int = 1) -> None:
        self.scope = device.scope("test")
        self.pass_, self.view = pass_, view
        pass_.attach(device)
        pass_.resize(view.size)
        self.targets = Targets(device, view.size, samples)
        self.targets.screen = self.scope.framebuffer([self.scope.texture(view.size, 4)])
        self._block = ViewBlock(self.scope, PICTURE_VIEW)

    def release(self) -> None:
        self.pass_.release()
        self.targets.release()
        self.scope.release()

    def frame(self, settings: RenderSettings | None = None, **values: object) -> Frame:
        """A frame as the pass sees it; values: those of its fields that the pass looks at."""
        pass_ = self.pass_
        targets = declared(self.targets, pass_.name, pass_.reads, pass_.writes)
        fields = {
            "view": self.view,
            "common": common_settings(settings or RenderSettings()),
            "environment": Environment(),
            "transparent": False,
            "objects_part": None,
        }
        return cast(Frame, SimpleNamespace(**fields | {"targets": targets} | values))

    def draw(self, params: Params | None = None, settings: RenderSettings | None = None, **values: object) -> None:
        self._block.show(self.view)
        self.pass_.draw(self.frame(settings, **values), self.pass_.params if params is None else params)

    def fill_lit(self, colour: ArrayLike) -> None:
        """colour: (H, W, 4), or what becomes it, linear."""
        texels = np.broadcast_to(np.asarray(colour, np.float16), (*self.view.size[::-1], 4))
        self.targets.lit_texture.write(texels.tobytes())

    def lit(self) -> Array:
        return self.read("lit_texture", np.float16, 4).astype(float)

    def read(self, name: str, dtype: DTypeLike, components: int) -> NDArray[Any]:
        """A target (H, W, components)."""
        data = getattr(self.targets, name).read(alignment=1)
        return np.frombuffer(data, dtype).reshape(*self.view.size[::-1], components)


class MakeAlone(Protocol):
    """Makes an `Alone`, which is released after the test."""

    def __call__(self, pass_: Pass[Any], view: View = VIEW, samples: int = 1) -> Alone: ...
