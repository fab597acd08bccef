"""The table of costs at equal picture: what is tuned, which objects it takes, and that rows are kept."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from depthwalk.bench.equal import TOLERANCE, coarsened, picture_flip
from depthwalk.bench.rows import COLUMNS
from depthwalk.bench.table_walk import SETTLING, Walk, most_seen
from depthwalk.commands.bench_table import main
from depthwalk.commands.program import as_program
from depthwalk.quality.metrics import flip_map
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path

app = as_program(main)


def run(*arguments: int | Path | str) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def crowd(tiny_scene: Path) -> tuple[Path, Path]:
    """The scene with nine balls in a row, and a path of forty frames past them."""
    text = tiny_scene.read_text().replace("- {asset: ball}", "- {grid: {asset: ball, count: [9, 1], spacing: [3, 3]}}")
    tiny_scene.write_text(text)
    path = tiny_scene.with_name("past.yaml")
    path.write_text(
        "version: 1\nfps: 39\nkeyframes:\n"
        "  - {time: 0, position: [-12, 1, 9], target: [-12, 1, 0], fov: 45}\n"
        "  - {time: 1, position: [-9, 1, 9], target: [-9, 1, 0], fov: 45}\n"
    )
    return tiny_scene, path


@pytest.mark.parametrize("target", [0.5, 3.0, 40.0])
def test_bisection_finds_the_setting_of_a_picture(target: float) -> None:
    setting, flip = coarsened(lambda x: 2.0**x, -3, 8, target)
    assert flip == 2.0**setting and 0.95 < flip / (target * (1 + TOLERANCE)) <= 1


def test_bisection_does_not_stop_at_the_first_that_would_do() -> None:
    setting, flip = coarsened(lambda x: 5.0 + 0.01 * max(x, 0.0), -8, 40, 5.0)
    assert setting == pytest.approx(10, abs=0.2) and flip == pytest.approx(5.1, abs=0.002)


def test_bisection_stays_below_a_step() -> None:
    setting, flip = coarsened(lambda x: 1.0 if x < 2.7 else 5.0, 0, 6, 3.0)
    assert flip == 1 and 2.6 < setting < 2.7


def test_bisection_ends_where_the_setting_does() -> None:
    assert coarsened(lambda x: x, 0, 6, 9.0) == (6, 6)
    assert coarsened(lambda x: 4.0 + x, 0, 6, 3.9) == (0, 4.0)


def test_few_objects_are_those_on_the_way(crowd: tuple[Path, Path]) -> None:
    scene, path = load_scene(crowd[0]), load_path(crowd[1])
    walk = Walk.along(path, 3, 2, 1.0, (64, 48))
    assert len(walk.moments) == 3 and all(len(moment) == SETTLING + 2 for moment in walk.moments)
    assert walk.moments[0][0] == path.sample(0) and walk.moments[2][-1] == path.sample(path.frames()[-1])
    assert most_seen(scene, walk, 3).tolist() == [0, 1, 2]  # at x = −12, −9, −6
    assert most_seen(scene, walk, 9).tolist() == list(range(9))


@pytest.mark.gl
def test_rows_are_made_once(crowd: tuple[Path, Path], tmp_path: Path) -> None:
    scene, path = crowd
    out = tmp_path / "table.json"
    shape = ("--frames", 1, "--run", 2, "--seconds", 0, "--resolution", "64,48", "--json", out)
    first = run(scene, "--path", path, "--counts", "2", *shape)
    assert first.exit_code == 0, first.output
    document = json.loads(out.read_text())
    (row,) = document["rows"]
    assert row["objects"] == 2 and row["reference"] == "mesh, 16 samples a pixel"
    assert list(row["columns"]) == list(COLUMNS)
    columns = row["columns"]
    assert all(column["frame_ms"] > 0 and 0 < column["flip"] < 0.2 for column in columns.values())
    assert columns["mesh"]["flip"] <= columns["mesh-lod"]["flip"] * (1 + TOLERANCE)
    assert columns["mesh-lod"]["counts"]["mesh_triangles"] <= columns["mesh"]["counts"]["mesh_triangles"]
    assert columns["unoccluded"]["setting"] == columns["mesh-lod"]["setting"]
    target = max(columns[name]["flip"] for name in ("mesh-lod", "scene"))
    assert all(column["flip"] <= target * (1 + TOLERANCE) ** 2 for column in columns.values())
    assert "mesh-lod / scene" in first.stdout

    row["columns"]["mesh"]["frame_ms"] = 12345.67
    out.write_text(json.dumps(document))
    again = run(scene, "--path", path, "--counts", "2", *shape)
    assert again.exit_code == 0 and "12345.67" in again.stdout

    row["columns"]["dpci"] = row["columns"].pop("scene")
    out.write_text(json.dumps(document))
    refused = run(scene, "--path", path, "--counts", "2", *shape)
    assert refused.exit_code == 2 and "holds a table of other columns than mesh, mesh-lod" in refused.stderr


@pytest.mark.gl
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--counts", "1,x"], "--counts 1,x: must be N,…, whole numbers from 1"),
        (["--counts", "0"], "--counts 0: must be N,…, whole numbers from 1"),
        (["--counts", "12"], "--counts 12: {s} has 9 objects; add some with --set objects.0.grid.count=[X,Z]"),
        (["--counts", "1", "--run", "11"], "--path: has 40 frames, but each moment needs 41"),
        (
            ["--counts", "1", "--json", "{d}/scene.yaml"],
            "{d}/scene.yaml: not a table of bench_table: Expecting value: line 1",
        ),
    ],
)
def test_the_table_refuses(crowd: tuple[Path, Path], arguments: Sequence[str], message: str) -> None:
    names = {"s": crowd[0], "d": crowd[0].parent}
    result = run(crowd[0], "--path", crowd[1], *(argument.format(**names) for argument in arguments))
    assert result.exit_code == 2 and not result.stdout
    assert result.stderr.startswith(message.format(**names))


@pytest.mark.gl
def test_a_table_of_something_else_is_not_mixed_in(crowd: tuple[Path, Path], tmp_path: Path) -> None:
    out = tmp_path / "table.json"
    out.write_text(json.dumps({"rows": [], "resolution": [8, 8]}))
    result = run(crowd[0], "--path", crowd[1], "--counts", "1", "--run", 2, "--json", out)
    assert result.exit_code == 2 and "holds a table of another version" in result.stderr
    assert np.array_equal(json.loads(out.read_text())["resolution"], [8, 8])


def test_flip_of_a_picture_needs_only_what_differs() -> None:
    random = np.random.default_rng(0)
    reference = random.integers(0, 256, (120, 160, 3), np.uint8)
    test = reference.copy()
    test[40:60, 70:90] //= 2
    assert picture_flip(reference, reference) == 0
    assert picture_flip(reference, test) == pytest.approx(float(flip_map(reference, test).mean()), rel=1e-4)
