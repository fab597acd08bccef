"""Draw passes that need no other pixel than the one they draw; neighbours among them become one program.

Every pass on its own reads its pixel from textures and writes it into another one. Where the next pass needs the same
pixel alone, that traffic is all that keeps them apart: on a GPU it costs bandwidth, in software a third of their time.
So such a pass is a function in GLSL, from pixel to pixel, and `PixelPrograms` compiles those that follow each other
into one program, in which the pixel stays in registers. A pass drawn alone is a program of one function.
"""

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, TypeVar

import moderngl
import numpy as np

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import RecordTexture
from depthwalk.gpu.program import Program
from depthwalk.params import Params
from depthwalk.render.culling.objects_part import Part
from depthwalk.render.depth_framebuffers import DepthFramebuffers
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.image import has_texture, only_texture
from depthwalk.render.target_table import TARGETS

P = TypeVar("P", bound=Params)
Colour = tuple[float, float, float, float]

_VERTEX, _FRAGMENT = "common/far_plane.vert", "common/pixel_passes.frag"
_STRIP_PIXELS = 1 << 18  # in software some 10 ms of light
# The fields of `Pixel` in shaders/common/pixel.glsl that hold targets, and how one becomes the colour that is written.
_FIELDS = {"depth": "", "surface": "", "shadow": "vec4(pixel.shadow)", "lit": "pixel.lit"}
RESULTS = _FIELDS | {"screen": "pixel.screen"}
_TEXELS = {"f1": (np.uint8, 255.0), "f2": (np.float16, 1.0)}  # by moderngl's name, how texels are read, and what 1 is
# The halves of the pixels where something is, and where nothing is, which a test of the depth finds.
_SURFACES_TESTED, _SKY_TESTED = ("SURFACES", "TESTED"), ("SKY", "TESTED")


@dataclass(frozen=True, kw_only=True)
class PixelInputs:
    """Hold what the GLSL function of a pass needs in one frame, besides the pixel.

    Passes that are drawn together share one name space, in which equal names have equal values.

    Attributes
    ----------
    defines : names that are defined while it is compiled, see `Program`.
    textures : the textures by the names of its samplers.
    uniforms : the values of its other uniforms by their names.
    strip_pixels : how many pixels may be drawn in one part of the pass (`Pass.parts`).
    even_sky : whether the function leaves the same colour at all pixels where nothing is, if those before it do, and
        draws all others. Software rasterisers then clear to that colour, which takes a tenth of the time. EVEN_SKY is
        defined where all functions of a program say so and it draws such pixels.
    """

    defines: tuple[str, ...] = ()
    textures: Mapping[str, moderngl.Texture | RecordTexture] = field(default_factory=dict)
    uniforms: Mapping[str, Any] = field(default_factory=dict)
    strip_pixels: int = _STRIP_PIXELS
    even_sky: bool = False


class PixelPass(Pass[P]):
    """Draw every pixel of one target from the same pixel of others.

    A subclass declares as `Pass` does, in `writes` one target alone, and implements `inputs`. Its shader has a function
    `void draw_NAME(inout Pixel pixel)`, with the `name` of the pass, see shaders/common/pixel.glsl. Where the pass
    reads the depth, the function is compiled twice: with SKY defined it draws the pixels where nothing is, without it
    the others. TRANSPARENT is defined where pixels that show nothing are to be empty. The function must not look at
    other pixels of a target.

    Attributes
    ----------
    shader : the file of the function, as `Program` takes it; by default NAME/NAME.glsl below `shaders/`.
    maps_colour : whether the function depends on the colour of `lit` alone, on nothing else and no texture. It may then
        be computed of a smaller picture, which is magnified (`render.pixel_source`).

    Raises
    ------
    TypeError
        By the definition of a subclass that writes anything but one of the targets `shadow`, `lit` and `screen`.
    """

    shader: ClassVar[str | Path] = ""
    maps_colour: ClassVar[bool] = False

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "name" not in vars(cls):
            return
        if len(cls.writes) != 1 or not RESULTS.get(cls.writes[0]):
            written = ", ".join(name for name, colour in RESULTS.items() if colour)
            raise TypeError(f"pass {cls.name}: a pixel pass must write exactly one of the targets {written}")
        if "shader" not in vars(cls):
            cls.shader = f"{cls.name}/{cls.name}.glsl"

    def setup(self, gl: Scope) -> None:
        """Prepare the programs that draw the pass alone, which are compiled when first needed; `gl` owns them.

        A subclass with GL objects of its own extends this.
        """
        self._alone = PixelPrograms(gl)

    @abstractmethod
    def inputs(self, frame: Frame, params: P) -> PixelInputs:
        """Return what the GLSL function needs in `frame`.

        Parameters
        ----------
        frame : what to draw.
        params : the pass's own parameters.

        Returns
        -------
        Defines, textures and uniforms.
        """

    def fuses_with_previous(self, frame: Frame, params: P) -> bool:
        """Return whether the pass may be drawn together with the one before; by default True.

        Parameters
        ----------
        frame : what to draw.
        params : the pass's own parameters.

        Returns
        -------
        False where its function reads other pixels of what the pass before draws.
        """
        return True

    def fuses_with_next(self, frame: Frame, params: P) -> bool:
        """Return whether the next pass may be drawn together with this one; by default True.

        Parameters
        ----------
        frame : what to draw.
        params : the pass's own parameters.

        Returns
        -------
        False where its function leaves pixels as they are, by `discard`.
        """
        return True

    def draw(self, frame: Frame, params: P) -> None:
        """Draw the pass alone into its target.

        Parameters
        ----------
        frame : what to draw, and the targets to draw into.
        params : the pass's own parameters.
        """
        for _ in self.parts(frame, params):
            pass

    def parts(self, frame: Frame, params: P) -> Iterator[None]:
        """Draw as `draw` does; stop between strips of the picture.

        Parameters
        ----------
        frame : what to draw, and the targets to draw into.
        params : the pass's own parameters.

        Yields
        ------
        None, between two strips.
        """
        return self._alone.parts([DrawnPass(self, frame, params)])


class DrawnPass(NamedTuple):
    """Name a pass with all that it is drawn with.

    Attributes
    ----------
    pass_ : the pass.
    frame : what it draws, with the targets that it declares.
    params : its parameters.
    """

    pass_: Pass[Any]
    frame: Frame
    params: Any


class PixelPrograms:
    """Compile and draw groups of passes, each in one program.

    Parameters
    ----------
    gl : owns the programs.
    """

    def __init__(self, gl: Scope) -> None:
        self._gl = gl
        self._programs: dict[tuple[str | Path | tuple[str, ...], ...], Program] = {}
        self._with_depth = DepthFramebuffers(gl)
        self._single: dict[str, moderngl.Framebuffer] = {}  # by data type, one texel of it
        self._sky: tuple[Program, Mapping[str, Any], Colour] | None = None  # with the uniforms, and what it draws

    def parts(self, group: Sequence[DrawnPass]) -> Iterator[None]:
        """Draw passes into the target of the last of them; stop between strips of the picture.

        Parameters
        ----------
        group : instances of `PixelPass` that follow each other.

        Yields
        ------
        None, between two strips.
        """
        passes, inputs = passes_with_inputs(group)
        readers = _readers(group)
        textures = _textures(group, readers)
        for own in inputs:
            textures |= own.textures
        uniforms = {name: unit for unit, name in enumerate(textures)}
        uniforms |= joined_uniforms(inputs)
        defines = (
            *joined_defines(inputs),
            *(f"READS_{name.upper()}" for name in readers),
            *(("TRANSPARENT",) if group[0].frame.transparent else ()),
        )
        into, halves = self._halves(group, readers)
        even = ("EVEN_SKY",) if all(own.even_sky for own in inputs) else ()
        programs = {half: self._program(passes, (*defines, *half, *(even if "SKY" in half else ()))) for half in halves}
        for program in programs.values():
            program.set(**uniforms)
        if even and _SKY_TESTED in halves:
            del halves[_SKY_TESTED]
            colour = self._sky_colour(programs[_SKY_TESTED], uniforms, textures.values(), only_texture(into).dtype)
            with self._gl.state(into=into, depth_write=False):
                into.clear(color=colour)
        left, bottom, width, height = self._part(group[0].frame, into.size, halves)
        strips = -(-width * height // min(own.strip_pixels for own in inputs))
        for strip in range(strips):
            if strip:
                yield
            for unit, texture in enumerate(textures.values()):
                texture.use(unit)
            low, high = height * strip // strips, height * (strip + 1) // strips
            for half, depth_test in halves.items():
                with self._gl.state(into=into, depth_test=depth_test, depth_write=False):
                    into.scissor = left, bottom + low, width, high - low
                    programs[half].fill()
                    into.scissor = None  # type: ignore[assignment]  # moderngl's "no scissor", which its stubs forget

    @staticmethod
    def _part(frame: Frame, size: tuple[int, int], halves: Mapping[tuple[str, ...], str | None]) -> Part:
        """Return the part of a picture of `size` that must be drawn: where only surfaces are, that which holds them."""
        whole = 0, 0, *size
        if list(halves) != [_SURFACES_TESTED] or frame.view.size != size:
            return whole
        return frame.objects_part or whole

    def _halves(
        self, group: Sequence[DrawnPass], readers: Mapping[str, DrawnPass]
    ) -> tuple[moderngl.Framebuffer, dict[tuple[str, ...], str | None]]:
        """Return what a group draws into, and how often: defines of each half of the pixels, and its depth test."""
        into: moderngl.Framebuffer = getattr(group[-1].frame.targets, group[-1].pass_.writes[0])
        if "depth" not in readers:
            return into, {(): None}
        tested = self._tested(group[-1], into, readers["depth"].frame.targets.depth)
        if tested is None:
            return into, {("SURFACES",): None, ("SKY",): None}
        return tested, {_SURFACES_TESTED: ">", _SKY_TESTED: "=="}

    def _sky_colour(
        self,
        program: Program,
        uniforms: Mapping[str, Any],
        textures: Iterable[moderngl.Texture | RecordTexture],
        dtype: str,
    ) -> Colour:
        """Return what `program`, with `uniforms` set, draws where nothing is, as a texture of `dtype` holds it.

        It is drawn into one texel and read back when it may have changed.
        """
        if self._sky is None or self._sky[:2] != (program, uniforms):
            if dtype not in self._single:
                self._single[dtype] = self._gl.framebuffer([self._gl.texture((1, 1), 4, dtype)])
            for unit, texture in enumerate(textures):
                texture.use(unit)
            with self._gl.state(into=self._single[dtype]):
                program.fill()
            stored, one = _TEXELS[dtype]
            texel = np.frombuffer(only_texture(self._single[dtype]).read(alignment=1), stored)
            red, green, blue, alpha = (texel / np.float64(one)).tolist()
            self._sky = program, uniforms, (red, green, blue, alpha)
        return self._sky[2]

    def _program(self, passes: Sequence[PixelPass[Any]], defines: tuple[str, ...]) -> Program:
        """Return the program of a group of passes."""
        shaders = tuple(pass_.shader for pass_ in passes)
        key = (*shaders, defines)
        if key not in self._programs:
            own = (*defines, *call_defines(passes))
            self._programs[key] = Program(self._gl, _VERTEX, _FRAGMENT, own, includes=shaders)
        return self._programs[key]

    def _tested(
        self, last: DrawnPass, into: moderngl.Framebuffer, depth: moderngl.Texture
    ) -> moderngl.Framebuffer | None:
        """Return a framebuffer of the texture of `into`, which `last` draws into, with the picture's `depth` to test.

        The test saves a software rasteriser those pixels that a program discards. Elsewhere GL does not define what a
        texture yields that is tested against at the same time, and branches save as much there.

        Returns
        -------
        None on a GPU, and where `into` has no texture.
        """
        if not self._gl.device.software or not has_texture(into, depth.size):
            return None
        (name,) = last.pass_.writes
        return self._with_depth.of(name, into, depth)


def passes_with_inputs(group: Sequence[DrawnPass]) -> tuple[list[PixelPass[Any]], list[PixelInputs]]:
    """Return the passes of `group`, each an instance of `PixelPass`, and what the functions of each need."""
    passes: list[PixelPass[Any]] = []
    for drawn in group:
        assert isinstance(drawn.pass_, PixelPass)  # as `neighbours` groups them
        passes.append(drawn.pass_)
    return passes, [pass_.inputs(drawn.frame, drawn.params) for pass_, drawn in zip(passes, group, strict=True)]


def joined_defines(inputs: Iterable[PixelInputs]) -> tuple[str, ...]:
    """Return the defines of passes that share a program, each once."""
    return tuple(dict.fromkeys(chain.from_iterable(own.defines for own in inputs)))


def joined_uniforms(inputs: Iterable[PixelInputs]) -> dict[str, Any]:
    """Return the uniforms of passes that share a program."""
    return {name: value for own in inputs for name, value in own.uniforms.items()}


def call_defines(passes: Sequence[PixelPass[Any]]) -> tuple[str, str]:
    """Return the define that calls the functions of `passes` in turn, and that of what the last of them writes."""
    calls = " ".join(f"draw_{pass_.name}(pixel);" for pass_ in passes)
    return f"DRAW_PASSES={calls}", f"RESULT={RESULTS[passes[-1].writes[0]]}"


def _readers(group: Sequence[DrawnPass]) -> dict[str, DrawnPass]:
    """Return the targets that a group reads from textures, in the order of `TARGETS`, each with the first to do so."""
    readers: dict[str, DrawnPass] = {}
    written: set[str] = set()
    for drawn in group:
        for name in drawn.pass_.reads:
            if name in _FIELDS and name not in written:
                readers.setdefault(name, drawn)
        written.update(drawn.pass_.writes)
    return {name: readers[name] for name in TARGETS if name in readers}


def _textures(
    group: Sequence[DrawnPass], readers: Mapping[str, DrawnPass]
) -> dict[str, moderngl.Texture | RecordTexture]:
    """Return the textures of what a group reads by the names of their samplers; a copy of what it draws into too."""
    textures: dict[str, moderngl.Texture | RecordTexture] = {}
    for name, reader in readers.items():
        (attribute, *_), targets = TARGETS[name].textures, reader.frame.targets
        own = name == "lit" and "lit" in group[-1].pass_.writes
        textures[f"{name}_texture"] = targets.lit_before() if own else getattr(targets, attribute)
    return textures
