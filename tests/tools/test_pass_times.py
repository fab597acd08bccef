"""Passes timed by the shaders of several folders."""

import shutil
from pathlib import Path

import pytest

from depthwalk.resources import shader_root
from tools import pass_times


@pytest.mark.gl
@pytest.mark.slow
def test_each_folder_draws_by_its_own_shaders(
    tiny_scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tried = tmp_path / "tried"
    shutil.copytree(shader_root(), tried)
    command = [str(tiny_scene), "--frames", "8", "--size", "32", "24", "--shaders", str(shader_root()), str(tried)]
    pass_times.main(command)
    rows = capsys.readouterr().out.splitlines()
    assert rows[0] == f"| pass | {shader_root()} | {tried} |"
    assert {"`frame`", "`composite`", "`material_resolve`"} <= {row.split("|")[1].strip() for row in rows[2:]}
    (tried / "composite" / "composite.frag").write_text("// Draws nothing.\nvoid main() { nothing; }\n")
    with pytest.raises(SystemExit) as left:
        pass_times.main(command)
    said = capsys.readouterr().err
    assert left.value.code == 2 and f"error: {tried}: " in said and "composite.frag:2" in said


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--shaders", "nowhere"), "nowhere: is no folder of shaders"),
        (("--frames", "6"), "more than 6"),
        (("--distance", "0"), "more than 0"),
        (("--size", "0", "9"), "at least 1 1"),
    ],
)
def test_mistakes_are_told(
    tiny_scene: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...], said: str
) -> None:
    with pytest.raises(SystemExit) as left:
        pass_times.main([str(tiny_scene), *more])
    assert left.value.code == 2 and said in capsys.readouterr().err
