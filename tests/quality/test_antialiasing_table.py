"""What anti-aliasing brings: the pixels that count, and the table."""

import json

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from depthwalk.headless import LinearImage
from depthwalk.quality.antialiasing import (
    KINDS,
    REFERENCE_SAMPLES,
    Row,
    main,
    measure_scene,
    to_json,
    to_markdown,
    truth,
)
from depthwalk.scene.loader import load_scene
from files import write_ply
from shapes import box


def fine(distance):
    """A picture of 6 × 4 pixels with all their samples, grey where something is."""
    columns = np.arange(6 * REFERENCE_SAMPLES) / REFERENCE_SAMPLES
    metres = np.broadcast_to(distance(columns), (4 * REFERENCE_SAMPLES, len(columns))).astype(np.float32)
    colour = np.where(np.isfinite(metres)[..., None], np.float32(0.5), 0) * np.ones(4, np.float32)
    return LinearImage(colour, metres)


def test_edge_pixels_are_those_with_a_jump_and_around():
    found = truth(fine(lambda x: np.where(x < 2.5, 3.0, np.inf)))
    assert found.edge.all(0).tolist() == [False, True, True, True, False, False]
    assert found.pixels[0, :, 0].tolist() == [188, 188, 137, 0, 0, 0]  # half of it: in linear light
    assert not truth(fine(lambda x: 3 + 0.2 * x)).edge.any()  # a slope is none


@pytest.fixture
def scene_file(tmp_path):
    write_ply(tmp_path / "box.ply", box(1, 1, 1))
    camera = "camera: {position: [2, 1.7, 2.9], target: [0, 0.4, 0], fov: 40}\n"
    assets = "assets: {box: {mesh: box.ply, dpci: {resolution: 64, layers: 1}}}\nobjects: [{asset: box}]\n"
    file = tmp_path / "box.yaml"
    file.write_text(f"version: 1\n{assets}{camera}")
    return file


def test_the_rows_of_a_box(gl_device, scene_file, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    rows = {(row.representation, row.aa): row for row in measure_scene(load_scene(scene_file), (96, 72), 1)}
    assert len(rows) == 2 * len(KINDS)
    for representation in ("depth images", "mesh"):
        none, fxaa, ours = (rows[representation, kind] for kind in ("none", "fxaa", "gpaa-edge"))
        assert none.ratio == 1 and min(none.ms, ours.ms) > 0
        assert none.psnr + 1 < fxaa.psnr < ours.psnr - 3
        assert ours.flip < none.flip
        assert none.psnr + 1 < rows[representation, "gpaa-edge, one sample"].psnr < ours.psnr
    assert rows["mesh", "ssaa"].psnr == rows["mesh", "ssaa"].own_psnr


def test_the_rows_as_markdown_and_json():
    row = Row("scenes/box.yaml", "mesh", "none", 21.26, 22.31, 0.1234, 40.4, 1.0)
    assert to_markdown([row, row]) == (
        "box, mesh:\n\n"
        "| `render.aa` | PSNR, dB | against its own, dB | FLIP | ms | × `none` |\n"
        "|---|---|---|---|---|---|\n" + 2 * "| none | 21.3 | 22.3 | 0.123 | 40 | 1.00 |\n"
    )
    document = json.loads(to_json([row], (512, 384)))
    assert document["resolution"] == [512, 384] and document["rows"][0]["flip"] == 0.1234


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["none.yaml"], "none.yaml: No such file or directory"),
        (["none.yaml", "--json", "nowhere/a.json"], "nowhere/a.json: the folder 'nowhere' does not exist"),
    ],
)
def test_bad_input_is_refused_in_one_line(options, message):
    app = typer.Typer()
    app.command()(main)
    result = CliRunner().invoke(app, options)
    assert (result.exit_code, result.stderr, result.stdout) == (2, message + "\n", "")
