"""`depthwalk bench` of several scenes: each has its own reports, and the same command goes on where one was ended."""

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from depthwalk.bench.baseline import read_report
from depthwalk.bench.measure import Report
from depthwalk.commands import benchmark, measuring
from depthwalk.commands.benchmark import Plan
from reports import report_of


@pytest.fixture
def scenes(tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    second = tiny_scene.with_name("second.yaml")
    second.write_text(tiny_scene.read_text())
    return [tiny_scene, second]


class Bench:
    """Takes the place of the measuring, which takes no time then; Ctrl-C comes before scenes of one name."""

    def __init__(self) -> None:
        self.seen: list[str] = []
        self.interrupted = ""

    def __call__(self, plan: Plan) -> Report:
        name = plan.file.path.stem
        if name == self.interrupted:
            raise KeyboardInterrupt
        self.seen.append(name)
        return replace(report_of({"scene": [1.0, 1.1, 1.2]}, str(plan.file.path)), resolution=plan.size)


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    made = Bench()
    monkeypatch.setattr(benchmark, "run_bench", made)
    return made


def test_each_scene_has_reports_of_its_own(
    run: Callable[..., Any], scenes: list[Path], bench: Bench, tmp_path: Path
) -> None:
    files = "--json", tmp_path / "{scene}.json", "--csv", tmp_path / "{scene}.csv", "--resolution", "8,8"
    result = run("bench", *scenes, *files)
    assert result.exit_code == 0, result.stderr
    assert bench.seen == ["scene", "second"]
    assert [read_report(tmp_path / f"{scene.stem}.json").scene for scene in scenes] == list(map(str, scenes))
    assert (tmp_path / "second.csv").exists() and result.stdout.count("scene, 3 frames") == 2
    again = run("bench", *scenes, "--baseline", tmp_path / "{scene}.json", "--resolution", "8,8", "--frames", 3)
    assert again.exit_code == 0 and again.stdout.count("the same, within the noise") == 2


def test_scenes_that_are_measured_are_not_measured_again(
    run: Callable[..., Any], scenes: list[Path], bench: Bench
) -> None:
    bench.interrupted = "second"
    assert run("bench", *scenes).exit_code == 130 and bench.seen == ["scene"]
    bench.interrupted = ""
    resumed = run("bench", *scenes)
    assert resumed.exit_code == 0 and bench.seen == ["scene", "second"]
    assert resumed.stderr == "1 of 2 scenes: results reused from an interrupted run\n"
    assert run("bench", *scenes).exit_code == 0 and len(bench.seen) == 4


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--json", "{d}/a.json"], "--json {d}/a.json: with several scenes, put {{scene}} into the name"),
        (["--baseline", "{d}/a.json"], "--baseline {d}/a.json: with several scenes, put {{scene}} into the name"),
        (
            ["--csv", "{d}/{{scene}}.out", "--json", "{d}/{{scene}}.out"],
            "{d}/scene.out: would overwrite a file that is measured, or the other report",
        ),
        (["--cluster", "farm"], "--cluster farm: must be local, local:N or tls://HOST:PORT"),
    ],
)
def test_names_that_scenes_would_share_are_refused(
    run: Callable[..., Any], scenes: list[Path], options: list[str], message: str, tmp_path: Path
) -> None:
    result = run("bench", *scenes, *(option.format(d=tmp_path) for option in options))
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", message.format(d=tmp_path) + "\n")


def test_scenes_of_one_name_are_refused(run: Callable[..., Any], scenes: list[Path], tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    twin = tmp_path / "other" / "scene.yaml"
    result = run("bench", scenes[0], twin, "--json", tmp_path / "{scene}.json")
    assert (result.exit_code, result.stderr) == (
        2,
        f"{twin}: its reports would overwrite those of {scenes[0]}\n",
    )


def test_a_worker_gets_names_that_mean_the_same_to_it(
    run: Callable[..., Any], scenes: list[Path], bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The report then bears the names that the user gave."""
    monkeypatch.chdir(scenes[0].parent)
    asked: list[Path] = []

    def run_tasks(cluster: object, tasks: Any, progress: object, check_interrupt: object) -> Any:
        for number, task in enumerate(tasks):
            asked.append(task.arguments[0].file.path)
            yield number, task.function(*task.arguments)

    class Anywhere:
        name = dashboard = ""

    monkeypatch.setattr(measuring, "run_tasks", run_tasks)
    monkeypatch.setattr(measuring, "open_cluster", lambda address: nullcontext(Anywhere()))
    result = run("bench", "scene.yaml", "--cluster", "local:1")
    assert result.exit_code == 0, result.stderr
    assert asked == [scenes[0]] and result.stdout.startswith("scene.yaml, still camera")


@pytest.mark.gl
def test_a_scene_without_objects_is_drawn_with_a_warning(run: Callable[..., Any], tmp_path: Path) -> None:
    (scene := tmp_path / "empty.yaml").write_text("version: 1\nenvironment: {sky: {}}\n")
    for arguments in (("render", scene, "-o", tmp_path / "a.png"), ("bench", scene, "--frames", 1, "--warmup", 0)):
        result = run(*arguments, "--resolution", "32,24")
        assert result.exit_code == 0
        assert result.stderr.splitlines()[0] == f"{scene}: has no objects; only its sky and ground are drawn"
        assert result.stderr.count("no objects") == 1
