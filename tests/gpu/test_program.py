"""Programs: their variants, when they are compiled, and what becomes of their uniforms."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from depthwalk.gpu.device import Device, Scope
from depthwalk.gpu.failures import GpuError
from depthwalk.gpu.program import Program, Variants


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


SHADERS = {
    "v": "void main() { gl_Position = vec4(4.0 * float(gl_VertexID % 2) - 1.0, 2.0 * gl_VertexID - 1.0, 0, 1); }",
    "f": "uniform float zero;\nuniform float one = 1.0;\nuniform vec2 both;\n"
    "out vec4 c; void main() { c = vec4(zero, one, both); }",
}


def drawn(scope: Scope, program: Program) -> list[float]:
    """What a program writes into a texture of one texel."""
    texture = scope.texture((1, 1), 4, "f4")
    with scope.state(into=scope.framebuffer([texture])):
        program.fill()
    return np.frombuffer(texture.read(), np.float32).tolist()


def test_a_released_program_is_used_again_with_the_uniforms_that_it_had_at_first(
    gl_device: Device, shaders: Callable[..., Path]
) -> None:
    shaders(**SHADERS)
    linked = []
    for _ in range(2):
        scope = gl_device.scope("test")
        program = Program(scope, "v.glsl", "f.glsl")
        linked.append(program.gl)
        assert drawn(scope, program) == [0, 1, 0, 0]
        program.set(zero=7.0, both=(2.0, 3.0))
        assert drawn(scope, program) == [7, 1, 2, 3]
        program.set(one=5.0, both=(6.0, 8.0))
        assert drawn(scope, program) == [7, 5, 6, 8]
        scope.release()
    assert linked[0] is linked[1]


def test_programs_in_use_and_those_that_differ_are_no_other_ones(
    gl_device: Device, shaders: Callable[..., Path]
) -> None:
    shaders(**SHADERS)
    scope = gl_device.scope("test")
    first, second = Program(scope, "v.glsl", "f.glsl"), Program(scope, "v.glsl", "f.glsl")
    assert first.gl is not second.gl
    first.set(zero=7.0)
    assert drawn(scope, second) == [0, 1, 0, 0] and drawn(scope, first) == [7, 1, 0, 0]
    before = {id(first.gl), id(second.gl)}
    scope.release()
    others = Program(scope, "v.glsl", "f.glsl", ["OTHER"]), Program(scope, "v.glsl", "f.glsl", blocks={"View": 1})
    assert not before & {id(other.gl) for other in others}
    scope.release()


def test_programs_that_nobody_uses_are_not_kept_for_ever(
    gl_device: Device, shaders: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("depthwalk.gpu.linked_programs._MOST_UNUSED", 2)
    shaders(**SHADERS)
    gl_device.programs.clear()
    scope = gl_device.scope("test")
    made = [Program(scope, "v.glsl", "f.glsl", [f"N={number}"]).gl for number in (1, 2, 3, 3)]
    scope.release()  # the newest first
    again = [Program(scope, "v.glsl", "f.glsl", [f"N={number}"]).gl for number in (1, 2, 3)]
    assert again[:2] == made[:2] and again[2] not in made
    scope.release()
    gl_device.programs.clear()
    assert Program(scope, "v.glsl", "f.glsl", ["N=1"]).gl not in (*made, *again)
    scope.release()
