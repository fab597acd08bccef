"""`depthwalk demo` and `view` where there is no display."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from pyglm import glm

import depthwalk.walk
from depthwalk.assets.library import SceneLibrary
from depthwalk.commands import view
from depthwalk.ingest.loader import load_mesh
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene
from depthwalk.walk.walk_options import WalkOptions

REASON = "cannot open a window: no display"


@pytest.fixture
def garden(tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The tiny scene in place of the garden, an empty current folder, no display."""
    (tiny_scene.parent / "paths").mkdir()
    tiny_scene.rename(tiny_scene.with_name("garden.yaml"))
    tiny_scene.with_name("walk.yaml").rename(tiny_scene.parent / "paths" / "garden.yaml")
    monkeypatch.setattr(view, "scene_root", lambda: tiny_scene.parent)
    monkeypatch.chdir(tmp_path)
    calls = []

    def no_window(scene: Scene, library: SceneLibrary, options: WalkOptions, **window: Any) -> None:
        calls.append((scene, options, window))
        raise depthwalk.walk.NoDisplayError(REASON)

    monkeypatch.setattr(depthwalk.walk, "run", no_window)
    return calls


@pytest.mark.gl
def test_demo_without_display_renders_the_tour(
    run: Callable[..., Any], garden: Sequence[object], tmp_path: Path
) -> None:
    result = run("demo", "--resolution", "96,64")
    folder = tmp_path / "depthwalk-demo"
    assert result.exit_code == 0
    assert result.stderr == f"{REASON}; rendering the tour to {folder}\n"
    names = [f"garden-{k:02}.png" for k in range(6)] + ["garden.mp4"]
    assert result.stdout.splitlines() == [f"depthwalk-demo/{name}" for name in names]
    assert sorted(path.name for path in folder.iterdir()) == names


@pytest.mark.gl
def test_demo_of_another_scene_plays_its_tour(run: Callable[..., Any], garden: Sequence[Any], tmp_path: Path) -> None:
    shipped = tmp_path / "scene"
    shipped.joinpath("garden.yaml").rename(shipped / "night.yaml")
    shipped.joinpath("paths", "garden.yaml").rename(shipped / "paths" / "night.yaml")
    result = run("demo", "night", "--resolution", "96,64", "--frames", "1")
    assert result.exit_code == 0, result.stderr
    assert result.stdout.splitlines() == ["depthwalk-demo/night-00.png", "depthwalk-demo/night.mp4"]
    unknown = run("demo", "gardn")
    assert unknown.exit_code == 2 and "gardn" in unknown.stderr


def test_demo_without_its_scene_says_so(run: Callable[..., Any], garden: Sequence[Any], tmp_path: Path) -> None:
    (tmp_path / "scene" / "garden.yaml").unlink()
    result = run("demo")
    assert result.exit_code == 2
    assert result.stderr == "scene/garden.yaml: no such file; the demo scene is not installed\n"


def test_view_passes_on_what_was_asked(run: Callable[..., Any], garden: Sequence[Any]) -> None:
    options = ["--representation", "mesh", "--camera-position", "0,2,5", "--resolution", "320,200", "--fullscreen"]
    result = run("view", *options)
    assert (result.exit_code, result.stdout) == (1, "")
    assert result.stderr == f"{REASON}; `depthwalk render` needs no display\n"
    ((scene, given, window),) = garden
    assert scene.path.name == "garden.yaml"
    camera = given.first_camera(scene.camera, None)
    assert camera == replace(scene.camera, position=(0, 2, 5)) and camera.target == (0, 1, 0)
    assert given.representation is Representation.MESH and window == {"size": (320, 200), "fullscreen": True}


def test_view_shows_several_meshes(run: Callable[..., Any], garden: Sequence[Any], tiny_scene: Path) -> None:
    """Read again they are the same ones with the same settings; what is dropped has none of them."""
    ball = tiny_scene.with_name("ball.ply")
    run("view", ball, ball, "--side-by-side", "--set", "render.aa=fxaa")
    ((scene, given, _),) = garden
    assert scene.files == (ball, ball) and scene.side_by_side and len(scene.objects) == 2
    again = given.read(scene.files)
    assert again.files == (ball, ball) and again.side_by_side and again.render.aa == "fxaa"
    dropped = given.read((ball,))
    assert dropped.files == (ball,) and dropped.render.aa == load_scene(ball).render.aa


@pytest.mark.gl
def test_render_draws_several_meshes(run: Callable[..., Any], tiny_scene: Path, tmp_path: Path) -> None:
    """Two balls at one place hide each other; side by side they cover twice as much, each half as wide."""
    ball, options = tiny_scene.with_name("ball.ply"), ("--resolution", "96,64", "--no-background")
    covered = []
    for more in (), ("--side-by-side",):
        assert run("render", ball, ball, *options, *more, "-o", tmp_path / "a.png").exit_code == 0
        covered.append(np.asarray(Image.open(tmp_path / "a.png"))[..., 3] > 0)
    assert covered[0].any(0).sum() < 60 < covered[1].any(0).sum()
    refused = run(
        "render",
        ball,
        ball,
        *options,
        "--cluster",
        "local:1",
        "--path",
        tiny_scene.with_name("walk.yaml"),
        "-o",
        tmp_path / "{frame}.png",
    )
    assert (refused.exit_code, refused.stderr) == (2, "--cluster: draws a scene file, or one mesh without --texture\n")


@pytest.mark.gl
def test_without_a_camera_view_starts_where_render_stands(
    run: Callable[..., Any],
    garden: Sequence[Any],
    tiny_scene: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = tiny_scene.with_name("garden.yaml")
    scene.write_text(scene.read_text().partition("camera:")[0])
    options = (scene, "--camera-position", "0,2,5", "--camera-view-angle", "30", "--resolution", "96,64")
    drawn = []
    draw = HeadlessRenderer.draw
    monkeypatch.setattr(
        HeadlessRenderer, "draw", lambda self, view, *rest, **more: (drawn.append(view), draw(self, view))
    )
    assert run("render", *options, "-o", tmp_path / "a.png").exit_code == 0
    assert run("view", *options).exit_code == 1
    ((_, given, _),) = garden
    whole = Camera((9.0, 9.0, 9.0), drawn[0].camera.target, 1.0)  # what sees all of it has this target
    assert given.first_camera(whole, None) == drawn[0].camera
    assert drawn[0].camera.position == (0, 2, 5) and drawn[0].camera.target == pytest.approx((0, 1, 0), abs=0.05)


@pytest.mark.gl
def test_a_direction_shows_all_objects_from_there(
    run: Callable[..., Any], garden: Sequence[Any], tiny_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = tiny_scene.with_name("garden.yaml")
    options = (scene, "--camera-direction", "-2,0,0", "--camera-view-angle", "30", "--resolution", "96,64")
    drawn = []
    draw = HeadlessRenderer.draw
    monkeypatch.setattr(
        HeadlessRenderer, "draw", lambda self, view, *rest, **more: (drawn.append(view), draw(self, view))
    )
    assert run("render", *options, "-o", tmp_path / "a.png").exit_code == 0
    camera = drawn[0].camera
    assert tuple(glm.normalize(camera.look)) == pytest.approx((-1, 0, 0))
    assert camera.fov == pytest.approx(math.radians(30))
    assert run("view", *options).exit_code == 1
    ((_, given, _),) = garden
    asked = given.first_camera(Camera((9.0, 9.0, 9.0), (0.0, 0.0, 0.0), 1.0), lambda fov, along: (fov, along))
    assert asked == (pytest.approx(math.radians(30)), (-2, 0, 0))


@pytest.mark.gl
def test_demo_loads_its_assets_once(
    run: Callable[..., Any], garden: Sequence[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded = []
    monkeypatch.setattr(
        "depthwalk.assets.asset_files.load_mesh", lambda *a, **b: (loaded.append(a), load_mesh(*a, **b))[1]
    )
    assert run("demo", "--resolution", "96,64", "--representation", "mesh").exit_code == 0
    assert len(loaded) == 1
