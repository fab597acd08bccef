"""Assemble the text of a shader from its files, and find the line of a file that a compiler complains about.

Two kinds of lines are resolved before the compiler sees a shader:

`#include "common/x.glsl"` is replaced by that file, which is looked up below `shaders/` and included at most once.

`#from depthwalk.cook.used_texels import SUB_TILE` is replaced by `#define` lines. A constant that Python and GLSL
share, such as a bit width or the layout of a record, is declared once, in Python, and shaders import it where they need
it, so that the two cannot differ. Several names are separated by commas, and `NAME as OTHER` renames one. What is
defined depends on the value:

- an integer or a float: the number;
- an array (3,) or (3, 3): a `vec3` or `mat3`;
- an integer enumeration: one name per member, such as `FACE_TOP` for `Face.TOP`;
- the dtype of records in a texture of four floats per texel: the number of texels of a record, and the first texel of
  each field, such as `LAMP_RECORD_TEXELS` and `LAMP_RECORD_PLACE` for the field `place` of `LAMP_RECORD`.

The module is imported by its name, which runs it. Shaders below `shaders/` may therefore only name modules of
`depthwalk`. A shader that a user's own code hands over as a `Path` may name any module, as that code itself may. Every
mistake, from a misspelt line to a constant that does not exist, is a GpuError that begins with the shader's file and
line.
"""

import os
import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property, lru_cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np

from depthwalk.gpu.failures import GpuError
from depthwalk.resources import shader_root

_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
_ITEM = r"\w+(?:\s+as\s+\w+)?"
_FROM = re.compile(r"^\s*#from\b(?P<rest>.*)$")
_FROM_REST = re.compile(rf"\s+(?P<module>\w+(?:\.\w+)*)\s+import\s+(?P<names>{_ITEM}(?:\s*,\s*{_ITEM})*)\s*(?://.*)?")
_UNIFORM = re.compile(r"^\s*uniform\s+\w+\s+(\w+)", re.MULTILINE)
_OWN_PACKAGE = "depthwalk"
_TEXEL_BYTES = 16  # of four floats
_MOST_BODIES = 512  # texts that are kept, some MB; all shaders of the package have a fifth as many
_GONE = object()
# More lines than a file has: line 7 of file 3 is reported as line 300007, as Mesa may lose the number of the file.
_LINES = 100_000
_LOCATION = re.compile(r"\b(\d+)[:(](\d+)\)?")  # source:line of Mesa, source(line) of NVIDIA


class ShaderSource:
    """Hold the text of one shader stage, with its includes and constants resolved as the module describes.

    Attributes
    ----------
    text
        The text for the compiler.
    files
        The files that it was assembled from, by their number in the compiler's messages.
    """

    def __init__(
        self, name: str | Path, preamble: str = "", includes: Iterable[str | Path] = (), root: Path | None = None
    ) -> None:
        """Read a shader.

        Parameters
        ----------
        name
            A file below `shaders/`, or the Path of a file elsewhere, which may also include files from its own folder.
        preamble
            Lines of GLSL to put before the first line of the shader.
        includes
            Files to include between the two, in this order.
        root
            The folder to use as `shaders/`; None: `shader_root`.

        Raises
        ------
        GpuError
            For a file, module or constant that does not exist, and for a `#from` line that cannot be understood.
        """
        includes = tuple(includes)
        body = _body(root or shader_root(), includes, name)
        self._body, self._preamble = body, preamble
        self.files: tuple[str | Path, ...] = body.files
        self.text = f"#version 330 core\n{preamble}{body.text}"

    @cached_property
    def uniforms(self) -> frozenset[str]:
        """Return the names of all uniforms that the text declares."""
        return self._body.uniforms | frozenset(_UNIFORM.findall(self._preamble))

    def locate(self, message: str) -> str:
        """Return the compiler's `message` with `shaders/file:line` in place of file numbers."""

        def name(match: re.Match[str]) -> str:
            number, line = divmod(int(match[2]), _LINES)
            return f"{_shown(self.files[number])}:{line}" if number < len(self.files) else match[0]

        return _LOCATION.sub(name, message)


@dataclass(frozen=True, kw_only=True)
class _Body:
    """Hold what stands after the preamble of a shader, and what it was made from.

    files: as in `ShaderSource`; states: path, time of the last change in ns and size in bytes of each file; constants:
    module, name and value of each constant.
    """

    text: str
    files: tuple[str | Path, ...]
    states: tuple[tuple[str, int, int], ...]
    constants: tuple[tuple[ModuleType, str, object], ...]

    @cached_property
    def uniforms(self) -> frozenset[str]:
        """Return the names of all uniforms that the text declares."""
        return frozenset(_UNIFORM.findall(self.text))

    @property
    def is_current(self) -> bool:
        """Return whether the files and the constants are still the same."""
        return all(getattr(module, name, _GONE) is value for module, name, value in self.constants) and all(
            _state(path) == (path, *state) for path, *state in self.states
        )


_bodies: dict[tuple[Path, tuple[str | Path, ...], str | Path], _Body] = {}


def _body(root: Path, includes: tuple[str | Path, ...], name: str | Path) -> _Body:
    """Return what stands after the preamble of a shader; the parameters are those of `ShaderSource`.

    Variants of a program differ in their preambles only, and each renderer asks for the same programs. So it is kept,
    unless a user's file takes part: which file that includes may depend on what lies beside it.
    """
    key = root, includes, name
    body = _bodies.get(key)
    if body is None or not body.is_current:
        body = _Assembly(root).assembled((*includes, name))
        if not any(isinstance(file, Path) for file in body.files):
            if len(_bodies) >= _MOST_BODIES:
                _bodies.clear()
            _bodies[key] = body
    return body


class _Assembly:
    """Assemble the text of a shader below a `root`, noting what it is made from, see `_Body`."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._files: list[str | Path] = []
        self._states: list[tuple[str, int, int]] = []
        self._constants: list[tuple[ModuleType, str, object]] = []

    def assembled(self, names: tuple[str | Path, ...]) -> _Body:
        """Return the texts of several files, one after the other, each once."""
        texts = [self._expand(file) for file in names if file not in self._files]
        states, constants = tuple(self._states), tuple(self._constants)
        return _Body(text="".join(texts), files=tuple(self._files), states=states, constants=constants)

    def _expand(self, name: str | Path) -> str:
        """Return the text of a file with its `#include` and `#from` lines resolved, and note what it is made from."""
        path = self._root / name if isinstance(name, str) else name
        try:
            state = _state(str(path))
        except FileNotFoundError:
            raise GpuError(f"{_shown(name)}: no such shader") from None
        number = len(self._files)
        self._files.append(name)
        self._states.append(state)
        out = [_line(number, 1)]
        for index, text, match in _parsed(*state):
            if match is None:
                out.append(text)
            elif match.re is _FROM:
                try:
                    constants = _constants(match["rest"], isinstance(name, str))
                    for module, constant, other in constants:
                        value = getattr(module, constant)
                        self._constants.append((module, constant, value))
                        out += _defines(other, value)
                    out.append(_line(number, index + 1))
                except (ImportError, AttributeError, TypeError, SyntaxError) as error:
                    raise GpuError(f"{_shown(name)}:{index}: {error}") from None
            elif (included := _included(name, match[1])) not in self._files:
                out += [self._expand(included), _line(number, index + 1)]
            else:
                out.append("")
        return "\n".join(out) + "\n"


def _state(path: str) -> tuple[str, int, int]:
    """Return a path with what tells states of its file apart: the time of the last change, ns, and the size, bytes."""
    state = os.stat(path)
    return path, state.st_mtime_ns, state.st_size


@lru_cache(maxsize=1024)
def _parsed(path: str, changed: int, size: int) -> tuple[tuple[int, str, re.Match[str] | None], ...]:
    """Read a file, once for each state of it: dozens of programs include the same ones.

    Parameters
    ----------
    path, changed, size
        Its state, see `_state`.

    Returns
    -------
    tuple
        A tuple for each `#include` and `#from` line, (its number from 1, "", the match of its pattern), and one for the
        lines between two of these, (0, their text, None).
    """
    found: list[tuple[int, str, re.Match[str] | None]] = []
    plain: list[str] = []
    for index, line in enumerate(Path(path).read_text(encoding="utf-8").splitlines(), start=1):
        match = (_FROM.match(line) or _INCLUDE.match(line)) if "#" in line else None
        if match is None:
            plain.append(line)
            continue
        if plain:
            found.append((0, "\n".join(plain), None))
            plain = []
        found.append((index, "", match))
    return (*found, (0, "\n".join(plain), None)) if plain else tuple(found)


def _line(number: int, line: int) -> str:
    """Return the `#line` directive for `line`, from 1, of the file with the `number`."""
    return f"#line {number * _LINES + line} {number}"


def _constants(line: str, own_shader: bool) -> list[tuple[ModuleType, str, str]]:
    """Return the constants that a `#from` line names: the module of each, its name there and its name in the shader.

    Parameters
    ----------
    line
        The rest of the line after `#from`.
    own_shader
        Whether it is in a shader below `shaders/`, which may only name modules of depthwalk.

    Raises
    ------
    SyntaxError
        Where the line cannot be understood.
    ImportError
        Where there is no such module, or this shader may not name it.
    """
    match = _FROM_REST.fullmatch(line)
    if match is None:
        raise SyntaxError("expected '#from MODULE import NAME', with 'as OTHER' and further names at will")
    if own_shader and match["module"].partition(".")[0] != _OWN_PACKAGE:
        raise ImportError(
            f"module {match['module']!r} is not of {_OWN_PACKAGE}, whose shaders take constants of its own"
        )
    module = import_module(match["module"])
    parts = (item.partition(" as ") for item in match["names"].split(","))
    return [(module, name.strip(), (other or name).strip()) for name, _, other in parts]


def _defines(name: str, value: object) -> list[str]:
    """Return the `#define` lines for a constant by its name in the shader; raises TypeError as `_glsl` does."""
    if isinstance(value, np.dtype):
        fields = (value.fields or {}).items()
        offsets = [f"#define {name}_{field.upper()} {info[1] // _TEXEL_BYTES}" for field, info in fields]
        return [f"#define {name}_TEXELS {value.itemsize // _TEXEL_BYTES}", *offsets]
    if isinstance(value, type) and issubclass(value, IntEnum):
        return [f"#define {name.upper()}_{member.name} {_glsl(member.value)}" for member in value]
    return [f"#define {name} {_glsl(value)}"]


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
    """Return the name of a file for messages."""
    return f"shaders/{name}" if isinstance(name, str) else str(name)


def _included(by: str | Path, name: str) -> str | Path:
    """Return the file that `by` includes as `name`: beside `by`, if that is a Path and has it, else in `shaders/`."""
    beside = by.parent / name if isinstance(by, Path) else None
    return beside if beside is not None and beside.is_file() else name
