"""`depthwalk compare` and `bake --verify` as the user meets them."""

import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

import depthwalk
from depthwalk.bake.file import read_baked
from depthwalk.bake.params import ModelParams
from depthwalk.commands import comparison
from depthwalk.commands.baking import mesh_spec
from depthwalk.commands.cli import app
from depthwalk.commands.subjects import Choices, find_subjects
from depthwalk.gpu.device import Device
from depthwalk.quality import costs
from depthwalk.quality.costs import measured_bake
from depthwalk.quality.goals import MEASURES
from depthwalk.quality.views import SPHERE

KEYS = [measure.key for measure in MEASURES]
SMALL = ("--dpci-resolution", 32, "--layers", 1, "--resolution", "48,36")

AS_EVER = {"axis": "y", "coordinates": "auto"}  # defaults of `dpci`


def run(*arguments: int | Path | str) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def ball(tiny_scene: Path) -> Path:
    return tiny_scene.with_name("ball.ply")


@pytest.fixture
def flip_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """FLIP is computed in this process; tests of the ablation and of bench tables start those that compute it."""
    monkeypatch.setattr(comparison, "flip_workers", nullcontext)


@pytest.fixture
def bakes_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bakes are measured in this process, for tests that ask neither for their time nor for their memory."""
    monkeypatch.setattr(costs, "ProcessPoolExecutor", lambda workers, context: ThreadPoolExecutor(workers))
    monkeypatch.setattr("depthwalk.quality.costs.logging.disable", lambda: None)


def test_json_is_as_documented(
    gl_device: Device, flip_here: None, ball: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(comparison, "SPHERE", SPHERE[::6])
    out, page = tmp_path / "q.json", tmp_path / "q.html"
    options = "--asset-root", ball.parent, "--json", out, "--html", page, "--want-psnr", 5, "--set", "render.lod.bias=1"
    result = run("compare", ball.name, *SMALL, *options)
    assert result.exit_code == 0, result.stderr
    report = json.loads(out.read_text())
    head = ["version", "commit", "renderer", "image_size", "fov", "flip_pixels_per_degree", "goals"]
    assert list(report) == [*head, "models", "overall"]
    assert report["version"] == depthwalk.__version__ and report["image_size"] == [48, 36]
    assert list(report["goals"]) == list(report["overall"]) == KEYS
    (model,) = report["models"]
    assert list(model) == [
        *("name", "mesh", "triangles", "dpci", "parts", "deepest"),
        *("bake_seconds", "bake_peak_bytes", "bytes_disk", "bytes_gpu"),
        *("cost_goals", "summary", "close_summary"),
        *("views", "close", "candidate", "warnings", "recommendation"),
    ]
    assert model["dpci"] == {
        "resolution": 32,
        "layers": 1,
        "method": "raycast",
        "parts": 1,
        "axis": "y",
        "coordinates": "auto",
    }
    assert model["parts"] == 1
    assert model["name"] == model["mesh"] == str(ball) and model["bytes_disk"] > 0 and model["bytes_gpu"] > 0
    assert len(model["views"]) == 7 and len(model["close"]) == 8
    assert set(model["views"][0]) == {"elevation", "azimuth", "pixels", *KEYS}
    assert set(model["summary"]["psnr"]) == {"mean", "worst", "worst_view", "mean_reached", "worst_reached"}
    assert min(view["psnr"] for view in model["views"]) == model["summary"]["psnr"]["worst"]
    assert model["recommendation"]["reached"] and model["recommendation"]["best"]["resolution"] == 256
    documented = (Path(__file__).parents[2] / "docs" / "quality-method.md").read_text()
    assert all(f"`{key}`" in documented for key in [*report, *model, *KEYS])
    assert "PSNR, dB" in result.stdout and "for 5 dB: --dpci-resolution 256 --layers 1" in result.stdout
    html = page.read_text()
    assert html.count("<img ") >= 4 and html.count("<img ") % 4 == 0
    assert "http" not in html and html.endswith("</body></html>\n")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--resolution", "8,400"], "--resolution 8,400: each side must be at least 16 pixels"),
        (["--want-psnr", "0"], "--want-psnr 0: must be above 0 and at most 100 dB"),
        (["--want-psnr", "nan"], "--want-psnr nan: must be above 0 and at most 100 dB"),
        (["--height", "-1"], "--height -1: must be above 0 and at most 1000000 metres"),
        (["--set", "render.lod.bais=1"], "--set render.lod.bais: unknown key; did you mean 'bias'?"),
        (["--set", "camera.fov=1"], "--set camera.fov: camera: unknown key; known here: 'render'"),
        (
            ["--method", "six-view", "--layers", "2"],
            "--layers 2: method six-view sees one surface per ray; say 1, or use raycast",
        ),
        (["--asset-root", "nowhere"], "--asset-root nowhere: no such folder"),
        (["--json", "nowhere/q.json"], "nowhere/q.json: the folder 'nowhere' does not exist"),
        (["--json", "q", "--html", "q"], "q: would overwrite a file that is compared, or the other report"),
    ],
)
def test_wrong_options_are_refused_in_one_line(ball: Path, options: Sequence[str], message: str) -> None:
    result = run("compare", ball, *options)
    assert (result.exit_code, result.stderr.splitlines(), result.stdout) == (2, [message], "")


def test_a_report_never_overwrites_the_mesh(ball: Path) -> None:
    result = run("compare", ball, "--html", ball)
    assert result.exit_code == 2 and "would overwrite" in result.stderr


def test_a_mesh_that_is_missing_is_named(tmp_path: Path) -> None:
    result = run("compare", tmp_path / "none.ply", "--json", tmp_path / "q.json")
    assert (result.exit_code, result.stderr) == (2, f"{tmp_path / 'none.ply'}: no such file\n")
    assert not (tmp_path / "q.json").exists()


def test_a_scene_brings_its_meshes_and_their_settings(
    gl_device: Device,
    flip_here: None,
    bakes_here: None,
    tiny_scene: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(comparison, "SPHERE", SPHERE[::14])
    text = tiny_scene.read_text()
    assets = "  tall: {mesh: ball.ply, height: 3, dpci: {resolution: 32, layers: 2}}\n  bare: {mesh: ball.ply}\n"
    tiny_scene.write_text(text.replace("objects:", assets + "objects:"))
    out = tmp_path / "q.json"
    result = run("compare", tiny_scene, "--resolution", "48,36", "--json", out)
    assert result.exit_code == 0, result.stderr
    ball, tall = json.loads(out.read_text())["models"]
    assert (ball["name"], tall["name"]) == (f"{tiny_scene}: ball", f"{tiny_scene}: tall")
    assert ball["dpci"] == {
        "resolution": 64,
        "layers": 1,
        "method": "raycast",
        "parts": 1,
        "axis": "y",
        "coordinates": "auto",
    }
    assert tall["dpci"] == {
        "resolution": 32,
        "layers": 2,
        "method": "raycast",
        "parts": 1,
        "axis": "y",
        "coordinates": "auto",
    }
    assert tall["candidate"]["texel"] == pytest.approx(1.5 * 2 * ball["candidate"]["texel"], rel=0.01)
    assert "overall, 2 models" in result.stdout and result.stdout.count(f"{tiny_scene}: tall") >= 2


def test_options_lie_over_what_a_scene_says(tiny_scene: Path) -> None:
    choices = Choices()
    six_view = tiny_scene.with_name("six.yaml")
    six_view.write_text(tiny_scene.read_text().replace("layers: 1}", "method: six-view}"))

    def params(scene: Path, **given: Any) -> ModelParams:
        return find_subjects([scene], [], replace(choices, **given))[0].params

    assert params(tiny_scene, layers=4) == ModelParams(resolution=64, layers=4)
    assert params(tiny_scene, parts="auto", axis="x") == ModelParams(resolution=64, layers=1, parts="auto", axis="x")
    assert params(tiny_scene, resolution=32, method="six-view") == ModelParams(
        resolution=32, layers=1, method="six-view"
    )
    assert params(six_view) == ModelParams(resolution=64, layers=1, method="six-view")
    assert params(six_view, method="raycast", layers=2) == ModelParams(resolution=64, layers=2)


def test_a_mesh_has_three_layers_unless_six_views_are_asked_for(ball: Path) -> None:
    choices = Choices(up="z", height=2.0)
    (rays,) = find_subjects([ball], [], choices)
    (views,) = find_subjects([ball], [], replace(choices, method="six-view"))
    assert rays.params == ModelParams(resolution=512, layers=3) and views.params == ModelParams(
        resolution=512, layers=1, method="six-view"
    )
    assert (rays.spec.up, rays.spec.height, rays.scene) == ("z", 2.0, None)


@pytest.mark.parametrize(
    ("options", "old", "new", "message"),
    [
        (["--up", "z"], "", "", "--up: is for mesh files; {d}/scene.yaml sets it for its own meshes"),
        (["--texture", "t.png"], "", "", "--texture: is for mesh files; {d}/scene.yaml sets it for its own meshes"),
        (["--height", "2"], "", "", "--height: is for mesh files; {d}/scene.yaml sets it for its own meshes"),
        ([], ", dpci: {resolution: 64, layers: 1}", "", "{d}/scene.yaml: none of its mesh assets has `dpci`"),
        (
            [],
            "layers: 1",
            "layer: 1",
            "{d}/scene.yaml:3:49: assets.ball.dpci.layer: unknown key; did you mean 'layers'?",
        ),
        (
            ["--method", "six-view", "--layers", "3"],
            "",
            "",
            "--layers 3: method six-view sees one surface per ray; say 1, or use raycast",
        ),
        (
            ["--json", "{d}/scene.yaml"],
            "",
            "",
            "{d}/scene.yaml: would overwrite a file that is compared, or the other report",
        ),
    ],
)
def test_wrong_scenes_and_options_with_them_are_refused_in_one_line(
    tiny_scene: Path, options: Sequence[str], old: str, new: str, message: str
) -> None:
    tiny_scene.write_text(tiny_scene.read_text().replace(old, new))
    folder = tiny_scene.parent
    result = run("compare", tiny_scene, *(option.format(d=folder) for option in options))
    assert (result.exit_code, result.stderr, result.stdout) == (2, message.format(d=folder) + "\n", "")


def test_a_scene_that_is_missing_is_named(tmp_path: Path) -> None:
    result = run("compare", tmp_path / "none.yaml")
    assert (result.exit_code, result.stderr) == (2, f"{tmp_path / 'none.yaml'}: no such file\n")


@pytest.mark.slow
def test_a_bake_is_measured_in_a_process_of_its_own(ball: Path, tmp_path: Path) -> None:
    spec = mesh_spec(ball, None, "y", None)
    small, large = (measured_bake(spec, ModelParams(resolution=side), tmp_path / "b.dpci.exr") for side in (32, 160))
    assert large.bytes_disk == (tmp_path / "b.dpci.exr").stat().st_size > small.bytes_disk
    assert large.seconds > small.seconds > 0
    assert read_baked(tmp_path / "b.dpci.exr").parts[0].images[0].depth.shape == (160, 160)
    if small.peak_bytes is not None and large.peak_bytes is not None:  # else not Linux
        image = 160 * 160 * (4 + 12 + 16)  # depth, normal, colour
        assert 30e6 < small.peak_bytes < large.peak_bytes - 5 * image


def test_bake_verifies_what_it_baked_and_nothing_else(gl_device: Device, ball: Path, tmp_path: Path) -> None:
    broken = ball.with_name("broken.ply")
    broken.write_text("ply\n")
    small = "--dpci-resolution", 32, "--layers", 1, "--jobs", 1
    result = run("bake", ball, broken, "-o", tmp_path, *small, "--verify")
    assert result.exit_code == 2
    lines = [line for line in result.stdout.splitlines() if "6 views of 320 × 240" in line]
    assert len(lines) == 1 and lines[0].startswith(f"{tmp_path / 'ball.dpci.exr'}: ")
    assert all(measure.title in lines[0] for measure in MEASURES)
