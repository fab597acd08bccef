"""What a pass is given: the frame's plan, view, light and targets; and what every pass must be."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Generic, TypeVar, cast, get_args, get_origin

from depthwalk.gpu.device import Device, Scope
from depthwalk.params import Params
from depthwalk.render.antialiasing.modes import AntiAliasing, anti_aliasing
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.draw.material_depth import MaterialRecords
from depthwalk.render.lighting.irradiance import Lighting
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.shadows.casters import Shadows
from depthwalk.render.targets import Targets
from depthwalk.render.view.view import View
from depthwalk.scene.render_settings import LodParams

if TYPE_CHECKING:  # the settings are made of the passes' parameters, and the scene's schema of the settings
    from depthwalk.scene.environment import Environment
    from depthwalk.scene.render_settings import RenderSettings

P = TypeVar("P", bound=Params)


@dataclass(frozen=True, kw_only=True)
class Common:
    """What several passes go by, of the settings; all else in them belongs to one pass each.

    forward: depth images are lit where they are shaded (`render.light.mode`); wireframe, show_tiles: those of
    `render.warp` and `render.composite`.
    """

    aa: AntiAliasing
    lod: LodParams
    forward: bool
    wireframe: bool
    show_tiles: bool


def common(settings: "RenderSettings") -> Common:
    return Common(
        aa=anti_aliasing(settings),
        lod=settings.lod,
        forward=settings.light.mode == "forward",
        wireframe=settings.warp.wireframe,
        show_tiles=settings.composite.show_tiles,
    )


@dataclass(frozen=True, kw_only=True)
class Frame:
    """One picture on its way.

    light: of sun and sky, derived once from the environment; targets: for a pass, those that it declares; transparent:
    alpha 0 where nothing is, instead of sky or background; shading: of the depth-image objects of all rounds, for
    passes that do not draw objects, as `shadows`: the maps of sun and lamps; lens_point: which of the frames this is
    that make up the picture; sample: which of a pixel's samples the G-buffer has, where the targets have several, seen
    through `view`.
    """

    view: View
    plan: FrameDrawLists
    common: Common
    environment: "Environment"
    light: Lighting
    assets: AssetStore
    targets: Targets
    transparent: bool = False
    shading: MaterialRecords | None = None
    shadows: Shadows = field(default_factory=Shadows)
    lens_point: int = 0
    sample: int = 0


class Pass(ABC, Generic[P]):
    """One stage of a frame, with parameters of a class of its own: `class FogPass(Pass[FogParams])`.

    Its name is that of its timer; of those in the package also that of module, shader folder, panel section and group
    in the render settings. `reads` and `writes` name targets (`render.targets.TARGETS`), and no others are within
    reach: a pass draws into `writes` what it computes from `reads`. A depth that it only tests against counts as read.

    A pass owns what it creates through `self.gl`, and sets GL state by `self.gl.state` alone, which restores it. One
    that `draws_objects` draws those of `frame.plan`, once for each round of objects; one that is `per_sample` draws
    once for each of a pixel's samples; others draw once.

    params: its own, for passes that have no group in the render settings; where they are given, they are taken in place
    of such a group. They may be changed between frames.
    """

    name: ClassVar[str]
    draws_objects: ClassVar[bool] = False
    per_sample: ClassVar[bool] = False
    reads: ClassVar[tuple[str, ...]] = ()
    writes: ClassVar[tuple[str, ...]] = ()
    Params: ClassVar[type[Params]] = Params  # P, from the head of the class

    gl: Scope

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        for base in getattr(cls, "__orig_bases__", ()):
            if get_origin(base) is Pass:
                (cls.Params,) = get_args(base)

    def __init__(self, params: P | None = None) -> None:
        self._has_own = params is not None
        self.params: P = cast(P, self.Params()) if params is None else params

    def attach(self, device: Device) -> None:
        """Create what the pass needs on a device. One pass serves one renderer at a time, or ValueError is raised."""
        if hasattr(self, "gl"):
            raise ValueError(f"pass {self.name} belongs to a renderer already")
        self.gl = device.scope(self.name)
        try:
            self.setup(self.gl)
        except BaseException:
            self.release()
            raise

    def params_in(self, settings: "RenderSettings") -> P:
        """The parameters that hold: its own, or its group in the settings."""
        group = getattr(settings, self.name, None)
        return cast(P, group) if isinstance(group, self.Params) and not self._has_own else self.params

    @abstractmethod
    def setup(self, gl: Scope) -> None:
        """Create programs and buffers."""

    def resize(self, size: tuple[int, int]) -> None:
        """Called before the first frame and whenever the picture's size changes."""

    def views(self, view: View, params: P) -> Iterable[View]:
        """Of what frames the picture consists: one, unless the pass blends several."""
        return (view,)

    def enabled(self, frame: Frame, params: P) -> bool:
        """Whether there is anything to draw in this frame; asked when all passes before have drawn."""
        return True

    @abstractmethod
    def draw(self, frame: Frame, params: P) -> None:
        """Draw into the targets that it writes."""

    def forget_assets(self) -> None:
        """Drop what refers to assets, because they are about to be released."""

    def release(self) -> None:
        """Free what the pass has on the device, which it then no longer belongs to."""
        if hasattr(self, "gl"):
            self.gl.release()
            del self.gl
