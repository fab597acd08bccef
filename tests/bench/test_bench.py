"""The benchmark: its report, and that times belong to the frames they are said to."""

import csv
import json
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import depthwalk
from depthwalk.bench import measure as bench
from depthwalk.bench.page import to_html
from depthwalk.bench.report import to_csv, to_json, to_text
from depthwalk.bench.slow_frames import slowest_frames
from depthwalk.commands.cli import app
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from depthwalk.scene.path import load_path
from reports import report_of

SPREAD = {"p50", "p95", "p99", "max", "mean"}


def run(*arguments: int | Path | str) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.mark.gl
def test_json_is_the_public_contract(tiny_scene: Path, tmp_path: Path) -> None:
    out, page, rows = tmp_path / "b.json", tmp_path / "b.html", tmp_path / "b.csv"
    walk = tiny_scene.with_name("walk.yaml")
    files = ("--path", walk, "--json", out, "--html", page, "--csv", rows)
    shape = "--resolution", "96,64", "--frames", 4, "--warmup", 1, "--representation", "dpci,mesh"
    near = ("--set", "render.lod.magnification=0.01")  # in `scene`, the mesh would stand in for the depth image
    result = run("bench", tiny_scene, *files, *shape, *near)
    assert result.exit_code == 0, result.stderr
    report = json.loads(out.read_text())
    assert list(report) == [
        *("version", "commit", "date", "machine", "renderer", "driver", "timer", "planning", "resolution", "scene"),
        *("path", "stride", "runs"),
    ]
    assert report["version"] == depthwalk.__version__
    assert report["timer"] in ("finish", "gpu") and report["planning"] in ("compiled", "numpy")
    assert (report["resolution"], report["scene"], report["path"]) == ([96, 64], str(tiny_scene), str(walk))
    assert [each["representation"] for each in report["runs"]] == ["dpci", "mesh"]
    for each in report["runs"]:
        assert set(each) == {
            *("representation", "frames", "frame_ms", "passes_ms", "counts", "slowest", "frame_times"),
        }
        assert each["frames"] == len(each["frame_times"]) == 4
        slowest = [slow["ms"] for slow in each["slowest"]]
        assert slowest == sorted(slowest, reverse=True) and min(slowest) > each["frame_ms"]["p50"]
        assert each["counts"]["objects"] == 1 and each["counts"][each["representation"]] == 1
        assert each["counts"]["mesh_fallbacks"] == 0 and each["counts"][f"share_{each['representation']}"] == 1
        drawing = {"dpci": {"composite"}, "mesh": {"mesh"}}[each["representation"]]  # what draws nothing has no times
        assert {"composite", "mesh"} & set(each["passes_ms"]) == drawing
        assert {"plan", "light + output"} <= set(each["passes_ms"])
        for times in (each["frame_ms"], *each["passes_ms"].values()):
            assert set(times) == SPREAD
            assert 0 <= times["p50"] <= times["p95"] <= times["p99"] <= times["max"]
        if report["timer"] == "finish":
            assert sum(times["mean"] for times in each["passes_ms"].values()) <= max(each["frame_times"])
    assert "dpci, 4 frames" in result.stdout and "composite" in result.stdout and " as fast as " in result.stdout
    assert "jumps" in result.stdout if report["stride"] > 1.01 else "jumps" not in result.stdout
    table = list(csv.DictReader(rows.read_text().splitlines()))
    assert [(row["representation"], row["frame"]) for row in table] == [
        (name, str(number)) for name in ("dpci", "mesh") for number in range(4)
    ]
    assert [float(row["frame_ms"]) for row in table] == [t for each in report["runs"] for t in each["frame_times"]]
    assert all(row["objects"] == "1" and float(row["plan_ms"]) > 0 for row in table)
    html = page.read_text()
    assert html.count("<img") == 8 and html.count("<svg") == 6  # times, classes; passes and shares of each
    assert html.count("<polyline") == 4 and "http" not in html and html.endswith("</body></html>\n")


@pytest.mark.gl
def test_a_still_camera_needs_no_path(tiny_scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "b.json"
    result = run("bench", tiny_scene, "--json", out, "--resolution", "32,32", "--frames", 2, "--warmup", 0)
    assert result.exit_code == 0, result.stderr
    report = json.loads(out.read_text())
    assert report["path"] is None
    assert [(each["representation"], each["frames"]) for each in report["runs"]] == [("scene", 2)]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--representation", "dpci,teapot"],
            "--representation teapot: must be one of scene, dpci, mesh, mesh-lod, mesh-clusters, dmesh, "
            "relief, distance, parallax, bump, displacement, relief-texture, bar-texture, octahedral, billboard, auto",
        ),
        (["--json", "{d}/no/b.json"], "{d}/no/b.json: the folder '{d}/no' does not exist"),
        (["--json", "{d}/b", "--html", "{d}/b"], "{d}/b: would overwrite a file that is measured, or the other report"),
        (["--html", "{d}/scene.yaml"], "{d}/scene.yaml: would overwrite a file that is measured, or the other report"),
    ],
)
def test_bench_refuses(tiny_scene: Path, arguments: Sequence[str], message: str) -> None:
    folder = tiny_scene.parent
    result = run("bench", tiny_scene, *(argument.format(d=folder) for argument in arguments))
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", message.format(d=folder) + "\n")


class LateTimers:
    """Publishes a frame's times, its number, `lag` frames later, as timer queries do; of each `every`-th frame."""

    def __init__(self, lag: int, every: int) -> None:
        self.lag, self.every = lag, every
        self.milliseconds: dict[str, float] = {}
        self.by_clock: dict[str, float] = {}
        self.kind = "gpu"
        self.frame, self.of_frame, self.next = 0, -1, 0

    def time_next(self) -> None:
        self.next = self.frame

    def awaited(self, frame: int) -> bool:
        return self.of_frame < frame and self.lag > 0

    def draw(self, view: View) -> None:
        self.by_clock = {"plan": float(self.frame)}
        published = self.frame - self.lag
        if published >= 0 and (published - self.next) % self.every == 0:
            self.of_frame, self.milliseconds = published, {"warp": float(published)}
        self.frame += 1


@pytest.mark.parametrize(("lag", "every", "mean", "again_mean"), [(0, 1, 3, 5.5), (4, 1, 3, 9.5), (0, 2, 3, 5)])
def test_times_belong_to_the_measured_frames(lag: int, every: int, mean: int, again_mean: float) -> None:
    timers = LateTimers(lag, every)
    plan = SimpleNamespace(counts={"objects": 3})
    headless = SimpleNamespace(
        size=(8, 8),
        draw=timers.draw,
        finish=lambda: None,
        device=SimpleNamespace(live=Counter()),
        renderer=SimpleNamespace(timers=timers, plan=plan),
        pixel_counts=lambda: np.array([1, 0, 3, 0, 0]),
    )
    ticks = []
    drawn = {"dpci": cast(HeadlessRenderer, headless)}
    (run,) = bench.measure(drawn, [Camera((0, 0, 1), (0, 0, 0), 1)] * 3, 2, lambda: ticks.append(1))
    assert len(ticks) == run.frames == len(run.frame_times) == 3
    assert run.passes_ms["warp"].max == 4 and run.passes_ms["warp"].mean == mean  # frames 2, 3 and 4, or not 3
    assert run.trace is not None and run.trace.work["plan_ms"] == [2, 3, 4]
    shares = {"share_dpci": 0.25, "share_dmesh": 0, "share_mesh": 0.75, "share_height_fields": 0, "share_captured": 0}
    assert run.counts == {"objects": 3} | shares
    (again,) = bench.measure(drawn, [Camera((0, 0, 1), (0, 0, 0), 1)] * 2, 0, lambda: None)
    assert again.passes_ms["warp"].mean == again_mean  # the first call drew `lag` more


def test_spread_of_known_times() -> None:
    assert bench.spread([float(k) for k in range(1, 102)]) == bench.Spread(p50=51, p95=96, p99=100, max=101, mean=51)


def test_a_pass_that_some_frames_lack_counts_as_nothing() -> None:
    assert bench._columns([{"a": 1.0}, {"a": 3.0, "b": 2.0}]) == {"a": [1, 3], "b": [0, 2]}


def test_frames_spread_over_the_whole_path(tiny_scene: Path) -> None:
    path = load_path(tiny_scene.with_name("walk.yaml"))
    assert bench.sample_path(path, None) == [path.sample(time) for time in (0, 1, 2)]
    assert bench.sample_path(path, 5) == [path.sample(time) for time in (0, 0.5, 1, 1.5, 2)]
    assert bench.sample_path(path, 1) == [path.sample(0)]


def test_names_are_escaped_in_the_page() -> None:
    report = report_of({"<dpci>": [1.0]}, "<scene>.yaml")
    assert "<dpci>" not in (page := to_html(report)) and "<scene>" not in page and "&lt;warp&gt;" in page
    assert json.loads(to_json(report))["runs"][0]["representation"] == "<dpci>"


def test_the_quicker_way_is_named_with_its_bounds() -> None:
    rng = np.random.default_rng(1)
    frame = rng.uniform(5, 50, 100)  # frames differ by far more than the two ways do
    text = to_text(report_of({"mesh": frame.tolist(), "dpci": (frame / rng.uniform(1.9, 2.1, 100)).tolist()}))
    found = re.search(r"dpci is ([\d.]+) × \(([\d.]+) to ([\d.]+)\) as fast as mesh$", text, re.MULTILINE)
    assert found is not None
    median, low, high = map(float, found.groups())
    assert 1.95 < low <= median <= high < 2.05
    alike = to_text(report_of({"a": frame.tolist(), "b": (frame * rng.uniform(0.9, 1.1, 100)).tolist()}))
    assert alike.endswith(", which is within the noise")


@pytest.mark.parametrize(
    "kind", ["mesh", "mesh-lod", "relief", "relief-texture", "bar-texture", "octahedral", "billboard"]
)
def test_what_could_not_be_drawn_as_asked_is_not_compared(kind: str) -> None:
    report = report_of({kind: [1.0, 2.0], "dpci": [3.0, 4.0]})
    counts: dict[str, float] = {"mesh": 0, "height_fields": 0, "captured": 0, "dpci": 7, "occluded": 0}
    unlike = replace(report.runs[0], counts=counts)
    text = to_text(replace(report, runs=(unlike, report.runs[1])))
    assert text.count(f"nothing was drawn as {kind}:") == 1 and " as fast as " not in text and not text.endswith("\n")
    assert "  dpci 7\n" in text  # counts that are 0 are left out


def test_slow_frames_name_what_they_took_longer_for() -> None:
    rng = np.random.default_rng(2)
    warped, shadows = rng.integers(0, 100_000, 60), np.zeros(60)
    shadows[[10, 40]] = 2e6, 1e6
    garbage = np.zeros(60)
    garbage[50] = 60
    times = 20 + warped * 1e-4 + shadows * 5e-5 + garbage + rng.uniform(0, 0.5, 60)
    times[30] += 80
    work = {"warped_triangles": warped, "shadow_triangles": shadows, "garbage_ms": garbage, "unheard_of": warped}
    found = slowest_frames(times.tolist(), {name: column.tolist() for name, column in work.items()}, range(60))
    first = {slow.frame: slow.causes[0] for slow in found}
    assert [slow.frame for slow in found][:2] == [10, 30] and {40, 50} <= set(first)
    assert first[10].what == "shadow maps of 2,000,000 triangles" and first[10].ms == pytest.approx(100, rel=0.1)
    assert first[40].what == "shadow maps of 1,000,000 triangles" and first[40].ms == pytest.approx(50, rel=0.1)
    assert first[50].what == "Python's garbage collector" and first[50].ms == 60
    assert first[30].what.startswith("something not counted")
    assert 10 not in [slow.frame for slow in slowest_frames(times.tolist(), {}, range(11, 60))]


def test_a_csv_row_lacks_what_its_run_did_not_count() -> None:
    report = report_of({"a": [1.0, 2.0], "b": [3.0]})
    assert to_csv(report) == "representation,frame,frame_ms\na,0,1.0\na,1,2.0\nb,0,3.0\n"


def test_it_is_told_what_the_passes_leave_out() -> None:
    """Frames that waited for each pass are not those of the row 'frame', and have time between the passes."""
    report = report_of({"dpci": [12.0, 10.0, 10.0, 10.0]})
    spent = {"plan": bench.spread([3.0]), "composite": bench.spread([4.0])}
    trace = bench.Trace(work={}, passes={0: {"plan": 3.0, "composite": 4.0}}, pixels=[], pictures={})
    run = replace(report.runs[0], passes_ms=spent, trace=trace)
    text = to_text(replace(report, timer="finish", runs=(run,)))
    assert (
        "  passes: 7.00 of the 12.00 ms of 1 frame that waited after each pass; the other time is between them. "
        "'frame': the other 3 frames\n" in text
    )
    assert "GPU time, 7.00 ms in all" in to_text(replace(report, timer="gpu", runs=(run,)))
    assert "between" not in to_text(report)  # a report that was read from a file does not know
