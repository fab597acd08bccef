"""The outline of a frame: which passes run how often, and what the picture shows where."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from depthwalk.gpu.device import Device, Scope
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.image import read_pixels
from depthwalk.render.passes import default_passes
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.scene import Scene
from shapes import ShapeLibrary, box, scene_of
from stage import OnScreen

SIZE = (96, 64)
VIEW = View(Camera((0.0, 0.5, 4.0), (0.0, 0.5, 0.0), 0.7), SIZE)
Note = tuple[str, int, int]  # of a pass: its name, lens point and sample


@pytest.fixture(scope="module")
def library() -> ShapeLibrary:
    return ShapeLibrary([box(1.0, 1.0, 1.0, (0, 0.5, 0))], [None])


def crate() -> Scene:
    return scene_of((0, (0, 0, 0), 0.0, 1.0), representation=Representation.MESH)


class Noted(Pass[Params]):
    """Writes its name and sample into a list."""

    def __init__(self, notes: list[Note], frames: int = 1) -> None:
        super().__init__()
        self.notes, self.frames = notes, frames

    def setup(self, gl: Scope) -> None:
        pass

    def views(self, view: View, params: Params) -> tuple[View, ...]:
        return (view,) * self.frames

    def draw(self, frame: Frame, params: Params) -> None:
        self.notes.append((self.name, frame.lens_point, frame.sample))


def noted(name: str, notes: list[Note], frames: int = 1, **declared: bool) -> Noted:
    """A pass of this name, which declares besides what `Pass` lets it, as `per_sample`."""
    made = type(name, (Noted,), {"name": name, **declared})(notes, frames)
    assert isinstance(made, Noted)
    return made


def run(gl_device: Device, library: ShapeLibrary, scene: Scene, passes: Sequence[Pass[Any]]) -> int:
    with OnScreen(gl_device, scene, library, SIZE, passes) as stage:
        stage.draw(VIEW)
        assert stage.renderer.targets is not None
        return stage.renderer.targets.samples


def test_passes_that_draw_objects_come_first(gl_device: Device, library: ShapeLibrary) -> None:
    notes: list[Note] = []
    passes = [noted("last", notes), noted("objects", notes, draws_objects=True)]
    run(gl_device, library, crate(), passes)
    assert [name for name, _, _ in notes] == ["objects", "last"]


def test_neighbours_run_together_for_each_sample(gl_device: Device, library: ShapeLibrary) -> None:
    scene = crate()
    notes: list[Note] = []
    scene.render.aa = "msaa"
    passes = [noted("a", notes, per_sample=True), noted("b", notes, per_sample=True), noted("c", notes)]
    samples = run(gl_device, library, scene, passes)
    assert samples == 4
    assert notes == [(name, 0, sample) for sample in range(4) for name in ("a", "b")] + [("c", 0, 0)]


def test_a_pass_may_make_a_picture_of_several_frames(gl_device: Device, library: ShapeLibrary) -> None:
    notes: list[Note] = []
    run(gl_device, library, crate(), [noted("blend", notes, frames=3), noted("after", notes)])
    assert notes == [(name, point, 0) for point in range(3) for name in ("blend", "after")]


def test_the_picture_tells_distances_and_points(gl_device: Device, library: ShapeLibrary) -> None:
    """The crate's front face is 3.5 m away; beside it is nothing."""
    with OnScreen(gl_device, crate(), library, SIZE) as stage:
        assert stage.renderer.distance_at() == float("inf")  # before the first frame
        stage.draw(VIEW)
        assert stage.renderer.distance_at() == pytest.approx(3.5, abs=1e-3)
        point = stage.renderer.point_at(0.5, 0.5)
        assert point is not None and point.to_tuple() == pytest.approx((0.0, 0.5, 0.5), abs=1e-3)
        assert stage.renderer.distance_at(0.02, 0.5) == float("inf")
        assert stage.renderer.point_at(0.02, 0.5) is None


def test_a_camera_of_all_sees_all(gl_device: Device, library: ShapeLibrary) -> None:
    places = ((0, (-5, 0, 0), 0.0, 1.0), (0, (6, 0, -3), 0.0, 2.0))
    scene = scene_of(*places, representation=Representation.MESH)
    with OnScreen(gl_device, scene, library, SIZE) as stage:
        camera = stage.renderer.frame_all(SIZE[0] / SIZE[1])
        bounds = stage.renderer.world.bounds()
        indices, _ = bounds.visible(View(camera, SIZE))
        assert sorted(indices) == [0, 1]
        stage.draw(View(camera, SIZE), transparent=True)
        assert stage.renderer.view is not None
        near, far = stage.renderer.view.depth_range
        forward = (bounds.centre - stage.renderer.view.position) @ stage.renderer.view.axes[2]
        assert (forward - bounds.bounding_radius > 0.9 * near).all() and (forward < far).all()


def test_clip_planes_that_are_given_stay(gl_device: Device, library: ShapeLibrary) -> None:
    with OnScreen(gl_device, crate(), library, SIZE) as stage:
        stage.draw(replace(VIEW, near=0.5, far=9.0))
        assert stage.renderer.view is not None
        assert stage.renderer.view.depth_range == (0.5, 9.0)


def test_supersampled_targets_are_larger(gl_device: Device, library: ShapeLibrary) -> None:
    scene = crate()
    scene.render.aa = "ssaa"
    with OnScreen(gl_device, scene, library, SIZE) as stage:
        stage.draw(VIEW)
        assert stage.renderer.targets is not None
        assert stage.renderer.targets.size == (2 * SIZE[0], 2 * SIZE[1])
        assert np.isfinite(stage.renderer.distance_at())


def test_a_frame_may_have_fewer_passes(gl_device: Device, library: ShapeLibrary) -> None:
    passes = [pass_ for pass_ in default_passes() if pass_.name in ("mesh", "light", "output")]
    with OnScreen(gl_device, crate(), library, SIZE, passes) as stage:
        stage.draw(VIEW)
        assert stage.renderer.distance_at() == pytest.approx(3.5, abs=1e-3)


def test_a_rehearsal_leaves_no_trace_in_later_pictures(gl_device: Device, library: ShapeLibrary) -> None:
    """Shadow maps, which frames keep, would otherwise show what the rehearsal saw."""
    elsewhere = replace(VIEW, camera=Camera((0.0, 9.0, 40.0), (0.0, 0.5, 0.0), 0.7))
    pictures = []
    for rehearsed in (False, True):
        scene = crate()
        scene.render.shadows.enabled = True
        with OnScreen(gl_device, scene, library, SIZE) as stage:
            stage.renderer.remembers = True
            if rehearsed:
                stage.renderer.rehearse(elsewhere, stage.screen)
                assert stage.renderer.remembers
            stage.draw(VIEW)
            pictures.append(read_pixels(stage.screen))
    np.testing.assert_array_equal(pictures[0], pictures[1])
