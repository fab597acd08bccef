"""Shader text: includes, constants of Python, and where mistakes are located. No GL."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from depthwalk.gpu.failures import GpuError
from depthwalk.gpu.shader_source import ShaderSource


def test_a_file_is_included_once_and_lines_keep_their_numbers(shaders: Callable[..., Path]) -> None:
    shaders(a='#include "b.glsl"\n#include "b.glsl"\nfloat a;\n', b="float b;\n")
    source = ShaderSource("a.glsl", "#define X 1\n")
    assert source.files == ("a.glsl", "b.glsl")
    assert source.text.startswith("#version 330 core\n#define X 1\n#line 1 0\n")
    assert source.text.count("float b;") == 1
    lines = source.text.splitlines()
    assert lines[lines.index("float b;") - 1] == "#line 100001 1"
    assert lines[lines.index("float a;") - 2] == "#line 2 0"  # then the second include, an empty line


def test_what_was_assembled_before_is_read_again_once_a_file_or_a_constant_has_changed(
    shaders: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("depthwalk.colour.PLANTED", 1.5, raising=False)
    shaders(a='#include "b.glsl"\nuniform float a;\n', b="#from depthwalk.colour import PLANTED\n", c="float c;\n")
    first, variant = ShaderSource("a.glsl"), ShaderSource("a.glsl", "uniform int own;\n", ["c.glsl"])
    assert "#define PLANTED 1.5\n" in first.text and first.uniforms == {"a"}
    assert variant.uniforms == {"a", "own"} and variant.files == ("c.glsl", "a.glsl", "b.glsl")
    monkeypatch.setattr("depthwalk.colour.PLANTED", 2.5)
    assert ShaderSource("a.glsl").text == first.text.replace("1.5", "2.5")
    shaders(b="uniform float included;\n")
    assert ShaderSource("a.glsl").uniforms == {"a", "included"}
    monkeypatch.delattr("depthwalk.colour.PLANTED")
    shaders(b="#from depthwalk.colour import PLANTED\n")
    with pytest.raises(GpuError, match=r"^shaders/b\.glsl:1: "):
        ShaderSource("a.glsl")


def test_messages_of_compilers_name_files(shaders: Callable[..., Path]) -> None:
    shaders(a='#include "b.glsl"\n', b="float b;\n")
    source = ShaderSource("a.glsl")
    assert source.locate("0:100007(3): error") == "shaders/b.glsl:7(3): error"  # Mesa forgets the file
    assert source.locate("0(12) : error C0000") == "shaders/a.glsl:12 : error C0000"  # NVIDIA
    assert source.locate("0:200007: of no file of ours") == "0:200007: of no file of ours"


def test_a_missing_file_is_named(shaders: Callable[..., Path], tmp_path: Path) -> None:
    shaders(a='#include "none.glsl"\n')
    with pytest.raises(GpuError, match=r"shaders/none\.glsl: no such shader"):
        ShaderSource("a.glsl")
    with pytest.raises(GpuError, match=r"outside\.frag: no such shader"):
        ShaderSource(tmp_path / "outside.frag")


def test_a_shader_from_outside_includes_what_lies_beside_it_and_ours(
    shaders: Callable[..., Path], tmp_path: Path
) -> None:
    shaders(ours="float ours;\n")
    (tmp_path / "beside.glsl").write_text("float beside;\n")
    outside = tmp_path / "mine.frag"
    outside.write_text('#include "beside.glsl"\n#include "ours.glsl"\n')
    text = ShaderSource(outside).text
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
        ShaderSource("a.glsl")


def test_only_shaders_from_outside_name_modules_from_outside(
    shaders: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "users_constants.py").write_text("STEPS = 7\n")
    monkeypatch.syspath_prepend(tmp_path)
    line = "#from users_constants import STEPS as COUNT\n"
    (tmp_path / "mine.frag").write_text(line)
    assert "#define COUNT 7" in ShaderSource(tmp_path / "mine.frag").text
    shaders(a=line)
    with pytest.raises(GpuError, match=r"shaders/a\.glsl:1: module 'users_constants' is not of depthwalk"):
        ShaderSource("a.glsl")
    (tmp_path / "includes.frag").write_text('#include "a.glsl"\n')
    with pytest.raises(GpuError, match=r"shaders/a\.glsl:1: "):
        ShaderSource(tmp_path / "includes.frag")


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
    assert f"#define PLANTED {expected}\n" in ShaderSource(tmp_path / "mine.frag").text


@pytest.mark.parametrize("value", [True, "text", np.zeros(4), None])
def test_values_that_glsl_cannot_have_are_refused(
    shaders: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, value: bool | str
) -> None:
    monkeypatch.setattr("depthwalk.colour.PLANTED", value, raising=False)
    shaders(a="#from depthwalk.colour import PLANTED\n")
    with pytest.raises(GpuError, match="neither a number nor three"):
        ShaderSource("a.glsl")
