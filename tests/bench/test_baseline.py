"""Comparing a benchmark with an earlier one: what counts as a change, and which files are refused."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from depthwalk.bench.baseline import change_lines, changes, read_report
from depthwalk.bench.measure import Report
from depthwalk.bench.report import to_json
from depthwalk.commands.cli import app
from depthwalk.errors import InputError
from reports import report_of


def run(*arguments: int | Path | str) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def walked() -> np.ndarray:
    """Frame times of a walk, which differ by a factor of ten."""
    return np.random.default_rng(3).uniform(5, 50, 200)


@pytest.mark.parametrize(
    ("factor", "verdict"), [(1.0, "same"), (1.04, "same"), (1.1, "slower"), (0.96, "same"), (0.9, "faster")]
)
def test_a_change_beyond_the_noise_is_told(walked: np.ndarray, factor: float, verdict: str) -> None:
    noise = np.random.default_rng(4).normal(1, 0.02, 200)
    (found,) = changes(report_of({"a": walked.tolist()}), report_of({"a": (walked * noise * factor).tolist()}), 0.05)
    assert found.verdict == verdict
    assert found.ratio.low < factor < found.ratio.high and found.ratio.high - found.ratio.low < 0.02
    assert set(found.passes_ms) == {"<warp>"}


def test_frames_that_scatter_are_no_change(walked: np.ndarray) -> None:
    """Eight frames whose times are multiplied by anything between 0.5 and 2.5 say nothing."""
    now = walked[:8] * np.random.default_rng(5).uniform(0.5, 2.5, 8)
    (found,) = changes(report_of({"a": walked[:8].tolist()}), report_of({"a": now.tolist()}), 0.05)
    assert found.verdict == "same"


def test_another_machine_is_told(tmp_path: Path) -> None:
    before, now = report_of({"a": [1.0]}), replace(report_of({"a": [1.0]}), renderer="another")
    lines = change_lines(tmp_path, before, now, changes(before, now, 0.05))
    assert lines[1] == "  warning: measured with another renderer: <gl>, now another"
    assert "the same, within the noise" in lines[2]


def test_a_report_is_read_as_it_was_written(tmp_path: Path) -> None:
    report, file = report_of({"a": [1.0, 2.0], "b": [3.0]}), tmp_path / "b.json"
    file.write_text(to_json(report))
    assert read_report(file) == report


def damaged(change: Callable[[Report], str]) -> str:
    return change(report_of({"a": [1.0, 2.0]}))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not a report of bench --json: Invalid JSON"),
        ("[]", "not a report of bench --json: Input should be"),
        (damaged(lambda r: to_json(r).replace('"renderer"', '"rendering"')), "renderer: Field required"),
        (damaged(lambda r: to_json(replace(r, runs=(replace(r.runs[0], frames=3),)))), "must hold 3 times above 0"),
        (damaged(lambda r: to_json(r).replace("2.0\n", "-2.0\n")), "must hold 2 times above 0"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "b.json"
    file.write_text(text)
    with pytest.raises(InputError, match=r"b\.json: ") as caught:
        read_report(file)
    assert message in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.gl
def test_frames_that_got_slower_set_the_exit_code(tiny_scene: Path, tmp_path: Path) -> None:
    out, page = tmp_path / "b.json", tmp_path / "b.html"
    shape: Sequence[Any] = ("--resolution", "32,32", "--frames", 3, "--warmup", 1)
    assert run("bench", tiny_scene, *shape, "--json", out).exit_code == 0
    measured = read_report(out)
    (each,) = measured.runs
    scaled = replace(each, frame_times=tuple(spent / 1000 for spent in each.frame_times))
    out.write_text(to_json(replace(measured, runs=(scaled,))))
    result = run("bench", tiny_scene, *shape, "--baseline", out, "--html", page)
    assert result.exit_code == 1, result.stderr
    assert "  scene: slower: frames take" in result.stdout and "scene: slower" in page.read_text()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--resolution", "8,9"], "was measured with another resolution, 8 × 8 instead of 8 × 9"),
        (["--resolution", "8,8", "--frames", "3"], "scene: has 2 frames instead of 3"),
        (["--resolution", "8,8", "--representation", "mesh"], "has none of the representations mesh"),
        (["--resolution", "8,8", "--path", "walk.yaml"], "was measured with another path, none instead of walk.yaml"),
    ],
)
def test_other_frames_are_refused_before_any_is_drawn(tiny_scene: Path, options: list[str], message: str) -> None:
    file = tiny_scene.with_name("b.json")
    file.write_text(to_json(report_of({"scene": [1.0, 2.0]}, tiny_scene.name)))
    options = [str(tiny_scene.with_name(option)) if option.endswith("yaml") else option for option in options]
    result = run("bench", tiny_scene, "--baseline", file, *options)
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", f"{file}: {message}\n")


def test_a_baseline_that_is_missing_is_refused(tiny_scene: Path) -> None:
    missing = tiny_scene.with_name("none.json")
    result = run("bench", tiny_scene, "--baseline", missing)
    assert (result.exit_code, result.stderr) == (2, f"{missing}: no such file\n")
