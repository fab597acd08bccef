"""What a walk keeps beside its camera: the representation, and a path that is recorded."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from depthwalk.render.renderer import Renderer
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.environment import Environment, WalkParams
from depthwalk.scene.path import load_path
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.scene import Scene
from depthwalk.walk.changes import FileValues
from depthwalk.walk.controls import Move
from depthwalk.walk.state import State
from walks import FakeRenderer, state


def test_a_representation_reaches_the_renderer() -> None:
    walk = state()
    walk.represent(Representation.MESH)
    assert walk.renderer.world.representation is Representation.MESH and "mesh" in walk.toast


def test_what_is_recorded_is_saved_and_played(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    walk = state(path=False)
    walk.toggle_recording()
    walk.held.press(Move.FORWARD)
    for _ in range(50):
        walk.advance(0.04)
        walk.record(0.04)
    end = walk.camera
    walk.toggle_recording()
    (file,) = tmp_path.iterdir()
    assert file.name in walk.toast and walk.recorder is None
    path = load_path(file)
    assert path.times[-1] == pytest.approx(49 * 0.04)
    assert path.sample(9.0).position == pytest.approx(end.position, abs=1e-6)
    walk.toggle_path()
    assert walk.playback is not None
    assert walk.playback.playing and walk.camera.position == pytest.approx((0, 1, 5 - 0.12), abs=0.1)


@pytest.mark.parametrize("name", ["scene.yaml", "other.yaml"])
def test_another_scene_ends_the_recording_and_tells_where_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """It begins at home; the same, read again, goes on where one is, with the path."""
    monkeypatch.chdir(tmp_path)
    walk = state()
    walk.toggle_recording()
    walk.held.press(Move.FORWARD)
    for _ in range(9):
        walk.advance(0.1)
        walk.record(0.1)
    before, home = walk.camera, Camera((7, 8, 9), (0, 0, 0), 1.0)
    scene = SimpleNamespace(
        environment=Environment(),
        walk=WalkParams(speed=2.0),
        render=RenderSettings(),
        path=Path(name),
        files=(Path(name),),
        title=name,
        camera=home,
        animations=None,
    )
    walk.show(cast(Scene, scene), cast(Renderer, FakeRenderer()), 1.5)
    (file,) = tmp_path.iterdir()
    assert file.name in walk.toast and walk.recorder is None and walk.home == home
    again = name == "scene.yaml"
    assert walk.camera.position == (before.position if again else home.position)
    assert (walk.playback is not None) == again and (walk.walker.speed == 2) == (not again)


def read_again(walk: State, render: RenderSettings, name: str = "scene.yaml") -> Scene:
    scene = SimpleNamespace(
        environment=Environment(),
        walk=WalkParams(),
        render=render,
        path=Path(name),
        files=(Path(name),),
        title=name,
        camera=Camera((7, 8, 9), (0, 0, 0), 1.0),
        animations=None,
    )
    walk.show(cast(Scene, scene), cast(Renderer, FakeRenderer()), 1.5)
    return cast(Scene, scene)


def test_a_scene_that_is_read_again_is_inspected_as_before() -> None:
    walk = state()
    walk.scene.render.inspection.show = "level"
    walk.scene.render.warp.reuse_error = 3.0
    reloaded = read_again(walk, RenderSettings())
    assert reloaded.render.inspection.show == "level"
    assert reloaded.render.warp.reuse_error == RenderSettings().warp.reuse_error  # a setting of the scene's
    assert walk.changed == {"render": {"inspection": {"show": "level"}}}  # and the file does not say so
    assert read_again(walk, RenderSettings(), "other.yaml").render.inspection.show == "picture"


def test_what_the_file_inspects_is_taken_from_it_unless_the_user_chose_otherwise() -> None:
    walk = state()
    by_file = RenderSettings()
    by_file.inspection.show = "normals"
    assert read_again(walk, by_file).render.inspection.show == "normals"
    assert read_again(walk, RenderSettings()).render.inspection.show == "picture"


def test_a_recording_that_cannot_be_saved_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("depthwalk.walk.recorder.Path.cwd", lambda: tmp_path / "gone")
    monkeypatch.setattr("depthwalk.walk.recorder.user_documents_path", lambda: tmp_path / "gone too")
    walk = state(path=False)
    walk.toggle_recording()
    walk.record(0.1)
    walk.record(0.1)
    walk.toggle_recording()
    assert "gone too" in walk.toast and walk.playback is None


class FittingRenderer(FakeRenderer):
    """Steps back from what is wider than the window."""

    def frame_all(
        self, aspect: float, fov: float = 1.0, away: tuple[float, float, float] = (0, 0, 1), turns: bool = False
    ) -> Camera:
        return Camera((0, 1, 9 / min(aspect, 1)), (0, 1, 0), fov)


def framed_walk() -> State:
    walk = state(path=False)
    walk.renderer = cast(Renderer, FittingRenderer())
    walk.home_is_framed = True
    walk.fit_home(1.5)
    walk.go_home()
    walk.follow_window(1.5)
    return walk


@pytest.mark.parametrize("orbits", [False, True])
def test_a_view_of_everything_stays_one_when_the_window_changes_its_shape(orbits: bool) -> None:
    walk = framed_walk()
    if orbits:
        walk.toggle_orbit()
    jumps = walk.jumps
    walk.follow_window(1.5)
    assert walk.jumps == jumps
    walk.follow_window(0.5)
    assert walk.camera.position == pytest.approx((0, 1, 18)) and walk.jumps == jumps + 1
    walk.follow_window(2.0)
    assert walk.camera.position == pytest.approx((0, 1, 9))


def test_who_has_moved_stays_there_when_the_window_changes_its_shape() -> None:
    walk = framed_walk()
    walk.held.press(Move.FORWARD)
    walk.advance(0.04)
    walk.held.release(Move.FORWARD)
    moved = walk.camera.position
    walk.follow_window(0.5)
    assert walk.camera.position == moved != walk.home.position
    given = framed_walk()
    given.home_is_framed = False
    given.follow_window(0.5)
    assert given.camera.position == (0, 1, 9)
    zoomed = framed_walk()
    zoomed.set_fov(0.4)
    zoomed.follow_window(0.5)
    assert zoomed.camera.position == (0, 1, 9)


def test_a_complaint_stays_until_the_files_are_read_without_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """However long that takes, and whatever is told meanwhile."""
    now = [0.0]
    monkeypatch.setattr("depthwalk.walk.toast.time.monotonic", lambda: now[0])
    walk = state()
    walk.scene.objects = walk.renderer.world.objects = [None]  # type: ignore[misc, assignment, method-assign]
    walk.renderer.world.is_whole = True  # type: ignore[misc]
    walk.tell("Reloaded scene.yaml")
    walk.complain("scene.yaml:2:1: camra: unknown key")
    assert walk.notice == "scene.yaml:2:1: camra: unknown key"
    now[0] = 3600.0
    assert walk.notice == "scene.yaml:2:1: camra: unknown key"
    walk.tell("Flying")
    assert walk.notice == "Flying\nscene.yaml:2:1: camra: unknown key"
    read_again(walk, RenderSettings())
    assert not walk.complaint


@pytest.mark.parametrize(("in_file", "changed"), [("msaa", {}), ("ssaa", {"render": {"aa": "none"}})])
def test_what_the_machine_lacks_is_a_change_only_if_the_user_chose_it(in_file: str, changed: dict[str, Any]) -> None:
    walk = state()
    settings: Any = walk.scene.render
    cast(Any, walk.renderer).settings = settings
    settings.aa = in_file
    walk.file_values = FileValues(walk.scene)
    settings.aa = "msaa"
    walk.do_without_samples()
    assert settings.aa == "none" and walk.changed == changed
