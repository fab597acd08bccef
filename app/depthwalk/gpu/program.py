"""GLSL programs from files: includes, correct line numbers in compiler messages, checked uniforms."""

import re
from collections.abc import Callable, Iterable
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import moderngl

from depthwalk.gpu.device import GpuError, Scope
from depthwalk.resources import shader_root

T = TypeVar("T")

_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
_UNIFORM = re.compile(r"^\s*uniform\s+\w+\s+(\w+)", re.MULTILINE)
_LOCATION = re.compile(r"\b(\d+)[:(](\d+)\)?")  # source:line of Mesa, source(line) of NVIDIA

# The compiler knows best what it has.
_PREAMBLE = "".join(
    f"#ifdef GL_ARB_{feature}\n#extension GL_ARB_{feature} : enable\n#define {feature.upper()} 1\n#endif\n"
    for feature in ("conservative_depth", "texture_gather")
)


class Source:
    """One shader stage: `#include "common/x.glsl"` is resolved below shaders/, each file at most once.

    name: a file below shaders/, or the Path of one elsewhere, which may also include what lies beside it.
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
            include = _INCLUDE.match(line)
            if include is None:
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


def _shown(name: str | Path) -> str:
    """How messages name a file."""
    return f"shaders/{name}" if isinstance(name, str) else str(name)


def _included(by: str | Path, name: str) -> str | Path:
    """The file that `by` includes as `name`: from beside a file that lies elsewhere, else below shaders/."""
    beside = by.parent / name if isinstance(by, Path) else None
    return beside if beside is not None and beside.is_file() else name


class Program:
    """A linked program whose uniforms are set by keyword: `program.set(near=0.1, albedo=texture_unit)`.

    defines: names that the shaders may ask for by #ifdef, which stand for 1 or, written NAME=VALUE, for that.
    """

    def __init__(self, scope: Scope, vertex: str | Path, fragment: str | Path, defines: Iterable[str] = ()) -> None:
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
