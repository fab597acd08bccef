"""The plainest engine: what it draws, at which level, and that both of its comparisons are one command."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tools.plain_engine import __main__ as tool
from tools.plain_engine import engine as plain_engine
from tools.plain_engine.engine import PlainEngine, edge_length

import shapes
from depthwalk.assets.library import SceneLibrary
from depthwalk.gpu.device import Device
from depthwalk.gpu.headless_device import headless_device
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.loader import load_scene

SIZE = 96, 72
CAMERA = Camera((0, 1, 5), (0, 1, 0), np.radians(45))


@pytest.fixture
def row(tiny_scene: Path) -> Path:
    """The scene with nine balls, one behind the other, the first of them at the origin."""
    grid = "- {grid: {asset: ball, count: [1, 9], spacing: [3, 3], position: [0, 0, -12]}}"
    tiny_scene.write_text(tiny_scene.read_text().replace("- {asset: ball}", grid))
    return tiny_scene


@pytest.fixture
def engine(row: Path) -> Iterator[PlainEngine]:
    scene = load_scene(row)
    levels = SceneLibrary(scene.assets).mesh_levels(0)
    assert len(levels) > 2
    engine = PlainEngine(scene, levels, [edge_length(level.mesh) for level in levels], SIZE, 0.0)
    yield engine
    engine.release()


def test_a_failing_engine_leaves_no_context_behind(row: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Device] = []

    def noted() -> Device:
        made.append(headless_device())
        return made[0]

    monkeypatch.setattr(plain_engine, "headless_device", noted)
    with pytest.raises(IndexError):  # there is no level
        PlainEngine(load_scene(row), [], [], SIZE, 0.0)
    with pytest.raises(AttributeError):  # as moderngl's contexts are once they are released
        _ = made[0].context.error


def test_the_length_of_edges_is_their_mean() -> None:
    mesh = shapes.sphere(0.5, columns=4, rows=2)
    lengths = [
        np.linalg.norm(mesh.positions[one] - mesh.positions[other])
        for face in mesh.faces
        for one, other in ((face[0], face[1]), (face[1], face[2]), (face[2], face[0]))
    ]
    assert edge_length(mesh) == pytest.approx(np.mean(lengths), rel=1e-5)


@pytest.mark.gl
def test_the_engine_draws_what_the_meshes_are(engine: PlainEngine, row: Path) -> None:
    engine.draw(View(CAMERA, SIZE))
    scene = load_scene(row)
    with HeadlessRenderer(scene, SceneLibrary(scene.assets), SIZE, Representation.MESH) as headless:
        headless.renderer.settings.aa = "none"
        headless.draw(View(CAMERA, SIZE))
        off = np.abs(engine.pixels()[..., :3].astype(int) - headless.pixels()[..., :3])
    assert engine.pixels()[..., :3].std() > 20
    assert off.mean() < 0.5


@pytest.mark.gl
def test_far_objects_have_coarse_levels_and_those_out_of_view_none(engine: PlainEngine) -> None:
    view = View(CAMERA, SIZE)
    engine.draw(view)
    assert engine.drawn.tolist() == [9, *[0] * (len(engine.drawn) - 1)]
    finest = engine.triangles
    engine.allowed = 2.0
    engine.draw(view)
    assert engine.drawn.sum() == 9 and np.count_nonzero(engine.drawn) > 1 and engine.triangles < finest / 2
    engine.draw(View(replace(CAMERA, position=(0, 1, -10.5)), SIZE))  # among them, looking back at four
    assert engine.drawn.sum() == 4


@pytest.mark.slow
@pytest.mark.gl
def test_many_objects_are_walked_past(
    row: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tool, "_MOMENTS", 1)
    path = row.with_name("past.yaml")
    path.write_text(
        "version: 1\nfps: 36\nkeyframes:\n"
        "  - {time: 0, position: [-1, 1, 9], target: [-1, 1, 0], fov: 45}\n"
        "  - {time: 1, position: [1, 1, 9], target: [1, 1, 0], fov: 45}\n"
    )
    tool.main([str(row), "--path", str(path), "--counts", "9", "--size", "48", "36"])
    out = capsys.readouterr().out
    assert "9 objects" in out
    rows = [[cell.strip(" `") for cell in line.split("|")[1:-1]] for line in out.splitlines() if line.startswith("| `")]
    assert [name for name, *_ in rows] == ["scene", "mesh-lod", "mesh-clusters", "engine"]
    assert all(float(ms) > 0 and float(ratio) > 0 and 0 <= float(flip) < 0.2 for _, ms, ratio, flip in rows)
    assert rows[3][2] == "1.00"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--counts", "10"], "--counts 10: must be N,…, each from 1 to the 9"),
        (["--counts", "0"], "--counts 0: must be N,…"),
        (["--path", "nowhere.yaml"], "nowhere.yaml"),
        (["--frames", "17"], "--frames: must be at least 18"),
        (["--edges", "0"], "must be more than 0"),
    ],
)
def test_what_cannot_be_is_refused(
    row: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = row.with_name("long.yaml")
    path.write_text("version: 1\nfps: 36\nkeyframes:\n- {time: 0, position: [0, 1, 9], target: [0, 1, 0], fov: 45}\n")
    path.write_text(path.read_text() + "- {time: 1, position: [1, 1, 9], target: [0, 1, 0], fov: 45}\n")
    with pytest.raises(SystemExit) as ended:
        tool.main([str(row), "--path", str(path), *arguments])
    assert ended.value.code == 2
    assert message in capsys.readouterr().err
