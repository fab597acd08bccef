"""Texts of the HUD and of the help."""

from types import SimpleNamespace
from typing import Any

import pytest
from imgui_bundle import imgui
from imgui_bundle._imgui_bundle.imgui import IO

from depthwalk.assets.progress import Progress
from depthwalk.walk.hud import draw_background, draw_help, draw_hud, draw_toast, message_lines
from depthwalk.walk.hud_rows import count_rows, pass_rows
from depthwalk.walk.times import FrameTimes
from depthwalk.walk.viewer import Mode


def test_passes_that_do_next_to_nothing_share_a_row() -> None:
    times = {"warp": 30.0, "composite": 69.0, "fxaa": 0.01, "smaa": 0.02, "dof": 0.4, "light": 0.57}
    assert pass_rows(times) == [("warp", "30.00"), ("composite", "69.00"), ("light", "0.57"), ("others", "0.43")]


def test_passes_that_share_a_program_share_a_row_of_several_lines() -> None:
    ((names, _),) = pass_rows({"sun + light + fog + output": 20.0})
    assert names.replace("\n", " ") == "sun + light + fog + output"
    assert names.count("\n") + 1 > 1 and max(map(len, names.split("\n"))) <= 18
    assert pass_rows({"material_resolve": 20.0}) == [("material_resolve", "20.00")]


def test_none_is_left_out_where_all_do_something() -> None:
    assert pass_rows({"warp": 3.0, "light": 1.0}) == [("warp", "3.00"), ("light", "1.00")]
    assert pass_rows({}) == []


def test_counts_are_told_in_the_fields_words() -> None:
    counts = {
        "full_triangles": 886555518,
        "objects": 12345, "occluded": 300, "dpci": 40, "dmesh": 0, "mesh": 7, "warped": 3, "warped_triangles": 98765,
        "assets": 5, "gpu_mb": 1234.5, "atlas_used": 0.25, "tile_resolution": 1.0,
        "case_side": 9, "case_side_and_top": 30, "case_all": 1, "step_16": 1, "step_2": 39, "level_0": 4, "level_10": 2,
    }  # fmt: skip
    assert count_rows(counts) == [
        ("objects", "12,345"),
        ("made of", "886,555,518 triangles"),
        ("occluded", "300"),
        ("drawn as", "dpci 40, mesh 7"),
        ("case", "side 9, side + top 30\nall 1"),
        ("Iter_step", "2: 39, 16: 1"),
        ("LOD level", "0: 4, 10: 2"),
        ("warped", "3 of 40 impostors"),
        ("", "98,765 triangles"),
        ("tile cache", "25% full, scale 100%"),
        ("on the GPU", "5 assets, 1,234 MB"),
    ]


def test_rows_without_anything_to_tell_are_left_out() -> None:
    counts = dict.fromkeys(("objects", "full_triangles", "occluded", "dpci", "warped", "warped_triangles", "assets"), 0)
    rows = dict(count_rows(counts | {"gpu_mb": 0.0, "atlas_used": 0.0, "tile_resolution": 1.0}))
    assert rows["drawn as"] == "\u2013" and set(rows) == {"objects", "occluded", "drawn as", "on the GPU"}


@pytest.mark.parametrize(("width", "left"), [(640, 0.0), (640, 289.0), (1280, 289.0)])
def test_the_help_fits_a_small_window(overlay_io: IO, width: int, left: float) -> None:
    overlay_io.display_size = imgui.ImVec2(width, 480)
    for _ in range(3):  # measured in one frame, placed in the next
        imgui.new_frame()
        draw_help(left, width)
        imgui.render()
    window = imgui.internal.find_window_by_name("help")
    assert window.pos.x >= 0 and window.pos.x + window.size.x <= width
    assert window.pos.y >= 0 and window.pos.y + window.size.y <= 480
    over_the_hud = window.pos.x < left
    assert (window.draw_list.vtx_buffer[0].col >> 24 == 255) == over_the_hud  # or texts are read through each other


def test_the_help_begins_within_a_tiny_window(overlay_io: IO) -> None:
    overlay_io.display_size = imgui.ImVec2(200, 150)
    for _ in range(3):
        imgui.new_frame()
        draw_help(0.0, 200.0)
        imgui.render()
    window = imgui.internal.find_window_by_name("help")
    assert 0 <= window.pos.x < 10 and 0 <= window.pos.y < 10


@pytest.mark.parametrize(("width", "height"), [(428, 286), (640, 300), (640, 470)])
def test_in_a_low_window_the_wheel_scrolls_the_help(overlay_io: IO, width: int, height: int) -> None:
    overlay_io.display_size = imgui.ImVec2(width, height)
    area, ends = None, []
    for turn in (0, 0, 0, -30, 0, 0, 0):
        if area is not None:
            overlay_io.add_mouse_pos_event((area[0] + area[2]) / 2, (area[1] + area[3]) / 2)
        overlay_io.add_mouse_wheel_event(0, turn)
        imgui.new_frame()
        area = draw_help(0.0, width)
        imgui.render()
        window = imgui.internal.find_window_by_name("help")
        ends.append(window.scroll.y)
    assert area is not None and 0 <= area[0] < area[2] <= width and (area[1], area[3]) == (0, height)
    assert ends[2] == 0 < ends[-1] and ends[-1] == pytest.approx(window.scroll_max.y, abs=2)


def test_a_tiny_window_shows_one_line(overlay_io: IO) -> None:
    """With how to get the help, and what is being recorded."""
    overlay_io.display_size = imgui.ImVec2(428, 286)
    for _ in range(3):
        imgui.new_frame()
        right = draw_hud(slow_walk())
        imgui.render()
    window = imgui.internal.find_window_by_name("hud line")
    assert window.size.y < 0.15 * 286 and window.pos.x + window.size.x == right < 0.9 * 428


def slow_walk() -> Any:
    """What the HUD reads of a walk through a large scene on a slow machine, where every row has much to say."""
    times, scene_times = FrameTimes(), FrameTimes()
    for _ in range(120):
        times.add(0.2)
        scene_times.add(12.345)
    passes = ["upload", "plan", "warp", "composite", "mesh", "occlusion", "ground", "shadows", "material_resolve"]
    passes += ["sun + light + fog + output"]
    counts = dict.fromkeys(["objects", "occluded", "dpci", "mesh", "warped", "warped_triangles"], 12345)
    counts |= {f"case_{name}": 1234 for name in ("side", "side_and_top", "side_and_bottom", "all")}
    counts |= {f"step_{2**k}": 123 for k in range(6)} | {f"level_{k}": 123 for k in range(12)}
    counts |= {"full_triangles": 123456789012, "assets": 123, "gpu_mb": 1234, "atlas_used": 1, "tile_resolution": 1}
    return SimpleNamespace(
        times=times,
        scene_times=scene_times,
        scene_scale=0.75,
        renderer=SimpleNamespace(
            timers=SimpleNamespace(kind="cpu", milliseconds=dict.fromkeys(passes, 99.9)),
            plan=SimpleNamespace(counts=counts),
            device=SimpleNamespace(renderer="llvmpipe (LLVM 15.0.6, 256 bits)"),
        ),
        shares=SimpleNamespace(latest={"share_dpci": 0.5, "share_mesh": 0.5}),
        walker=SimpleNamespace(position=(-123.45, 12.34, 123.45), yaw=-3.0, pitch=-1.0, speed=3.0),
        playback=SimpleNamespace(playing=True, time=123.4),
        recorder=None,
        orbit=None,
        mode=Mode.FLY,
    )


@pytest.mark.parametrize(("width", "height"), [(800, 330), (800, 480), (800, 600)])
def test_a_low_window_cuts_off_no_row_of_the_hud(overlay_io: IO, width: int, height: int) -> None:
    """It leaves out the last, and fills the room that it has."""
    overlay_io.display_size = imgui.ImVec2(width, height)
    for _ in range(3):
        imgui.new_frame()
        draw_hud(slow_walk())
        box = hud_box()
        imgui.render()
    assert height - 70 < box[3] <= height


@pytest.mark.parametrize(("width", "height"), [(460, 330), (640, 330), (640, 480)])
def test_a_narrow_window_shows_the_scene_instead_of_figures(overlay_io: IO, width: int, height: int) -> None:
    overlay_io.display_size = imgui.ImVec2(width, height)
    bottoms = []
    for recorder in (None, SimpleNamespace(seconds=12.3)):
        walk = slow_walk()
        walk.playback, walk.recorder = None, recorder
        for _ in range(3):
            imgui.new_frame()
            draw_hud(walk)
            box = hud_box()
            imgui.render()
        bottoms.append(box[3])
    assert bottoms[0] < bottoms[1] < 120  # a recording is told


def test_the_hud_holds_new_rows_in_their_first_frame(overlay_io: IO) -> None:
    """At rest no other frame may follow: what it cut off then would stay cut off."""
    overlay_io.display_size = imgui.ImVec2(1024, 768)
    walk = slow_walk()
    walk.renderer.plan, walk.recorder = None, SimpleNamespace(seconds=12.3)
    long, boxes, drawn = slow_walk(), [], []
    for shown in (walk, walk, walk, long, long, long):
        imgui.new_frame()
        draw_hud(shown)
        boxes.append(hud_box())
        imgui.render()
        drawn.append(imgui.internal.find_window_by_name("hud").draw_list.vtx_buffer.size())
    assert boxes[1] == boxes[2] != boxes[3] == boxes[4] == boxes[5]
    assert drawn[1] == drawn[2] < drawn[3] == drawn[4] == drawn[5]


def test_the_hud_fits_the_default_window_and_leaves_most_of_it_free(overlay_io: IO) -> None:
    overlay_io.display_size = imgui.ImVec2(1024, 768)
    for _ in range(3):
        imgui.new_frame()
        right = draw_hud(slow_walk())
        box = hud_box()
        imgui.render()
    assert right <= 0.31 * 1024 and right == pytest.approx(box[2], abs=1) and box[3] <= 768


def test_bar_and_messages_keep_clear_of_the_panel_and_of_each_other(overlay_io: IO) -> None:
    overlay_io.display_size = imgui.ImVec2(1024, 768)
    progress = Progress(done=1, total=3, name="bust", stage="side", fraction=0.4, seconds_left=8.0)
    for _ in range(3):
        imgui.new_frame()
        top = draw_background(progress, 674)
        draw_toast("Saved picture.png", top, 289.0, 674.0)
        message = toast_box()
        imgui.render()
    bar = imgui.internal.find_window_by_name("background")
    assert bar.pos.x >= 0 and bar.pos.x + bar.size.x <= 674
    assert message[3] <= top == bar.pos.y


def test_names_of_files_are_not_cut_at_their_hyphens() -> None:
    message = "Saved /home/depthwalk-20261201-051020.yaml: 4 s in 2 keyframes\nTwo-sided"
    assert message_lines(message, 320.0).split("\n") == [
        "Saved", "/home/depthwalk-20261201-051020.yaml: 4", "s in 2 keyframes", "Two-sided",
    ]  # fmt: skip


def toast_box() -> tuple[float, float, float, float]:
    """Left, top, right and bottom of what the frame has drawn over everything."""
    return box_of(imgui.get_foreground_draw_list())


def hud_box() -> tuple[float, float, float, float]:
    """Left, top, right and bottom of what the frame has drawn behind everything."""
    return box_of(imgui.get_background_draw_list())


def box_of(drawn: Any) -> tuple[float, float, float, float]:
    vertices = drawn.vtx_buffer
    x, y = ([getattr(vertices[k].pos, axis) for k in range(vertices.size())] for axis in "xy")
    return min(x), min(y), max(x), max(y)


@pytest.mark.parametrize(("left", "right"), [(274.0, 800.0), (274.0, 640.0), (274.0, 450.0)])
def test_a_message_lies_between_hud_and_panel_where_there_is_room(overlay_io: IO, left: float, right: float) -> None:
    overlay_io.display_size = imgui.ImVec2(800, 600)
    imgui.new_frame()
    draw_toast("The file /home/somebody/scenes/garden.yaml has two mistakes\nof which each " * 3, 600, left, right)
    x0, y0, x1, y1 = toast_box()
    imgui.render()
    assert y0 > 0 and y1 <= 600 and x0 >= 0 and x1 <= 800
    assert (x0 >= left and x1 <= right) == (right - left > 300)


def test_the_help_lies_before_the_panel_where_there_is_no_room_for_both(overlay_io: IO) -> None:
    """However long the panel has been open, and whichever of them the user opened last."""
    overlay_io.display_size = imgui.ImVec2(640, 480)
    for helps, panel in ((False, True), (True, True), (True, False), (True, True)):
        for _ in range(3):
            imgui.new_frame()
            if panel:
                imgui.begin("Settings")
                imgui.end()
            if helps:
                draw_help(289.0, 290.0)
            imgui.render()
        if helps and panel:
            panel_index, help_index = (
                imgui.internal.find_window_display_index(imgui.internal.find_window_by_name(name))
                for name in ("Settings", "help")
            )
            assert help_index > panel_index


def test_the_help_keeps_clear_of_the_panel(overlay_io: IO) -> None:
    overlay_io.display_size = imgui.ImVec2(800, 600)
    for _ in range(3):
        imgui.new_frame()
        draw_help(289.0, 450.0)
        imgui.render()
    window = imgui.internal.find_window_by_name("help")
    assert window.pos.x >= 0 and window.pos.x + window.size.x <= 450
