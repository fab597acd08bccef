"""The legend of false colours, and the key that goes through them."""

import pytest
from imgui_bundle import imgui
from imgui_bundle._imgui_bundle.imgui import IO

from depthwalk.render.draw.object_colours import legend
from depthwalk.scene.effect_settings import InspectionParams
from depthwalk.walk.legend import draw_legend, next_shown


def test_the_key_shows_each_false_colours_once_and_then_the_picture() -> None:
    params, shown = InspectionParams(), []
    for _ in range(5):
        next_shown(params)
        shown.append(params.show)
    assert shown == ["representation", "level", "case", "error", "picture"]


def test_from_normals_the_key_leads_to_the_first_false_colours() -> None:
    params = InspectionParams(show="normals")
    next_shown(params)
    assert params.show == "representation"


@pytest.mark.parametrize(("left", "right"), [(0.0, 320.0), (289.0, 510.0), (289.0, 1024.0)])
def test_the_legend_stays_where_there_is_room(overlay_io: IO, left: float, right: float) -> None:
    overlay_io.display_size = imgui.ImVec2(right, 480)
    for show in ("representation", "level", "case", "error"):
        for _ in range(3):
            imgui.new_frame()
            draw_legend(show, left, right)
            imgui.render()
        window = imgui.internal.find_window_by_name("legend")
        assert window.pos.x >= left and window.pos.x + window.size.x <= right
        assert window.pos.y >= 0 and window.size.y < 480 / 3
        colours = {vertex.col & 0xFFFFFF for vertex in window.draw_list.vtx_buffer}
        for _, colour in legend(show):
            assert imgui.get_color_u32((*colour, 1.0)) & 0xFFFFFF in colours
