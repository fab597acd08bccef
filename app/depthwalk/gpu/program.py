"""Compile GLSL programs when they are first used, set their uniforms by name, and draw with them."""

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import moderngl

from depthwalk.gpu.device import Scope
from depthwalk.gpu.failures import GpuError
from depthwalk.gpu.linked_programs import LinkedProgram
from depthwalk.gpu.shader_source import ShaderSource

T = TypeVar("T")

_NEVER_SET = object()

# Extensions that shaders use where the compiler has them; each is then also #defined, by its name in capitals.
_PREAMBLE = "".join(
    f"#ifdef GL_ARB_{feature}\n#extension GL_ARB_{feature} : enable\n#define {feature.upper()} 1\n#endif\n"
    for feature in ("conservative_depth", "texture_gather")
)
# After the defines: what common/per_sample.glsl needs. Compilers may refuse it there, where other code may come before.
_PER_SAMPLE = "#ifdef MULTISAMPLED\n#extension GL_ARB_gpu_shader5 : require\n#endif\n"


class Program:
    """Hold a linked program, whose uniforms are set by keyword: `program.set(near=0.1, albedo=texture_unit)`.

    It is compiled when it is first used: most scenes use ten of a renderer's thirty programs, and the first picture
    waits for no other. Only a user's own shaders are compiled at once, so that mistakes in them are reported early.
    """

    def __init__(
        self,
        scope: Scope,
        vertex: str | Path,
        fragment: str | Path,
        defines: Iterable[str] = (),
        blocks: Mapping[str, int] = MappingProxyType({}),
        includes: Iterable[str | Path] = (),
    ) -> None:
        """Store what the program is compiled from.

        Parameters
        ----------
        scope
            The owner of the program and of its vertex array, when they are created.
        vertex, fragment
            The shaders of its two stages, as `ShaderSource` takes them.
        defines
            Names to #define in both shaders, for #ifdef; as 1 or, given as NAME=VALUE, as VALUE.
        blocks
            Binding points of uniform blocks by their names; those that are not named are bound to point 0.
        includes
            Files to include before the first line of the fragment shader, in this order.

        Raises
        ------
        GpuError
            Where a user's own shader does not compile, with file and line.
        """
        pairs = (define.partition("=") for define in defines)
        defined = "".join(f"#define {name} {value or 1}\n" for name, _, value in pairs)
        self._preamble = _PREAMBLE + defined + _PER_SAMPLE
        self._scope = scope
        self._files, self._includes, self._blocks = (vertex, fragment), tuple(includes), blocks
        if any(isinstance(file, Path) for file in (vertex, fragment, *self._includes)):
            _ = self.gl

    @property
    def gl(self) -> moderngl.Program:
        """Return moderngl's program, for vertex arrays; the first call compiles and links it.

        Raises GpuError, with file and line, where there is no such shader or it does not compile.
        """
        return self._linked.gl

    @cached_property
    def _linked(self) -> LinkedProgram:
        """Return the linked program; raises as `gl` does."""
        vertex, fragment = self._files
        stages = self._stages
        try:
            return self._scope.program(stages[0].text, stages[1].text, self._blocks)
        except moderngl.Error as error:
            message = str(error)
            stage = stages["vertex_shader" not in message]
            raise GpuError(f"{vertex} + {fragment}: {stage.locate(message)}") from error

    @cached_property
    def _stages(self) -> tuple[ShaderSource, ShaderSource]:
        """Return the texts of both stages."""
        vertex, fragment = self._files
        root = self._scope.device.shaders
        source = ShaderSource(fragment, self._preamble, self._includes, root)
        return ShaderSource(vertex, self._preamble, (), root), source

    @cached_property
    def _declared(self) -> frozenset[str]:
        """Return the names of all uniforms that the sources declare."""
        vertex, fragment = self._stages
        return vertex.uniforms | fragment.uniforms

    def set(self, **values: Any) -> None:
        """Set uniforms by name.

        Uniforms that the compiler removed, because nothing depends on them, are ignored. One that has the value already
        is not written again: comparing takes a tenth of the time, and most uniforms of a frame stay the same.

        Parameters
        ----------
        **values
            A value for each uniform: a number, a tuple, a list of these for an array, or `bytes`, written unchanged.

        Raises
        ------
        KeyError
            For a name that no source declares.
        """
        held, uniforms = self._linked.held, self._linked.uniforms
        for name, value in values.items():
            if held.get(name, _NEVER_SET) == value:
                continue
            uniform = uniforms.get(name)
            if uniform is not None:
                if isinstance(value, bytes):
                    uniform.write(value)
                else:
                    uniform.value = value
                # A copy, as the caller may change the list later.
                held[name] = list(value) if isinstance(value, list) else value
            elif name not in self._declared:
                raise KeyError(f"no uniform {name!r} in this program")

    @cached_property
    def array(self) -> moderngl.VertexArray:
        """Return the vertex array without attributes, for vertex shaders that compute vertices from `gl_VertexID`."""
        return self._scope.vertex_array(self.gl, [])

    def fill(self) -> None:
        """Draw one triangle, by which common/fullscreen.vert or common/far_plane.vert covers the whole picture."""
        self.array.render(moderngl.TRIANGLES, vertices=3)

    def rectangles(self, count: int = 1) -> None:
        """Draw `count` rectangles, each an instance of four vertices whose positions the vertex shader computes."""
        self.array.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=count)

    def octagons(self, count: int) -> None:
        """Draw `count` octagons, each an instance of eight vertices whose positions the vertex shader computes.

        The vertices alternate between the left and the right side, from the lower edge to the upper.
        """
        self.array.render(moderngl.TRIANGLE_STRIP, vertices=8, instances=count)

    def points(self, count: int) -> None:
        """Draw `count` points; the vertex shader computes their places and, by `device.PROGRAM_POINT_SIZE`, sizes."""
        self.array.render(moderngl.POINTS, vertices=count)


class Variants(dict[tuple[str, ...], T]):
    """Keep the variants of a program, or objects made for them, by their defines; each is created on first use."""

    def __init__(self, make: Callable[[tuple[str, ...]], T]) -> None:
        """Start empty. `make` is called with the defines of a variant, and returns what to keep for it."""
        super().__init__()
        self._make = make

    def __missing__(self, defines: tuple[str, ...]) -> T:
        """Create the variant with these `defines`, on first use."""
        self[defines] = made = self._make(defines)
        return made
