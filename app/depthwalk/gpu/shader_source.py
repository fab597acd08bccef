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

import re
from collections.abc import Iterable
from enum import IntEnum
from functools import cached_property, lru_cache
from importlib import import_module
from pathlib import Path

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
        self.files: list[str | Path] = []
        self._root = root or shader_root()
        texts = [self._expand(file) for file in (*includes, name) if file not in self.files]
        self.text = f"#version 330 core\n{preamble}{''.join(texts)}"

    def _expand(self, name: str | Path) -> str:
        """Return the text of a file with its `#include` and `#from` lines resolved, and add it to `files`."""
        path = self._root / name if isinstance(name, str) else name
        try:
            state = path.stat()
        except FileNotFoundError:
            raise GpuError(f"{_shown(name)}: no such shader") from None
        number = len(self.files)
        self.files.append(name)
        out = [_line(number, 1)]
        for index, text, match in _parsed(path, state.st_mtime_ns, state.st_size):
            if match is None:
                out.append(text)
            elif match.re is _FROM:
                try:
                    out += [*_constant_defines(match["rest"], isinstance(name, str)), _line(number, index + 1)]
                except (ImportError, AttributeError, TypeError, SyntaxError) as error:
                    raise GpuError(f"{_shown(name)}:{index}: {error}") from None
            elif (included := _included(name, match[1])) not in self.files:
                out += [self._expand(included), _line(number, index + 1)]
            else:
                out.append("")
        return "\n".join(out) + "\n"

    @cached_property
    def uniforms(self) -> frozenset[str]:
        """Return the names of all uniforms that the text declares."""
        return frozenset(_UNIFORM.findall(self.text))

    def locate(self, message: str) -> str:
        """Return the compiler's `message` with `shaders/file:line` in place of file numbers."""

        def name(match: re.Match[str]) -> str:
            number, line = divmod(int(match[2]), _LINES)
            return f"{_shown(self.files[number])}:{line}" if number < len(self.files) else match[0]

        return _LOCATION.sub(name, message)


@lru_cache(maxsize=1024)
def _parsed(path: Path, changed: int, size: int) -> tuple[tuple[int, str, re.Match[str] | None], ...]:
    """Read a file, once for each state of it: dozens of programs include the same ones.

    Parameters
    ----------
    path
        The file.
    changed, size
        When it was changed last, and how many bytes it has, which tell its states apart.

    Returns
    -------
    tuple
        A tuple for each `#include` and `#from` line, (its number from 1, "", the match of its pattern), and one for the
        lines between two of these, (0, their text, None).
    """
    found: list[tuple[int, str, re.Match[str] | None]] = []
    plain: list[str] = []
    for index, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
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


def _constant_defines(line: str, own_shader: bool) -> list[str]:
    """Return the `#define` lines that replace a `#from` line.

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
    AttributeError, TypeError
        Where the module has no such constant, or one that GLSL cannot express.
    """
    match = _FROM_REST.fullmatch(line)
    if match is None:
        raise SyntaxError("expected '#from MODULE import NAME', with 'as OTHER' and further names at will")
    if own_shader and match["module"].partition(".")[0] != _OWN_PACKAGE:
        raise ImportError(
            f"module {match['module']!r} is not of {_OWN_PACKAGE}, whose shaders take constants of its own"
        )
    module, lines = import_module(match["module"]), []
    for item in match["names"].split(","):
        name, _, other = (part.strip() for part in item.partition(" as "))
        value = getattr(module, name)
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
    """Return the name of a file for messages."""
    return f"shaders/{name}" if isinstance(name, str) else str(name)


def _included(by: str | Path, name: str) -> str | Path:
    """Return the file that `by` includes as `name`: beside `by`, if that is a Path and has it, else in `shaders/`."""
    beside = by.parent / name if isinstance(by, Path) else None
    return beside if beside is not None and beside.is_file() else name
