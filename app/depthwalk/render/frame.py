"""What a pass is given: the frame's plan, view, settings and targets; and what every pass must be."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import moderngl

from depthwalk.gpu.device import Device, Scope
from depthwalk.params import Params
from depthwalk.render.assets import AssetStore
from depthwalk.render.casters import Shadows
from depthwalk.render.frame_plan import FramePlan
from depthwalk.render.shading import Shading
from depthwalk.render.targets import Targets
from depthwalk.render.view import View

if TYPE_CHECKING:  # the settings are made of the passes' parameters, and the scene's schema of the settings
    from depthwalk.scene.environment import Environment


@dataclass
class Frame:
    """One picture on its way.

    settings: a RenderSettings, with a group of parameters per pass; transparent: alpha 0 where nothing is, instead of
    sky or background; shading: of the depth-image objects of all rounds, for passes that do not draw objects, as
    `shadows`: the maps of sun and lamps; lens_point: which of the frames this is that make up the picture; sample:
    which of a pixel's samples the G-buffer has, where the targets have several, seen through `view`.
    """

    view: View
    plan: FramePlan
    settings: Any
    environment: "Environment"
    assets: AssetStore
    targets: Targets
    screen: moderngl.Framebuffer
    transparent: bool = False
    shading: Shading | None = None
    shadows: Shadows = field(default_factory=Shadows)
    lens_point: int = 0
    sample: int = 0


class Pass(ABC):
    """One stage of a frame. Its name is that of its module, shader folder, timer, panel section and parameter group.

    A pass owns what it creates through `self.gl`, draws into `writes` what it computes from `reads` (names of
    targets), and leaves GL state as `Renderer` documents it. One that `draws_objects` draws those of `frame.plan`, once
    for each round of objects; one that is `per_sample` draws once for each of a pixel's samples; others draw once.
    """

    name: ClassVar[str]
    draws_objects: ClassVar[bool] = False
    per_sample: ClassVar[bool] = False
    reads: ClassVar[tuple[str, ...]] = ()
    writes: ClassVar[tuple[str, ...]] = ()
    Params: ClassVar[type[Params]] = Params

    def __init__(self, device: Device) -> None:
        self.gl: Scope = device.scope(self.name)
        self.setup()

    @abstractmethod
    def setup(self) -> None:
        """Creates programs and buffers."""

    def resize(self, size: tuple[int, int]) -> None:  # noqa: B027 - most passes own nothing of the screen's size
        """Called before the first frame and whenever the picture's size changes."""

    @abstractmethod
    def draw(self, frame: Frame) -> None: ...

    def forget_assets(self) -> None:  # noqa: B027 - only passes that keep vertex arrays of assets care
        """Drops what refers to assets, because they are about to be released."""

    def release(self) -> None:
        self.gl.release()
