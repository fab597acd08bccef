"""Define `Pass`, the contract of every pass, and `Frame`, what a pass is given.

A frame is drawn by passes that run one after the other and communicate only through targets, the textures that they
read and write (`render.target_table.TARGETS`). What they draw, and through which camera, comes with the `Frame`; how
they draw it is set by their own parameters.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, ClassVar, Generic, TypeVar, cast, get_args, get_origin

from depthwalk.gpu.device import Device, Scope
from depthwalk.params import Params
from depthwalk.render.antialiasing.modes import AntiAliasing, anti_aliasing
from depthwalk.render.culling.objects_part import Part
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.draw.material_depth import MaterialRecords
from depthwalk.render.draw.translucency_planner import NO_TRANSLUCENT_DRAWS, TranslucentDraws
from depthwalk.render.lighting.irradiance import Lighting
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.shadows.casters import Shadows
from depthwalk.render.targets import Targets
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Representation
from depthwalk.scene.environment import Environment
from depthwalk.scene.object_settings import LodParams
from depthwalk.scene.render_settings import RenderSettings

P = TypeVar("P", bound=Params)


@dataclass(frozen=True, kw_only=True)
class Common:
    """Hold the settings that several passes read; every other setting belongs to one pass.

    Attributes
    ----------
    aa : the anti-aliasing of the picture.
    lod : levels of detail, `render.lod`.
    forward : whether depth images are lit where their colour is looked up, instead of later with everything else.
    lit_tiles : whether they are lit in pass 1, so that impostor tiles hold lit colours; `forward` is then set too, for
        depth images that are drawn without a tile.
    wireframe : whether the triangles of depth images are drawn as lines.
    show_tiles : whether every impostor tile is painted in a colour of its own.
    inspects : whether something else than the lit picture is shown, whose colours are not light.
    numbers_polygons : whether it is told how objects are drawn, so that polygons have numbers in the visibility buffer.
    """

    aa: AntiAliasing
    lod: LodParams
    forward: bool
    lit_tiles: bool
    wireframe: bool
    show_tiles: bool
    inspects: bool
    numbers_polygons: bool


def common_settings(settings: RenderSettings) -> Common:
    """Return those of the render `settings` of a scene that several passes read."""
    return Common(
        aa=anti_aliasing(settings),
        lod=settings.lod,
        forward=settings.light.mode != "deferred",
        lit_tiles=settings.light.mode == "warp",
        wireframe=settings.warp.wireframe,
        show_tiles=settings.composite.show_tiles,
        inspects=settings.inspection.show != "picture",
        numbers_polygons=settings.inspection.how_drawn is not None,
    )


@dataclass(frozen=True, kw_only=True)
class Frame:
    """Hold everything that passes are given about the frame that they draw.

    Attributes
    ----------
    view : the camera and the size of the targets, near and far plane fitted to what is in sight.
    plan : the draw lists: of the current occlusion phase for passes that draw objects, of the whole frame for others.
    common : the settings that several passes read.
    environment : sun, sky, ground, fog and lamps of the scene.
    light : the light of sun and sky, derived once from the environment.
    assets : the assets that are on the GPU.
    targets : the textures to read and draw into; a pass reaches those that it declares.
    transparent : whether pixels where nothing is drawn get alpha 0; otherwise they show the sky or the background.
    materials : the depth-image objects that may be visible, for `material_resolve`; None for passes that draw objects.
    shadows : what the shadow maps of sun and lamps are to show; empty for passes that draw objects.
    translucent : what lets light through or glows, for `translucency`; empty for passes that draw objects.
    lens_point : the number of this frame, from 0, among those that make up one picture (see `Pass.views`).
    objects_part : the part of the picture in which all surfaces are seen: x and y of its lower left corner, width and
        height, pixels; None where they may be anywhere.
    sample : the number, from 0, of the sample of each pixel that the G-buffer holds, where the targets have several.
    """

    view: View
    plan: FrameDrawLists
    common: Common
    environment: Environment
    light: Lighting
    assets: AssetStore
    targets: Targets
    transparent: bool = False
    materials: MaterialRecords | None = None
    shadows: Shadows = field(default_factory=Shadows)
    translucent: TranslucentDraws = NO_TRANSLUCENT_DRAWS
    lens_point: int = 0
    objects_part: Part | None = None
    sample: int = 0

    def with_targets(self, targets: Targets) -> "Frame":
        """Return the same frame with other `targets`; `dataclasses.replace` takes ten times as long."""
        frame = object.__new__(Frame)
        frame.__dict__.update(self.__dict__, targets=targets)
        return frame


class Pass(ABC, Generic[P]):
    """Draw one stage of a frame, with parameters of a class of its own.

    A subclass declares `name`, `reads` and `writes`, and implements `setup` and `draw`. The renderer then calls:

    ==================  ================================================================================================
    `attach`, `setup`   Once, before the first frame: create programs and buffers through `gl`.
    `resize`            Before the first frame and whenever the size of the targets changes.
    `views`             Once per picture: ask of which frames it consists.
    `enabled`           Once per frame, when all passes before have drawn: ask whether there is anything to draw.
    `draw`              Where `enabled` returned True: draw into the targets of `writes`, from those of `reads`.
    `parts`             The same in several steps; the renderer calls this, which calls `draw` unless overridden.
    `forget_assets`     Before assets are released: drop what refers to their buffers.
    `release`           At the end: free what was created. The pass may then be attached to another renderer.
    ==================  ================================================================================================

    A pass that follows a `render.pixel_pass.PixelPass` is asked `enabled` before that one draws: the two may share a
    program.

    `enabled` and `draw` run once per frame, but once per occlusion phase for a pass that `draws_objects`, and once per
    sample of a pixel for one that is `per_sample`.

    A pass may rely on this: GL state is the default of `gpu.state.State` (no depth test, no blending, no culling), and
    the uniform block `View` of shaders/common/view.glsl holds `frame.view`. Which framebuffer and textures are bound is
    undefined. In return a pass sets GL state only by `self.gl.state`, which restores it, creates GL objects only
    through `self.gl`, which frees them, and touches only the targets that it declares, as `frame.targets` enforces.

    Parameters
    ----------
    params
        Its parameters, in place of its group of the render settings. None: that group or, where there is none, the
        defaults.

    Attributes
    ----------
    name : names its timer; for the package's own passes also the module, the shader folder, the panel section and the
        group in the render settings.
    draws_objects : whether it draws the objects of `frame.plan`; such passes run before all others.
    per_sample : whether it runs for each sample of a pixel, where targets have several.
    blends_shown : whether it runs after all other passes in frames whose `common.aa.shown` is set, and draws into the
        screen then.
    representation : the one of `scene.arrays.HEIGHT_FIELDS` or `CAPTURED` that it draws; phases without such objects
        skip the pass before they ask `enabled`. None for all other passes.
    reads : names of the targets (`render.target_table.TARGETS`) that it reads. A depth that is only tested against
        counts as read.
    writes : names of the targets that it draws into.
    Params : the class of its parameters: P of the base class `Pass[P]` that a subclass names.
    gl : creates and owns GL objects; set from `attach` to `release`.
    params : the parameters that hold where the render settings have no group of the pass's name; may be changed between
        frames.

    Examples
    --------
    A pass that darkens the corners of the picture::

        class VignetteParams(Params):
            strength: float = param(0.5, "Part of the light that the corners lose", ge=0, le=1)

        class VignettePass(Pass[VignetteParams]):
            name = "vignette"
            reads = ("lit",)
            writes = ("lit",)

            def setup(self, gl: Scope) -> None:
                self._program = Program(gl, "common/fullscreen.vert", Path(__file__).with_name("vignette.frag"))

            def enabled(self, frame: Frame, params: VignetteParams) -> bool:
                return params.strength > 0

            def draw(self, frame: Frame, params: VignetteParams) -> None:
                frame.targets.lit_before().use(0)
                self._program.set(lit_texture=0, strength=params.strength)
                with self.gl.state(into=frame.targets.lit):
                    self._program.fill()

    Insert it into the order of passes::

        passes = default_passes()
        passes.insert(-1, VignettePass(VignetteParams(strength=0.3)))  # before `output`
        renderer = Renderer(device, scene, library, passes)
    """

    name: ClassVar[str]
    draws_objects: ClassVar[bool] = False
    per_sample: ClassVar[bool] = False
    blends_shown: ClassVar[bool] = False
    representation: ClassVar[Representation | None] = None
    reads: ClassVar[tuple[str, ...]] = ()
    writes: ClassVar[tuple[str, ...]] = ()
    Params: ClassVar[type[Params]] = Params  # P, from the head of the class

    gl: Scope

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        for base in getattr(cls, "__orig_bases__", ()):
            origin = get_origin(base)
            if isinstance(origin, type) and issubclass(origin, Pass):
                (params,) = get_args(base)
                if isinstance(params, type):  # not a type variable of a base class that leaves it open
                    cls.Params = params

    def __init__(self, params: P | None = None) -> None:
        self._has_own_params = params is not None
        self.params: P = cast(P, self.Params()) if params is None else params

    def attach(self, device: Device) -> None:
        """Create what the pass needs on `device`.

        Parameters
        ----------
        device : the GPU that the renderer draws with.

        Raises
        ------
        ValueError
            Where the pass is attached to a renderer already: it keeps state from frame to frame, which two renderers
            would mix up.
        """
        if hasattr(self, "gl"):
            raise ValueError(f"pass {self.name} belongs to a renderer already")
        self.gl = device.scope(self.name)
        try:
            self.setup(self.gl)
        except BaseException:
            self.release()
            raise

    def params_in(self, settings: RenderSettings) -> P:
        """Return the parameters to draw with: those that the pass was made with, else its group of the settings.

        Parameters
        ----------
        settings : the render settings, whose group with the name of the pass is used.

        Returns
        -------
        The parameters; where there is no such group, the attribute `params`.
        """
        if self._has_own_params:
            return self.params
        group: Any = vars(settings).get(self.name)  # `getattr` takes ten times as long where there is none
        # Asking pydantic's classes for their instances is slow.
        is_own = type(group) is self.Params or (group is not None and isinstance(group, self.Params))
        return group if is_own else self.params

    @abstractmethod
    def setup(self, gl: Scope) -> None:
        """Create the programs and buffers that the pass draws with.

        Parameters
        ----------
        gl : creates and owns GL objects, and frees them when the pass is released.
        """

    def resize(self, size: tuple[int, int]) -> None:
        """Drop what depends on the size of the targets; by default, nothing.

        Parameters
        ----------
        size : the new width and height of the targets, pixels.
        """

    def views(self, view: View, params: P) -> Iterable[View]:
        """Return the views of the frames that make up one picture: one view, unless the pass blends several frames.

        Parameters
        ----------
        view : the view of the picture.
        params : the pass's own parameters.

        Returns
        -------
        The views in the order in which their frames are drawn; by default `view` alone.
        """
        return (view,)

    def enabled(self, frame: Frame, params: P) -> bool:
        """Return whether there is anything to draw; where there is not, the pass costs nothing and has no timer.

        Parameters
        ----------
        frame : the frame that is being drawn.
        params : the pass's own parameters.

        Returns
        -------
        Whether `draw` is to be called; by default True.
        """
        return True

    @abstractmethod
    def draw(self, frame: Frame, params: P) -> None:
        """Draw into the targets that `writes` names.

        Parameters
        ----------
        frame : what to draw, and the targets to draw into.
        params : the pass's own parameters.
        """

    def parts(self, frame: Frame, params: P) -> Iterator[None]:
        """Draw as `draw` does, in several parts, so that a window can show something between them.

        Whatever the caller draws between two parts leaves GL state at its default, and another framebuffer bound. So
        each part sets all state that it needs. By default there is one part, `draw`. A pass with several parts
        implements this, and its `draw` runs through all of them.

        Parameters
        ----------
        frame : what to draw, and the targets to draw into.
        params : the pass's own parameters.

        Yields
        ------
        None, between two parts.
        """
        self.draw(frame, params)
        yield from ()

    def forget_assets(self) -> None:
        """Drop all references to buffers of assets, which are about to be released; by default, nothing."""

    def release(self) -> None:
        """Free what the pass has created on its device; it may then be attached to another renderer."""
        if hasattr(self, "gl"):
            self.gl.release()
            del self.gl
