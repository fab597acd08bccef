"""`depthwalk demo` and `view` where there is no display."""

import pytest

import depthwalk.walk
from depthwalk.commands import walk

REASON = "cannot open a window: no display"


@pytest.fixture
def garden(tiny_scene, tmp_path, monkeypatch):
    """The tiny scene in place of the garden, an empty current folder, no display."""
    (tiny_scene.parent / "paths").mkdir()
    tiny_scene.rename(tiny_scene.with_name("garden.yaml"))
    tiny_scene.with_name("walk.yaml").rename(tiny_scene.parent / "paths" / "garden.yaml")
    monkeypatch.setattr(walk, "scene_root", lambda: tiny_scene.parent)
    monkeypatch.chdir(tmp_path)
    calls = []

    def no_window(scene, library, **options):
        calls.append((scene, options))
        raise depthwalk.walk.NoDisplay(REASON)

    monkeypatch.setattr(depthwalk.walk, "run", no_window)
    return calls


def test_demo_without_display_renders_the_tour(run, garden, tmp_path):
    result = run("demo", "--resolution", "96,64")
    folder = tmp_path / "depthwalk-demo"
    assert result.exit_code == 0
    assert result.stderr == f"{REASON}; rendering the tour to {folder}\n"
    names = [f"garden-{k:02}.png" for k in range(6)] + ["garden.mp4"]
    assert result.stdout.splitlines() == [f"depthwalk-demo/{name}" for name in names]
    assert sorted(path.name for path in folder.iterdir()) == names


def test_demo_without_its_scene_says_so(run, garden, tmp_path):
    scene = tmp_path / "scene" / "garden.yaml"
    scene.unlink()
    result = run("demo")
    assert (result.exit_code, result.stderr) == (2, f"{scene}: no such file; the demo scene is not installed\n")


def test_view_passes_on_what_was_asked(run, garden):
    options = ["--representation", "mesh", "--camera-position", "0,2,5", "--resolution", "320,200", "--fullscreen"]
    result = run("view", *options)
    assert (result.exit_code, result.stdout) == (1, "")
    assert result.stderr == f"{REASON}; `depthwalk render` needs no display\n"
    ((scene, given),) = garden
    assert scene.path.name == "garden.yaml"
    assert given["camera"].position == (0, 2, 5) and given["camera"].target == (0, 1, 0)
    assert (given["size"], given["fullscreen"], given["representation"].name) == ((320, 200), True, "MESH")


def test_view_needs_a_whole_camera_where_the_scene_has_none(run, garden, tmp_path):
    scene = tmp_path / "bare.yaml"
    scene.write_text("version: 1\n")
    result = run("view", scene, "--camera-position", "0,2,5")
    message = f"{scene}: has no camera: give --camera-position and --camera-target together\n"
    assert (result.exit_code, result.stderr, garden) == (2, message, [])
