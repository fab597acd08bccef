"""`depthwalk advise`: what it measures, advises and writes, and what it refuses."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from depthwalk.bench import advise
from depthwalk.bench.advise import judged
from depthwalk.bench.object_cost import Cost
from depthwalk.commands.cli import app
from depthwalk.scene.advice import advice_text
from depthwalk.scene.arrays import Representation
from depthwalk.scene.loader import load_scene

DPCI, MESH, LOD = Representation.DPCI, Representation.MESH, Representation.MESH_LOD


def run(*arguments: Path | str) -> Result:
    return CliRunner().invoke(app, ["advise", *map(str, arguments)])


def costs(**by: tuple[float, float]) -> dict[Representation, Cost]:
    return {Representation[name.upper()]: Cost(milliseconds=ms, flip=flip) for name, (ms, flip) in by.items()}


def test_the_quickest_is_advised_of_what_is_good_enough() -> None:
    found = judged("a", 100, costs(dpci=(1, 0.05), mesh=(4, 0.04), mesh_lod=(0.5, 0.3)), 0.1, MESH)
    assert (found.quickest, found.mesh) == (DPCI, False)
    found = judged("a", 100, costs(dpci=(1, 0.2), mesh=(4, 0.04), mesh_lod=(2, 0.05)), 0.1, MESH)
    assert (found.quickest, found.mesh) == (LOD, True)  # the depth images are not good enough
    found = judged("a", 10, costs(dpci=(1, 0.24), mesh=(4, 0.2), mesh_lod=(0.5, 0.3)), 0.1, MESH)
    assert (found.quickest, found.mesh) == (DPCI, False)  # the mesh itself is hardly better
    found = judged("a", 100, costs(dpci=(5, 0.05), mesh=(4, 0.04), mesh_lod=(4.5, 0.05)), 0.1, MESH)
    assert (found.quickest, found.mesh) == (MESH, True)
    light = costs(dpci=(3, 0.05), mesh=(4, 0.04), mesh_lod=(1, 0.06))
    assert judged("a", 100, light, 0.1, LOD).mesh and not judged("a", 100, light, 0.1, MESH).mesh
    assert not judged("a", 100, light, 0.055, LOD).mesh  # whose level is not good enough


@pytest.mark.gl
@pytest.mark.slow
def test_advice_is_measured_written_and_followed(tiny_scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(advise, "SIZES", (30, 100_000))  # the latter is larger than the picture
    monkeypatch.setattr(advise, "FRAMES", 2)
    result = run(tiny_scene, "--resolution", "64,48", "--seconds", "100")
    assert result.exit_code == 0, result.stderr
    file = tiny_scene.with_name("scene.advice.json")
    assert f"written to {file}" in result.stdout and "advice: scene.advice.json" in result.stdout
    sizes = json.loads(file.read_text())["assets"]["ball"]
    assert [size["pixels"] for size in sizes] == [30]
    assert all(set(size["measured"]) == {"dpci", "mesh", "mesh-lod", "mesh-clusters"} for size in sizes)
    for size in sizes:
        flips = {name: value["flip"] for name, value in size["measured"].items()}
        assert max(flips["mesh"], flips["mesh-lod"]) < 0.5  # either may be better: a level has less aliasing
    advice = load_scene(tiny_scene, overrides={"advice": file.name}).advice["ball"]
    assert advice.mesh == tuple(size["mesh"] for size in sizes)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Let an hour pass whenever somebody looks at the clock."""
    hours: Iterator[int] = iter(range(0, 10**9, 3600))
    return lambda: monkeypatch.setattr("depthwalk.bench.advise.time.monotonic", lambda: float(next(hours)))


@pytest.mark.gl
def test_where_time_is_up_nothing_is_written(tiny_scene: Path, clock: Callable[[], None]) -> None:
    clock()
    result = run(tiny_scene, "--resolution", "64,48")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.splitlines()[-1] == f"{tiny_scene}: nothing to advise: there was no time for a measurement"
    assert not tiny_scene.with_name("scene.advice.json").exists()


def test_pictures_too_small_for_a_measurement_are_refused(tiny_scene: Path) -> None:
    result = run(tiny_scene, "--resolution", "10,14")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == "--resolution 10,14: must be at least 15 pixels wide or high\n"


@pytest.mark.gl
def test_a_scene_without_a_choice_is_refused(tiny_scene: Path) -> None:
    lone = tiny_scene.with_name("lone.yaml")
    lone.write_text("version: 1\nassets: {a: {mesh: ball.ply}}\nobjects: [{asset: a}]\n")
    result = run(lone)
    message = f"{lone}: nothing to advise: no asset has both a mesh and depth images made from it\n"
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", message)


def test_pictures_are_not_too_large_to_be_compared(tiny_scene: Path) -> None:
    result = run(tiny_scene, "--resolution", "4100,48")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith("--resolution 4100,48: each side must be at most 4096 pixels")


def test_nothing_of_the_scene_is_overwritten(tiny_scene: Path) -> None:
    before = tiny_scene.read_bytes()
    result = run(tiny_scene, "--json", tiny_scene)
    assert result.exit_code == 2 and "would overwrite" in result.stderr
    assert tiny_scene.read_bytes() == before


@pytest.mark.gl
def test_advice_that_the_scene_follows_may_be_replaced(tiny_scene: Path, clock: Callable[[], None]) -> None:
    clock()
    former = tiny_scene.with_name("scene.advice.json")
    former.write_text(advice_text("a GPU", 0.1, {}))
    tiny_scene.write_text(f"{tiny_scene.read_text()}\nadvice: {former.name}\n")
    result = run(tiny_scene, "--resolution", "64,48")
    assert result.stderr.splitlines()[-1].endswith("there was no time for a measurement")
