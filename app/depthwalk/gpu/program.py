"""GLSL programs from files: includes, constants of Python, line numbers in compiler messages, checked uniforms.

A constant that Python and GLSL must agree about is declared once, in Python. A shader names it where it needs it,

    #from depthwalk.cook.virtual_texture import GRAIN, LEVELS as SEGMENT_LEVELS

and `Source` writes `#define`s in place of that line. An integer enumeration gives one per member: `Face` gives
`FACE_TOP` and so on. The dtype of records in a texture of four floats a texel gives how many texels a record takes and
in which of them each field begins: `LAMP_RECORD` gives `LAMP_RECORD_TEXELS`, `LAMP_RECORD_PLACE` and so on.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from enum import IntEnum
from functools import cached_property
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import moderngl
import numpy as np

from depthwalk.gpu.device import GpuError, Scope
from depthwalk.resources import shader_root

T = TypeVar("T")

_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
_ITEM = r"\w+(?:\s+as\s+\w+)?"
_FROM = re.compile(rf"^\s*#from\s+(depthwalk(?:\.\w+)+)\s+import\s+({_ITEM}(?:\s*,\s*{_ITEM})*)\s*(?://.*)?$")
_UNIFORM = re.compile(r"^\s*uniform\s+\w+\s+(\w+)", re.MULTILINE)
_TEXEL_BYTES = 16  # of four floats
_LOCATION = re.compile(r"\b(\d+)[:(](\d+)\)?")  # source:line of Mesa, source(line) of NVIDIA

# The compiler knows best what it has.
_PREAMBLE = "".join(
    f"#ifdef GL_ARB_{feature}\n#extension GL_ARB_{feature} : enable\n#define {feature.upper()} 1\n#endif\n"
    for feature in ("conservative_depth", "texture_gather")
)


class Source:
    """The text of one shader stage, with its includes and constants resolved.

    name: a file below shaders/, or the Path of one elsewhere, which may also include what lies beside it.
    `#include "common/x.glsl"` is looked up below shaders/, each file at most once; for `#from` see the module's
    docstring. Raises GpuError for a file, module or constant that does not exist.
    """

    def __init__(self, name: str | Path, preamble: str = "") -> None:
        self.files: list[str | Path] = []
        self.text = f"#version 330 core\n{preamble}{self._expand(name)}"

    def _expand(self, name: str | Path) -> str:
        path = shader_root() / name if isinstance(name, str) else name
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except FileNotFoundError:
            raise GpuError(f"{_shown(name)}: no such shader") from None
        number = len(self.files)
        self.files.append(name)
        out = [f"#line 1 {number}"]
        for index, line in enumerate(lines, start=1):
            include, constants = _INCLUDE.match(line), _FROM.match(line)
            if constants is not None:
                try:
                    out += [*_constant_defines(constants[1], constants[2]), f"#line {index + 1} {number}"]
                except (ImportError, AttributeError, TypeError) as error:
                    raise GpuError(f"{_shown(name)}:{index}: {error}") from None
            elif include is None:
                out.append(line)
            elif (included := _included(name, include[1])) not in self.files:
                out += [self._expand(included), f"#line {index + 1} {number}"]
            else:
                out.append("")
        return "\n".join(out) + "\n"

    def locate(self, message: str) -> str:
        """The compiler's message with `shaders/file:line` in place of source numbers."""

        def name(match: re.Match[str]) -> str:
            number = int(match[1])
            return f"{_shown(self.files[number])}:{match[2]}" if number < len(self.files) else match[0]

        return _LOCATION.sub(name, message)


def _constant_defines(module: str, names: str) -> list[str]:
    """Return the `#define` lines of the constants that a `#from` line names, of a module."""
    lines = []
    for item in names.split(","):
        name, _, other = (part.strip() for part in item.partition(" as "))
        value = getattr(import_module(module), name)
        if isinstance(value, np.dtype):
            prefix = other or name
            lines.append(f"#define {prefix}_TEXELS {value.itemsize // _TEXEL_BYTES}")
            fields = (value.fields or {}).items()
            lines += [f"#define {prefix}_{field.upper()} {info[1] // _TEXEL_BYTES}" for field, info in fields]
        elif isinstance(value, type) and issubclass(value, IntEnum):
            lines += [f"#define {(other or name).upper()}_{member.name} {_glsl(member.value)}" for member in value]
        else:
            lines.append(f"#define {other or name} {_glsl(value)}")
    return lines


def _glsl(value: object) -> str:
    """Return an integer, a float, a vector (3,) or a matrix (3, 3) as GLSL; raises TypeError for anything else."""
    if isinstance(value, int) and not isinstance(value, bool):
        return str(int(value))
    if isinstance(value, float):
        return repr(float(value))
    if isinstance(value, np.ndarray) and value.shape in ((3,), (3, 3)):
        numbers = ", ".join(map(repr, value.T.ravel().tolist()))  # GLSL has matrices column by column
        return f"{'vec' if value.ndim == 1 else 'mat'}3({numbers})"
    raise TypeError(f"{value!r} is neither a number nor three or three by three of them")


def _shown(name: str | Path) -> str:
    """How messages name a file."""
    return f"shaders/{name}" if isinstance(name, str) else str(name)


def _included(by: str | Path, name: str) -> str | Path:
    """The file that `by` includes as `name`: from beside a file that lies elsewhere, else below shaders/."""
    beside = by.parent / name if isinstance(by, Path) else None
    return beside if beside is not None and beside.is_file() else name


class Program:
    """A linked program whose uniforms are set by keyword: `program.set(near=0.1, albedo=texture_unit)`.

    Parameters
    ----------
    defines
        Names that the shaders may ask for by #ifdef, which stand for 1 or, written NAME=VALUE, for that.
    blocks
        Binding points of uniform blocks by their names; those that are not named are bound to point 0.
    """

    def __init__(
        self,
        scope: Scope,
        vertex: str | Path,
        fragment: str | Path,
        defines: Iterable[str] = (),
        blocks: Mapping[str, int] = MappingProxyType({}),
    ) -> None:
        pairs = (each.partition("=") for each in defines)
        preamble = _PREAMBLE + "".join(f"#define {name} {value or 1}\n" for name, _, value in pairs)
        self._scope = scope
        stages = Source(vertex, preamble), Source(fragment, preamble)
        try:
            self.gl: moderngl.Program = scope.program(stages[0].text, stages[1].text)
        except moderngl.Error as error:
            message = str(error)
            stage = stages["vertex_shader" not in message]
            raise GpuError(f"{vertex} + {fragment}: {stage.locate(message)}") from error
        for name, binding in blocks.items():
            block: Any = self.gl.get(name, None)
            if block is not None:
                block.binding = binding
        self._declared = set(_UNIFORM.findall(stages[0].text) + _UNIFORM.findall(stages[1].text))

    def set(self, **values: Any) -> None:
        """Sets uniforms. One that the compiler removed is passed over; one that no source declares raises KeyError."""
        for name, value in values.items():
            uniform: Any = self.gl.get(name, None)
            if uniform is not None:
                if isinstance(value, bytes):
                    uniform.write(value)
                else:
                    uniform.value = value
            elif name not in self._declared:
                raise KeyError(f"no uniform {name!r} in this program")

    @cached_property
    def array(self) -> moderngl.VertexArray:
        """One without vertices, for vertex shaders that make them of their numbers."""
        return self._scope.vertex_array(self.gl, [])

    def fill(self) -> None:
        """Draws one triangle over all of the picture; with common/fullscreen.vert or far_plane.vert."""
        self.array.render(moderngl.TRIANGLES, vertices=3)

    def rectangles(self, count: int = 1) -> None:
        """Draws as many, of four vertices each."""
        self.array.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=count)


class Variants(dict[tuple[str, ...], T]):
    """What is made of a program's variants, by their defines, each when it is first asked for."""

    def __init__(self, make: Callable[[tuple[str, ...]], T]) -> None:
        super().__init__()
        self._make = make

    def __missing__(self, defines: tuple[str, ...]) -> T:
        self[defines] = made = self._make(defines)
        return made
