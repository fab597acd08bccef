"""The papers' tables: what they hold, how they are shown, and which names are refused."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from depthwalk.bench.ratio import Ratio
from depthwalk.bench.tables import edges, focus, heads, planar, walks
from depthwalk.bench.tables.table import Table, to_markdown, to_section, to_text
from depthwalk.commands.cli import app
from depthwalk.quality import edges as quality_edges
from depthwalk.scene import loader
from depthwalk.scene.arrays import Representation

TABLE = Table(
    name="a",
    title="A title",
    source="A paper, table 1",
    columns=("what", "ms", "ratio", "none"),
    rows=(("one", 1234.5, Ratio(median=2.0, low=1.5, high=2.5), None), ("another", 0.12345, "-", "x")),
    notes=("A note.",),
)


def run(*arguments: int | Path | str) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def silent(name: str, step: str) -> None:
    """Report nothing."""


def test_tables_are_shown_as_text_and_markdown_and_on_a_page() -> None:
    assert to_text(TABLE).splitlines() == [
        "A title",
        "A paper, table 1",
        "",
        "what        ms             ratio  none",
        "one       1234  2 × (1.5 to 2.5)",
        "another  0.123                 -     x",
        "A note.",
    ]
    assert to_markdown(TABLE).splitlines()[4:] == [
        "| what | ms | ratio | none |",
        "| --- | --- | --- | --- |",
        "| one | 1234 | 2 × (1.5 to 2.5) |  |",
        "| another | 0.123 | - | x |",
        "",
        "- A note.",
    ]
    assert to_section(TABLE).tables[0][1] == ["one", "1234", "2 × (1.5 to 2.5)", ""]


@pytest.mark.gl
def test_the_table_of_edges(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All four shapes are measured; as many lines are left as their silhouettes need, and many objects save time."""
    monkeypatch.setattr(quality_edges, "REPEATS", 2)
    files = [tmp_path / name for name in ("t.json", "t.md", "t.html")]
    result = run("tables", "--only", "edges", "--json", files[0], "--markdown", files[1], "--html", files[2])
    assert result.exit_code == 0, result.stderr
    (table,) = json.loads(files[0].read_text())["tables"]
    assert [row[0].split(",")[0] for row in table["rows"]] == ["cube", "wheel cover", "wing", "canopy"]
    assert [row[1].split(" → ")[0] for row in table["rows"]] == ["18", "24", "125", "300"]
    assert [row[-1] for row in table["rows"]] == [0.76, 0.88, 0.75, 0.71]
    assert all(0 < row[7] < 1 for row in table["rows"])  # 64 objects: chosen ÷ all
    assert "| canopy, 102 | 300 → " in files[1].read_text()
    assert ("canopy, 102" in files[2].read_text() and "llvmpipe" in result.stdout) or "," in result.stdout


@pytest.fixture
def tiny(tiny_scene: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Return what loads the tiny scene in the place of a shipped one."""

    def load(*_: Any, overrides: dict[str, str] | None = None) -> Any:
        kept = {key: value for key, value in (overrides or {}).items() if not key.startswith("objects")}
        return loader.load_scene(tiny_scene, overrides=kept)

    monkeypatch.setattr(walks, "FRAMES", 3)
    for module in (heads, focus):
        monkeypatch.setattr(module, "load_scene", load)
        monkeypatch.setattr(module, "SIZE", (64, 48))
    monkeypatch.setattr(focus, "FRAMES", 3)
    monkeypatch.setattr(heads, "PAPER", {"ball": (320, 2.0, 5.0)})
    return load


@pytest.mark.gl
@pytest.mark.usefixtures("tiny")
def test_the_table_of_heads_and_of_focus() -> None:
    """Every way is compared with polygons and with the truth; the polygons are nearest to it."""
    table = heads.measured(silent, 2)
    assert [len(row) for row in table.rows] == [len(table.columns)] * 2
    for row in table.rows:
        head, triangles, _, polygons, *others = row
        assert (head, triangles) == ("ball", "320") and isinstance(polygons, float) and polygons > 0
        assert all(isinstance(cell, Ratio) and 0 < cell.low <= cell.median <= cell.high for cell in others[:6])
        assert all(isinstance(cell, str) and cell.split(" dB, ")[1] for cell in others[6:])
    table = focus.measured(silent)
    assert [row[0] for row in table.rows] == ["none", "paper", "gather"]
    assert table.rows[0][2] == Ratio(median=1.0, low=1.0, high=1.0)
    assert to_text(table).count(" × (") == 3


@pytest.mark.gl
def test_the_table_of_planar_depth_images(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each way has its row, the warp is compared with itself; what has no silhouette is farthest from the truth."""
    monkeypatch.setattr(planar, "SIZE", (96, 72))
    monkeypatch.setattr(planar, "FRAMES", 10)
    monkeypatch.setattr(planar, "VIEWS", {"aside": 40.0})
    monkeypatch.setattr(planar, "KINDS", (Representation.DPCI, Representation.DMESH, Representation.BUMP))
    table = planar.measured(silent)
    assert [row[:2] for row in table.rows] == [("aside", "dpci"), ("aside", "dmesh"), ("aside", "bump")]
    assert table.rows[0][3] == 1.0 and table.rows[0][5] == Ratio(median=1.0, low=1.0, high=1.0)
    assert [row[6] for row in table.rows] == [None, 3.9, None]
    flip = [float(str(row[7]).split(", ")[1]) for row in table.rows]
    assert max(flip[:2]) < 0.8 * flip[2]


def test_the_viewer_passes_the_middle_of_the_head() -> None:
    cameras = walks.past((1.0, 2.0, 3.0), 4.0)
    middle = cameras[len(cameras) // 2]
    assert middle.position == (1.0, 2.0, 7.0) and middle.target == (1.0, 2.0, 3.0)
    step = cameras[1].position[0] - cameras[0].position[0]
    assert step == pytest.approx(1.4 / 30) and len(cameras) == walks.FRAMES


def test_unknown_tables_are_refused() -> None:
    result = run("tables", "--only", "heads,egdes")
    message = (
        "--only egdes: must be one of heads, planar, edges, focus, triangles, objects, pixels; did you mean 'edges'?\n"
    )
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", message)


def test_all_shapes_have_a_figure_of_the_paper() -> None:
    assert len(quality_edges.SHAPES) == len(edges.PAPER)
