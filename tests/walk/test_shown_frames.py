"""What a window shows while frames are slow, and when it rests."""

import math
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera
from shown_windows import SIZE, Window
from stage import OnScreen

pytestmark = pytest.mark.usefixtures("small_surround")


def test_in_slices_the_picture_at_rest_is_that_of_whole_frames(gl_device: Device, sliced: Window) -> None:
    sliced.rest()
    assert sliced.frames.in_slices
    with Window(gl_device, "off") as whole:
        whole.rest()
        assert not whole.frames.in_slices
        differs = np.abs(sliced.pixels() - whole.pixels()).max(-1) > 2
    assert differs.mean() < 0.005


def test_a_frame_is_drawn_over_several_rounds_and_the_picture_follows_in_each(sliced: Window) -> None:
    sliced.rest()
    before, finished = sliced.pixels(), []
    pictures = []
    for step in range(12):
        finished.append(sliced.round(0.02 * step))
        pictures.append(sliced.pixels())
    assert not all(finished)
    moved = [np.abs(one - other).mean() for one, other in zip(pictures[1:], pictures, strict=False)]
    assert min(moved) > 0 and np.abs(pictures[-1] - before).mean() > np.abs(pictures[1] - before).mean()


def test_it_rests_until_something_changes(sliced: Window) -> None:
    sliced.rest()
    drawn = sliced.finished
    for _ in range(5):
        assert not sliced.round() and sliced.frames.is_current
    assert sliced.finished == drawn
    sliced.renderer.settings.output.exposure = 1.0
    sliced.round()
    assert not sliced.frames.is_current
    sliced.rest()
    assert sliced.finished > drawn


def test_while_nothing_moves_a_picture_is_not_shown_again(sliced: Window) -> None:
    """Until a frame is finished, the viewer moves, or settings change, which a later frame shows."""
    sliced.rest()
    sliced.round(0.1)
    camera = Camera((0.1, 1.2, 4.0), (0.1, 0.6, 0.0), 0.8)
    skipped = 0
    for _ in range(500):
        sliced.frames.note(camera, 0.02, SIZE)
        if sliced.frames.is_current:
            break
        if sliced.frames.is_shown:
            skipped += 1
        else:
            sliced.frames.draw(View(camera, SIZE), sliced.screen)
        sliced.frames.work()
    assert sliced.frames.is_current and skipped > 5
    shown = sliced.pixels()
    sliced.frames.draw(View(camera, SIZE), sliced.screen)
    assert (sliced.pixels() == shown).all()


def test_a_frame_that_was_begun_can_be_finished_at_once(sliced: Window) -> None:
    sliced.rest()
    sliced.round(0.1)
    assert sliced.frames.is_drawing
    sliced.frames.finish()
    assert not sliced.frames.is_drawing


def test_slices_after_whole_frames_show_no_picture_of_before(sliced: Window) -> None:
    sliced.rest()
    settings = sliced.renderer.settings.reprojection
    settings.mode = "off"
    sliced.round(right=2.5)
    whole = sliced.pixels()
    settings.mode = "on"
    assert sliced.round(right=2.5)  # the picture of where the viewer was would show the same directions
    assert np.abs(sliced.pixels() - whole).mean() < 2


def test_who_starts_to_walk_waits_for_no_frame(gl_device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is known by then that frames are slow, and one with a margin is there."""
    monkeypatch.setattr("depthwalk.walk.scene_frames._SLOW", 0.0)
    monkeypatch.setattr("depthwalk.walk.scene_frames._QUICK", 0.0)
    with Window(gl_device, "auto") as window:
        monkeypatch.setattr(window.frames, "_catch_up", lambda view: pytest.fail("waited"))  # the second one is there
        window.rest()
        assert window.frames.in_slices
        monkeypatch.setattr(window.frames, "_draw_whole", lambda view, screen: pytest.fail("drew a whole frame"))
        for step in range(1, 4):
            window.round(0.02 * step)


def turned(degrees: float, right: float = 0.0) -> Camera:
    angle = math.radians(degrees)
    return Camera((right, 1.2, 4.0), (right + math.sin(angle), 1.05, 4.0 - math.cos(angle)), 0.8)


def test_who_turns_quickly_waits_for_no_frame_and_sees_what_is_there(
    sliced: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    sliced.rest()
    monkeypatch.setattr(sliced.frames, "_catch_up", lambda view: pytest.fail("waited"))
    for degrees in (100, 190, 250, 350):  # in one round each: none shows what the one before did
        camera = turned(degrees)
        sliced.frames.note(camera, 0.02, SIZE)
        sliced.frames.draw(View(camera, SIZE), sliced.screen)
        shown = sliced.pixels()
        assert sliced.frames.unseen < 0.05
        sliced.frames.finish()
        sliced.draw(View(camera, SIZE))
        off = np.abs(shown - sliced.pixels())
        assert np.median(off) <= 4 and off.mean() < 12


def test_who_outruns_the_frames_is_shown_on_the_way(sliced: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    """At first where the last frame still holds most of what is seen; then where the viewer is."""
    most, camera = 0.1, Camera((3.0, 1.2, 3.0), (3.0, 0.6, -1.0), 0.8)
    monkeypatch.setattr("depthwalk.walk.shown_frames._MOST_UNCOVERED", most)
    sliced.rest()
    reprojection = sliced.frames._reprojection
    assert reprojection.uncovered(np.array(camera.position)) > 1.5 * most
    sliced.frames.note(camera, 0.02, SIZE)
    sliced.frames.draw(View(camera, SIZE), sliced.screen)
    shown, view = sliced.pixels(), sliced.frames.view
    assert view is not None and 0.5 < view.camera.position[0] < 2.5
    assert tuple(view.camera.look) == pytest.approx(tuple(camera.look))
    assert reprojection.uncovered(view.position) == pytest.approx(most)
    for _ in range(500):
        sliced.frames.work()
        sliced.frames.note(camera, 0.02, SIZE)
        sliced.frames.draw(View(camera, SIZE), sliced.screen)
        if sliced.frames.is_current:
            break
    assert sliced.frames.view == View(camera, SIZE)
    off = np.abs(shown - sliced.true(view.camera)).max(-1)
    assert (off > 20).mean() < 0.12


def test_who_jumps_and_turns_waits_for_a_frame(sliced: Window) -> None:
    sliced.rest()
    camera = turned(180, right=9.0)
    sliced.frames.note(camera, 0.02, SIZE)
    assert sliced.frames.draw(View(camera, SIZE), sliced.screen) and sliced.frames.unseen == 0


def test_who_jumps_waits_for_a_frame_though_the_last_one_covers_the_view(sliced: Window) -> None:
    """It would be reprojected across the room, and the way there would be taken for a motion that goes on."""
    sliced.rest()
    camera = Camera((1.5, 1.2, 2.5), (0.0, 0.6, 0.0), 0.8)
    sliced.frames.note(camera, 0.02, SIZE, jumps=1)
    assert sliced.frames.draw(View(camera, SIZE), sliced.screen)
    shown = sliced.pixels()
    sliced.frames.finish()
    sliced.draw(View(camera, SIZE))
    off = np.abs(shown - sliced.pixels())
    assert np.median(off) <= 4 and off.mean() < 8
    sliced.frames.note(camera, 0.02, SIZE, jumps=1)
    assert not sliced.frames.draw(View(camera, SIZE), sliced.screen)


def test_what_lies_around_is_drawn_at_rest_and_again_after_a_change(sliced: Window) -> None:
    def unseen() -> list[float]:
        return [sliced.frames._reprojection.unseen(View(turned(degrees), SIZE)) for degrees in (90, 180, 270)]

    sliced.rest()
    assert max(unseen()) < 0.1
    sliced.renderer.settings.output.exposure = 1.0
    sliced.round()
    assert unseen() == [1, 1, 1]
    sliced.rest()
    assert max(unseen()) < 0.1


def test_a_viewer_who_walks_at_once_knows_soon_what_lies_around(sliced: Window) -> None:
    """Beside the frames, at most one side of the surround for each of them."""
    sides = 0
    for step in range(200):
        before = sliced.finished
        drawing = sliced.frames._around.is_drawing
        sliced.round(0.005 * step)
        sides += sliced.frames._around.is_drawing and not drawing
        assert sides <= sliced.finished + 1 and sliced.finished >= before
    assert sliced.frames._reprojection.unseen(View(turned(180, 1.0), SIZE)) < 0.02


def test_nothing_is_drawn_around_who_looks_at_targets(sliced: Window) -> None:
    sliced.frames.refines = False
    sliced.rest()
    assert sliced.frames._reprojection.unseen(View(turned(180), SIZE)) == 1


def test_who_begins_to_look_at_targets_sees_those_of_a_frame(sliced: Window) -> None:
    sliced.rest()
    renderer = sliced.renderer
    assert renderer.targets is not None and renderer.view is not None
    assert renderer.targets.size != renderer.view.size  # but those of a quarter of the still picture
    sliced.frames.refines = False
    assert not sliced.frames.is_current
    sliced.rest()
    assert renderer.targets.size == renderer.view.size


def test_an_autofocus_follows_whole_frames(sliced: Window) -> None:
    sliced.rest()
    sliced.renderer.settings.dof.mode, sliced.renderer.settings.dof.autofocus = "gather", True
    assert sliced.round(0.1) and not sliced.frames.in_slices


def test_places_are_those_that_the_window_shows(sliced: Window) -> None:
    sliced.rest()
    point = sliced.frames.point_at(0.5, 0.9)
    assert point is not None and point.y == pytest.approx(0, abs=0.02)
    assert sliced.frames.point_at(0.5, 0.02) is None


def test_another_size_is_shown_at_once_and_exact_when_a_frame_is_finished(gl_device: Device, sliced: Window) -> None:
    sliced.renderer.settings.reprojection.refine = False
    sliced.rest()
    with OnScreen(gl_device, sliced.renderer.scene, sliced.renderer.assets._library, (80, 60)) as small:
        camera = Camera((0, 1.2, 4.0), (0, 0.6, 0.0), 0.8)

        def pixels() -> NDArray[np.int64]:
            sliced.frames.note(camera, 0.02, (80, 60))
            sliced.frames.draw(View(camera, (80, 60)), small.screen)
            sliced.frames.work()
            return np.frombuffer(small.screen.read(components=3), np.uint8).astype(int)

        first = pixels()
        while not sliced.frames.is_current:
            last = pixels()
        small.draw(View(camera, (80, 60)))
        whole = np.frombuffer(small.screen.read(components=3), np.uint8).astype(int)
    assert np.abs(first - whole).mean() < 4
    assert np.abs(last - whole).mean() < 0.5


@pytest.mark.parametrize("mode", ["on", "off"])
def test_at_rest_the_picture_is_refined_until_something_moves(gl_device: Device, mode: Literal["on", "off"]) -> None:
    with Window(gl_device, mode) as window:
        window.renderer.settings.reprojection.refine = False
        window.rest()
        plain = window.pixels()
        window.renderer.settings.reprojection.refine = True
        assert window.rest() > 0
        refined = window.pixels()
        assert (np.abs(refined - plain).max(-1) > 8).mean() > 0.005  # along edges
        window.round()
        assert np.array_equal(window.pixels(), refined) and window.frames.is_current
        window.round(0.02)
        assert not window.frames.is_current
        window.rest()
        assert np.array_equal(window.pixels(), refined)


def test_false_colours_at_rest_are_those_of_frames_which_are_not_refined(sliced: Window) -> None:
    """The refined picture has impostors of its own, warped for it alone, at other levels."""
    settings = sliced.renderer.settings
    settings.inspection.show = "level"
    sliced.rest()
    shown = sliced.pixels()
    settings.reprojection.refine = False
    sliced.round(0.2)
    sliced.rest()
    assert (np.abs(sliced.pixels() - shown).max(-1) > 8).mean() < 0.001


def test_a_picture_that_is_being_refined_is_given_up_when_the_viewer_moves(sliced: Window) -> None:
    sliced.renderer.settings.reprojection.slice = 1
    sliced.rest()
    for step in range(1, 6):
        while not sliced.frames.is_drawing or not sliced.frames._still.is_drawing:
            sliced.round(0.1 * step)
        sliced.round(0.1 * step)
        assert not sliced.frames.is_current
    sliced.rest()
    assert sliced.frames.point_at(0.5, 0.9) is not None


@pytest.mark.parametrize("mode", ["off", "on"])
def test_an_object_that_a_program_moves_ends_the_rest(gl_device: Device, mode: Literal["off", "on"]) -> None:
    with Window(gl_device, mode) as window:
        window.rest()
        before, world = window.pixels(), window.renderer.world
        window.round()
        assert window.frames.is_current
        window.renderer.scene.objects.position[0, 1] += 0.5
        world.moved(slice(0, 1))
        window.round()
        window.rest()
        assert (window.pixels() != before).any()


@pytest.mark.parametrize("mode", ["on", "off"])
def test_the_last_picture_can_be_shown_again(gl_device: Device, mode: Literal["on", "off"]) -> None:
    """As a backdrop, while another scene is loaded; the still picture is finer."""
    with Window(gl_device, mode) as window:
        before = window.pixels()
        window.frames.show_again(window.screen)
        np.testing.assert_array_equal(window.pixels(), before)  # of nothing, nothing
        window.rest()
        last = window.pixels().astype(int)
        window.screen.clear()
        window.frames.finish()
        window.frames.show_again(window.screen)
        assert np.abs(window.pixels() - last).mean() < 3 < last.std()
