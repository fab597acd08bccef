"""The ablation: rows from the paper's method to what the program does, a step at a time."""

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import shapes
from depthwalk.bake.baker import bake_object
from depthwalk.bake.grid import layer_triangles
from depthwalk.bake.images import BakedObject, Face
from depthwalk.bake.params import EVERYTHING, BakeParams
from depthwalk.commands import ablation
from depthwalk.commands.ablation import LAYERS, Ablation, Row, ablate, main, setups, to_json, to_markdown
from depthwalk.commands.baking import mesh_spec
from depthwalk.commands.program import as_program
from depthwalk.gpu.device import Device
from depthwalk.ingest.mesh import Mesh
from depthwalk.quality.views import FEW
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.types import Rows
from files import write_ply


@pytest.fixture(scope="module")
def posts() -> Mesh:
    """Two posts on a plate, one before the other: each layer of an image leaps from one to the next."""
    return shapes.joined(
        shapes.box(0.2, 1, 0.2, centre=(0.2, 0.5, 0.25)),
        shapes.box(0.2, 1, 0.2, centre=(-0.2, 0.5, -0.2)),
        shapes.box(1, 0.1, 1, centre=(0, -0.05, 0)),
    )


def bake_without(mesh: Mesh, *names: str) -> BakedObject:
    refinements = replace(EVERYTHING, **dict.fromkeys(names, False))
    return bake_object(mesh, BakeParams(resolution=32, layers=2, refinements=refinements), "test")


def corner_layers(baked: BakedObject) -> Rows:
    return np.concatenate([layer_triangles(image, 0)[0] for image in baked.images])


def test_the_first_row_is_the_papers_method_and_the_last_what_the_program_does() -> None:
    first, *_, last = setups()
    assert first.layers == 1 and not any(asdict(first.refinements).values())
    settings = first.settings
    assert (settings.lod.cases, settings.light.mode, settings.warp.tile_mapping) == ("paper", "warp", "plane")
    assert last.refinements == EVERYTHING and last.settings == RenderSettings()
    assert last.layers == LAYERS == BakeParams().layers


def test_each_row_adds_one_step() -> None:
    rows = [asdict(setup) | asdict(setup.refinements) for setup in setups()]
    for before, after in pairwise(rows):
        changed = [key for key in before if before[key] != after[key] and key not in ("title", "refinements")]
        assert len(changed) == 1, changed


@pytest.mark.gl
def test_each_refinement_can_be_left_out(posts: Mesh) -> None:
    whole = bake_without(posts)
    uncut, apart = bake_without(posts, "discontinuity_cut"), bake_without(posts, "across_layers")
    assert len(corner_layers(uncut)) > len(corner_layers(whole))
    assert (np.ptp(corner_layers(whole), axis=1) > 0).any()
    assert (np.ptp(corner_layers(apart), axis=1) == 0).all()
    assert whole.boundary_strips and not bake_without(posts, "boundary_strips").boundary_strips
    assert any((image.owner != image.face).any() for image in whole.images)
    assert all((image.owner == image.face).all() for image in bake_without(posts, "owners").images)
    bare = bake_without(posts, "box_faces")
    assert {image.face for image in bare.images} == {Face.TOP, Face.SIDE, Face.BOTTOM} < {i.face for i in whole.images}


def test_the_whole_beats_the_papers_method(
    gl_device: Device, tmp_path: Path, posts: Mesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ablation, "FEW", FEW[::3])
    mesh = tmp_path / "posts.ply"
    write_ply(mesh, posts)
    first, *_, last = setups()
    found = ablate(mesh_spec(mesh, None, "y", None), 64, (96, 72), (first, last))
    paper, ours = found.rows
    assert found.triangles == 36 and (paper.title, ours.title) == (first.title, last.title)
    assert ours.means["iou"] > paper.means["iou"] + 0.02 and ours.means["psnr"] > paper.means["psnr"] + 3
    assert ours.bytes_disk > paper.bytes_disk > 0 and ours.bytes_gpu > paper.bytes_gpu > 0 < paper.bake_seconds


def test_the_rows_as_markdown_and_json() -> None:
    row = Row(
        title="first",
        means={"psnr": 30.123, "iou": 0.98765, "flip": 0.05, "holes": 1.5},
        bake_seconds=2.5,
        bytes_disk=3_400_000,
        bytes_gpu=15_600_000,
    )
    found = Ablation("models/ball.ply", 12, (row, replace(row, title="second", bake_seconds=3.0)))
    assert to_markdown([found]) == (
        "ball.ply, 12 triangles:\n\n"
        "|  | PSNR, dB | silhouette IoU | FLIP | hole pixels, % | bake, s | disk, MB | GPU, MB |\n"
        "|---|---|---|---|---|---|---|---|\n"
        "| first | 30.12 | 0.9877 | 0.0500 | 1.500 | 2.5 | 3.4 | 15.6 |\n"
        "| + second | 30.12 | 0.9877 | 0.0500 | 1.500 | 3.0 | 3.4 | 15.6 |\n"
    )
    document = json.loads(to_json([found], 512))
    assert document["resolution"] == 512 and len(document["views"]) == len(FEW)
    assert document["models"][0]["rows"][1]["means"]["psnr"] == 30.123


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["none.ply"], "none.ply: no such file"),
        (
            ["none.ply", "--up", "x"],
            "ablation: Invalid value for '--up': 'x' is not one of 'y', 'z' (ablation --help tells more)",
        ),
        (["none.ply", "--json", "nowhere/a.json"], "nowhere/a.json: the folder 'nowhere' does not exist"),
    ],
)
def test_bad_input_is_refused_in_one_line(options: Sequence[str], message: str) -> None:
    result = CliRunner().invoke(as_program(main), options, prog_name="ablation")
    assert (result.exit_code, result.stderr, result.stdout) == (2, message + "\n", "")
