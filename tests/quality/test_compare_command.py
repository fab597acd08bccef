"""`depthwalk compare` and `bake --verify` as the user meets them."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

import depthwalk
from depthwalk.cli import app
from depthwalk.quality.goals import MEASURES

KEYS = [measure.key for measure in MEASURES]
SMALL = ("--dpci-resolution", 32, "--layers", 1, "--resolution", "48,36")


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def ball(tiny_scene) -> Path:
    return tiny_scene.with_name("ball.ply")


def test_json_is_as_documented(gl_device, ball, tmp_path):
    out, page = tmp_path / "q.json", tmp_path / "q.html"
    result = run("compare", ball, *SMALL, "--json", out, "--html", page, "--want-psnr", 5, "--set", "render.lod.bias=1")
    assert result.exit_code == 0, result.stderr
    report = json.loads(out.read_text())
    head = ["version", "commit", "renderer", "image_size", "fov", "flip_pixels_per_degree", "dpci", "goals"]
    assert list(report) == [*head, "models", "overall"]
    assert report["version"] == depthwalk.__version__ and report["image_size"] == [48, 36]
    assert report["dpci"] == {"resolution": 32, "layers": 1}
    assert list(report["goals"]) == list(report["overall"]) == KEYS
    (model,) = report["models"]
    assert list(model) == [
        *("mesh", "triangles", "bake_seconds", "bytes_disk", "bytes_gpu", "cost_goals", "summary", "close_summary"),
        *("views", "close", "candidate", "warnings", "recommendation"),
    ]
    assert model["mesh"] == str(ball) and model["bytes_disk"] > 0 and model["bytes_gpu"] > 0
    assert len(model["views"]) == 42 and len(model["close"]) == 8
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
        (["--set", "camera.fov=1"], "--set camera.fov: camera: unknown key"),
        (["--asset-root", "nowhere"], "--asset-root nowhere: no such folder"),
        (["--json", "nowhere/q.json"], "nowhere/q.json: the folder 'nowhere' does not exist"),
        (["--json", "q", "--html", "q"], "q: would overwrite what is compared, or the other report"),
    ],
)
def test_wrong_options_are_refused_in_one_line(ball, options, message):
    result = run("compare", ball, *options)
    assert (result.exit_code, result.stderr.splitlines(), result.stdout) == (2, [message], "")


def test_a_report_never_overwrites_the_mesh(ball):
    result = run("compare", ball, "--html", ball)
    assert result.exit_code == 2 and "would overwrite" in result.stderr


def test_a_mesh_that_is_missing_is_named(tmp_path):
    result = run("compare", tmp_path / "none.ply", "--json", tmp_path / "q.json")
    assert (result.exit_code, result.stderr) == (2, f"{tmp_path / 'none.ply'}: no such file\n")
    assert not (tmp_path / "q.json").exists()


def test_meshes_are_found_below_asset_roots(gl_device, ball, tmp_path):
    out = tmp_path / "q.json"
    result = run("compare", "ball.ply", "--asset-root", ball.parent, *SMALL, "--json", out, "--quiet")
    assert result.exit_code == 0, result.stderr
    assert json.loads(out.read_text())["models"][0]["mesh"] == str(ball)


def test_bake_verifies_what_it_baked_and_nothing_else(gl_device, ball, tmp_path):
    broken = ball.with_name("broken.ply")
    broken.write_text("ply\n")
    result = run("bake", ball, broken, "-o", tmp_path, "--dpci-resolution", 32, "--layers", 1, "--verify")
    assert result.exit_code == 2
    lines = [line for line in result.stdout.splitlines() if "6 views of 320 × 240" in line]
    assert len(lines) == 1 and lines[0].startswith(f"{tmp_path / 'ball.dpci.exr'}: ")
    assert all(measure.title in lines[0] for measure in MEASURES)
