"""`depthwalk quality` as the user meets it, and the parts of it that have no page of their own."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import depthwalk
from depthwalk.commands import examination
from depthwalk.commands.cli import app
from depthwalk.commands.examination import PARTS, Piece, examine_alone, parse_parts, run_quality, shipped_scenes
from depthwalk.commands.scene_file import SceneFile
from depthwalk.gpu.device import Device
from depthwalk.quality import dof, edges, shadows
from depthwalk.quality.overview import Overview, to_html, to_json, to_text
from depthwalk.quality.rows import Row
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import MeshAsset
from files import write_ply
from shapes import sphere


def run(*arguments: Path | str) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def quietly(name: str, stage: str) -> None:
    """Nobody listens."""


def test_every_part_of_a_small_scene(
    gl_device: Device, tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dof, "TRUTH", 4)
    monkeypatch.setattr(edges, "REPEATS", 1)
    out, page = tmp_path / "q.json", tmp_path / "q.html"
    result = run("quality", tiny_scene, "--resolution", "64,64", "--json", out, "--html", page)
    assert result.exit_code == 0, result.stderr
    report = json.loads(out.read_text())
    assert list(report) == ["version", "commit", "renderer", "image_size", "rows"]
    assert report["version"] == depthwalk.__version__ and report["image_size"] == [64, 64]
    assert list(dict.fromkeys(row["part"] for row in report["rows"])) == list(PARTS)
    keys = ["part", "subject", "name", "measured", "goal", "more_is_better", "reached", "details"]
    assert all(list(row) == keys for row in report["rows"])
    documented = (Path(__file__).parents[2] / "docs" / "quality-method.md").read_text()
    assert all(f"`{key}`" in documented for key in [*report, *keys])
    aimed = [row["reached"] for row in report["rows"] if row["goal"] is not None]
    assert f"{sum(aimed)} of {len(aimed)} goals reached" in result.stdout
    assert all(part in result.stdout.splitlines() for part in PARTS)
    html = page.read_text()
    assert html.count("<h2>") == len(PARTS) and html.count("<img ") > 10
    assert "http" not in html and html.endswith("</body></html>\n")


def test_only_what_is_asked_for_is_done(gl_device: Device, tiny_scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(edges, "REPEATS", 1)
    result = run("quality", tiny_scene, "--only", "edges", "--resolution", "64,64")
    assert result.exit_code == 0, result.stderr
    assert "edges" in result.stdout.splitlines() and "dof" not in result.stdout
    assert parse_parts("edges, dof,edges") == ["dof", "edges"]


def test_the_scenes_that_ship_are_examined_by_default() -> None:
    assert [load_scene(file).camera is not None for file in shipped_scenes()] == [True, True]


def test_an_asset_that_scenes_share_is_examined_once(tiny_scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The values are in the order of the parts, then of the scenes, though pieces are examined one by one."""
    second = tiny_scene.with_name("second.yaml")
    more = "  tall: {mesh: ball.ply, height: 3, dpci: {resolution: 32, layers: 2}}\nobjects:"
    second.write_text(tiny_scene.read_text().replace("objects:", more))
    seen: list[tuple[str, Path | None, list[str]]] = []

    def note(piece: Piece, size: tuple[int, int], report: object) -> tuple[list[Row], str]:
        scene = piece.scene.open() if piece.scene else None
        names = [scene.assets[number].name for number in piece.assets or ()] if scene else []
        seen.append((piece.part, scene.path if scene else None, names))
        return [Row(subject=piece.part, name=str(len(seen)), measured=1.0)], "a driver"

    monkeypatch.setattr(examination, "_examine", note)
    files = [SceneFile(path=tiny_scene), SceneFile(path=second)]
    with run_quality(files, [file.open() for file in files], ["dof", "shadows", "edges"], (64, 64)) as overview:
        shown = {part: [int(row.name) for row in rows] for part, rows in overview.parts.items()}
    assert seen == [
        ("dof", tiny_scene, []),
        ("dof", second, []),
        ("shadows", tiny_scene, ["ball"]),
        ("shadows", second, ["tall"]),
        ("edges of solids", None, []),
        ("edges", tiny_scene, ["ball"]),
    ]
    assert shown == {"dof": [1, 2], "shadows": [3, 4], "edges": [5, 6]} and overview.renderer == "a driver"


def test_a_worker_finds_what_this_process_does(
    gl_device: Device, tiny_scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From another folder, by absolute names; and it says nothing."""
    monkeypatch.chdir(tiny_scene.parent)
    piece = Piece(part="shadows", scene=SceneFile(path=Path(tiny_scene.name)), assets=(0,))
    here, driver = examination._examine(piece, (64, 48), quietly)
    monkeypatch.chdir("/")
    assert piece.scene is not None
    there = examine_alone(replace(piece, scene=replace(piece.scene, path=tiny_scene).absolute()), (64, 48))
    assert there == (here, driver) and len(here) == 2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["none.yaml"], "none.yaml: no such file"),
        (["--only", "edges,blur"], "--only blur: must be one of antialiasing, dof, shadows, edges"),
        (["--resolution", "32,400"], "--resolution 32,400: each side must be 64 to 1024 pixels"),
        (
            ["--cluster", "tcp://a"],
            "--cluster tcp://a: is not encrypted, and anybody may use it; only tls://HOST:PORT is taken",
        ),
        (["--json", "nowhere/a.json"], "nowhere/a.json: the folder 'nowhere' does not exist"),
        (["--json", "a", "--html", "a"], "a: would overwrite a file that is examined, or the other report"),
    ],
)
def test_bad_input_is_refused_in_one_line(options: Sequence[str], message: str) -> None:
    result = run("quality", *options)
    assert (result.exit_code, result.stderr, result.stdout) == (2, message + "\n", "")


def test_a_report_never_overwrites_the_scene(tiny_scene: Path) -> None:
    result = run("quality", tiny_scene, "--html", tiny_scene)
    assert result.exit_code == 2 and "would overwrite" in result.stderr


def test_rows_reach_their_goals_or_miss_them() -> None:
    row = Row(subject="box", name="gain, dB", measured=3.0, goal=3.0, details={"FLIP": 0.12345})
    assert row.reached and replace(row, measured=2.99).reached is False
    assert replace(row, measured=2.99, more_is_better=False).reached
    assert replace(row, measured=float("nan")).reached is False and replace(row, goal=None).reached is None
    shown = Overview(
        version="1",
        commit=None,
        renderer="GL",
        image_size=(8, 6),
        parts={"blur": [row, replace(row, measured=float("inf"), goal=None)]},
    )
    lines = to_text(shown).splitlines()
    assert "    gain, dB        3.0 ok     ≥ 3.0  FLIP 0.1235" in lines and lines[-1] == "1 of 1 goals reached"
    assert json.loads(to_json(shown))["rows"][1]["measured"] is None
    missed = replace(shown, parts={"blur": [replace(row, measured=1.0)]})
    assert 'class="missed">1.0 FAIL' in to_html(missed) and 'class="missed"' not in to_html(shown)


def test_shadows_of_a_ball_are_those_of_its_mesh(gl_device: Device, tiny_scene: Path) -> None:
    """Its images alone are compared, and what is drawn: so near, the mesh itself."""
    alone, drawn = shadows.examine([load_scene(tiny_scene)], (160, 120), quietly)
    assert alone.subject == drawn.subject == "ball"
    assert 0.97 < alone.measured == min(alone.details.values()) < 1 == drawn.measured
    assert alone.goal == shadows.LEAST_IOU and drawn.goal is None
    assert all(len(row.details) == len(shadows.SUNS) and len(row.pictures) == 1 for row in (alone, drawn))


def test_shadows_of_what_is_large_are_measured_as_well(gl_device: Device, tiny_scene: Path) -> None:
    """Many times as large as shadows reach by default."""
    scene = load_scene(tiny_scene)
    (ball,) = scene.assets
    assert isinstance(ball, MeshAsset)
    large = replace(scene, assets=(replace(ball, height=200.0),))
    alone, _ = shadows.examine([large], (80, 60), quietly)
    assert 0.9 < alone.measured < 1


def test_a_ground_without_the_objects_shadow_is_noticed(
    gl_device: Device, tiny_scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The measure itself: of a mesh and of nothing."""
    grounds = shadows._grounds
    nothing = shadows.Ground(np.ones((60, 80), bool), np.zeros((60, 80), bool))
    monkeypatch.setattr(shadows, "_grounds", lambda *these: (grounds(*these)[0], dict.fromkeys(shadows.WAYS, nothing)))
    alone, drawn = shadows.examine([load_scene(tiny_scene)], (80, 60), quietly)
    assert alone.measured == drawn.measured == 0 and not alone.reached


@pytest.mark.slow
def test_few_edges_of_closed_meshes_are_drawn(tiny_scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(edges, "REPEATS", 2)
    ball = sphere(1.0, 64, 32)
    write_ply(tiny_scene.with_name("ball.ply"), replace(ball, positions=np.round(ball.positions, 5)))  # no seam
    size = 512, 384
    rows = [*edges.examine_solids(size, quietly), *edges.examine([load_scene(tiny_scene)], size, quietly)]
    assert [row.subject for row in rows] == [*np.repeat(list(edges.SHAPES), 2), "ball"]
    drawn = [row for row in rows if row.name.startswith("lines")]
    assert all(row.reached for row in drawn)
    for row in drawn:
        assert 0 < row.details["chosen"] / row.details["all"] == pytest.approx(row.measured)
        assert 0 < row.details["outlines"] <= row.details["chosen"]
