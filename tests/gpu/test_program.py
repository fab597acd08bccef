"""Shader text: includes, constants of Python, and where mistakes are located. No GL but for uniforms."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from depthwalk.gpu import program
from depthwalk.gpu.device import Device
from depthwalk.gpu.failures import GpuError
from depthwalk.gpu.program import Program, Source, Variants


@pytest.fixture
def shaders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Writes files below a folder that stands for `shaders/`."""
    root = tmp_path / "shaders"
    root.mkdir()
    monkeypatch.setattr(program, "shader_root", lambda: root)

    def write(**texts: str) -> Path:
        for name, text in texts.items():
            (root / f"{name}.glsl").write_text(text)
        return root

    return write


def test_a_file_is_included_once_and_lines_keep_their_numbers(shaders: Callable[..., Path]) -> None:
    shaders(a='#include "b.glsl"\n#include "b.glsl"\nfloat a;\n', b="float b;\n")
    source = Source("a.glsl", "#define X 1\n")
    assert source.files == ["a.glsl", "b.glsl"]
    assert source.text.startswith("#version 330 core\n#define X 1\n#line 1 0\n")
    assert source.text.count("float b;") == 1
    lines = source.text.splitlines()
    assert lines[lines.index("float b;") - 1] == "#line 100001 1"
    assert lines[lines.index("float a;") - 2] == "#line 2 0"  # then the second include, an empty line


def test_messages_of_compilers_name_files(shaders: Callable[..., Path]) -> None:
    shaders(a='#include "b.glsl"\n', b="float b;\n")
    source = Source("a.glsl")
    assert source.locate("0:100007(3): error") == "shaders/b.glsl:7(3): error"  # Mesa forgets the file
    assert source.locate("0(12) : error C0000") == "shaders/a.glsl:12 : error C0000"  # NVIDIA
    assert source.locate("0:200007: of no file of ours") == "0:200007: of no file of ours"


def test_a_missing_file_is_named(shaders: Callable[..., Path], tmp_path: Path) -> None:
    shaders(a='#include "none.glsl"\n')
    with pytest.raises(GpuError, match=r"shaders/none\.glsl: no such shader"):
        Source("a.glsl")
    with pytest.raises(GpuError, match=r"outside\.frag: no such shader"):
        Source(tmp_path / "outside.frag")


def test_a_shader_from_outside_includes_what_lies_beside_it_and_ours(
    shaders: Callable[..., Path], tmp_path: Path
) -> None:
    shaders(ours="float ours;\n")
    (tmp_path / "beside.glsl").write_text("float beside;\n")
    outside = tmp_path / "mine.frag"
    outside.write_text('#include "beside.glsl"\n#include "ours.glsl"\n')
    text = Source(outside).text
    assert "float beside;" in text and "float ours;" in text


@pytest.mark.parametrize(
    "line",
    [
        "#from os.path import sep",
        "#from depthwalker.colour import LUMINANCE",
        "#from depthwalk.colour import",
        "#from depthwalk.colour LUMINANCE",
        "#from depthwalk.colour import LUMINANCE as",
        "#from depthwalk.colour import LUMINANCE LUMINANCE",
        "#from .colour import LUMINANCE",
        "#from depthwalk.colour import linear_from_srgb",
        "#from depthwalk.colour import NO_SUCH",
        "#from depthwalk.no_such import LUMINANCE",
    ],
)
def test_a_line_that_cannot_be_resolved_is_located(shaders: Callable[..., Path], line: str) -> None:
    shaders(a=f"float a;\n{line}\n")
    with pytest.raises(GpuError, match=r"^shaders/a\.glsl:2: "):
        Source("a.glsl")


def test_only_shaders_from_outside_name_modules_from_outside(
    shaders: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "users_constants.py").write_text("STEPS = 7\n")
    monkeypatch.syspath_prepend(tmp_path)
    line = "#from users_constants import STEPS as COUNT\n"
    (tmp_path / "mine.frag").write_text(line)
    assert "#define COUNT 7" in Source(tmp_path / "mine.frag").text
    shaders(a=line)
    with pytest.raises(GpuError, match=r"shaders/a\.glsl:1: module 'users_constants' is not of depthwalk"):
        Source("a.glsl")
    (tmp_path / "includes.frag").write_text('#include "a.glsl"\n')
    with pytest.raises(GpuError, match=r"shaders/a\.glsl:1: "):
        Source(tmp_path / "includes.frag")


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (3, "3"),
        (0.1, "0.1"),
        (np.float64(2.5), "2.5"),
        (np.array([1.0, 2.0, 3.0]), "vec3(1.0, 2.0, 3.0)"),
        (np.arange(9.0).reshape(3, 3), "mat3(0.0, 3.0, 6.0, 1.0, 4.0, 7.0, 2.0, 5.0, 8.0)"),
    ],
)
def test_values_are_written_as_glsl_has_them(
    shaders: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, value: float, expected: str
) -> None:
    (tmp_path / "mine.frag").write_text("#from depthwalk.colour import PLANTED\n")
    monkeypatch.setattr("depthwalk.colour.PLANTED", value, raising=False)
    assert f"#define PLANTED {expected}\n" in Source(tmp_path / "mine.frag").text


@pytest.mark.parametrize("value", [True, "text", np.zeros(4), None])
def test_values_that_glsl_cannot_have_are_refused(
    shaders: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, value: bool | str
) -> None:
    monkeypatch.setattr("depthwalk.colour.PLANTED", value, raising=False)
    shaders(a="#from depthwalk.colour import PLANTED\n")
    with pytest.raises(GpuError, match="neither a number nor three"):
        Source("a.glsl")


def test_variants_are_made_when_first_asked_for() -> None:
    made: list[tuple[str, ...]] = []
    variants = Variants(lambda defines: made.append(defines) or len(made))
    assert [variants["A",], variants[()], variants["A",]] == [1, 2, 1] and made == [("A",), ()]


def test_defines_and_uniforms_reach_the_program(gl_device: Device, shaders: Callable[..., Path]) -> None:
    shaders(
        v="void main() { gl_Position = vec4(4.0 * float(gl_VertexID % 2) - 1.0, 2.0 * gl_VertexID - 1.0, 0, 1); }",
        f="uniform vec2 both[2];\nuniform float unused;\n"
        "out vec4 c; void main() { c = vec4(SCALE * both[0], both[1]); }",
    )
    scope = gl_device.scope("test")
    made = Program(scope, "v.glsl", "f.glsl", ["SCALE=2.0"])
    texture = scope.texture((2, 2), 4, "f4")
    with scope.state(into=scope.framebuffer([texture])):
        made.set(both=np.array([[0.5, 1.0], [3.0, 4.0]], "f4").tobytes(), unused=1.0)
        made.fill()
    found = np.frombuffer(texture.read(), np.float32).reshape(-1, 4)
    with pytest.raises(KeyError, match="other"):
        made.set(other=1.0)
    scope.release()
    assert found[0] == pytest.approx([1.0, 2.0, 3.0, 4.0])


def test_uniforms_are_written_again_where_their_values_are_others(
    gl_device: Device, shaders: Callable[..., Path]
) -> None:
    shaders(
        v="void main() { gl_Position = vec4(4.0 * float(gl_VertexID % 2) - 1.0, 2.0 * gl_VertexID - 1.0, 0, 1); }",
        f="uniform float some[2];\nuniform vec2 one;\nout vec4 c; void main() { c = vec4(some[0], some[1], one); }",
    )
    scope = gl_device.scope("test")
    made, texture = Program(scope, "v.glsl", "f.glsl"), scope.texture((1, 1), 4, "f4")
    into = scope.framebuffer([texture])

    def drawn(**values: object) -> list[float]:
        made.set(**values)
        with scope.state(into=into):
            made.fill()
        return np.frombuffer(texture.read(), np.float32).tolist()

    some = [1.0, 2.0]
    assert drawn(some=some, one=(3.0, 4.0)) == [1, 2, 3, 4]
    some[1] = 5.0  # the same list
    assert drawn(some=some) == [1, 5, 3, 4]
    assert drawn(some=[1.0, 2.0], one=np.array([6.0, 7.0], "f4").tobytes()) == [1, 2, 6, 7]
    assert drawn(one=(6.0, 8.0)) == [1, 2, 6, 8] and drawn(one=(6.0, 8.0)) == [1, 2, 6, 8]
    scope.release()


def test_programs_of_our_shaders_are_compiled_when_they_are_used_others_at_once(
    gl_device: Device, shaders: Callable[..., Path], tmp_path: Path
) -> None:
    shaders(v="void main() { gl_Position = vec4(0); }\n", f="out vec4 o; void main() { o = vec4(1) }\n")
    scope, before = gl_device.scope("test"), gl_device.live["program"]
    program = Program(scope, "v.glsl", "f.glsl")
    assert gl_device.live["program"] == before
    with pytest.raises(GpuError, match=r"shaders/f\.glsl:1"):
        program.set(size=1)
    (tmp_path / "own.frag").write_text("out vec4 o; void main() { o = vec4(1) }\n")
    with pytest.raises(GpuError, match=r"own\.frag:1"):
        Program(scope, "v.glsl", tmp_path / "own.frag")
    scope.release()
