from collections.abc import Callable
from typing import Literal

import numpy as np
import pytest
from imgui_bundle import imgui
from imgui_bundle._imgui_bundle.imgui import IO

from depthwalk.params import Params, param
from depthwalk.scene.environment import FogParams, SkyParams, SunParams
from depthwalk.scene.render_settings import PictureParams, RenderSettings
from depthwalk.walk.fields import LABEL_WIDTH, Control, controls_of, draw_group, draw_slider, draw_tooltip


class Sample(Params):
    on: bool = param(True, "A switch")
    radius: float = param(0.5, "How far", unit="m", ge=0.1, le=4)
    count: int = param(3, "How many", ge=1, le=8)
    method: Literal["fast", "good"] = param("good", "Which way")
    focus: float | None = param(None, "Where it is sharp; none: in the middle", unit="m", ge=0.1, le=100)
    free: float = param(1.0, "Without a range")


def control(name: str) -> Control:
    return next(each for each in controls_of(Sample) if each.name == name)


@pytest.mark.parametrize(
    ("name", "kind", "low", "high", "optional"),
    [
        ("on", "switch", None, None, False),
        ("radius", "number", 0.1, 4, False),
        ("count", "integer", 1, 8, False),
        ("method", "choice", None, None, False),
        ("focus", "number", 0.1, 100, True),
        ("free", "number", None, None, False),
    ],
)
def test_a_declaration_decides_the_widget(
    name: str, kind: str, low: float | None, high: int | None, optional: bool
) -> None:
    found = control(name)
    assert (found.kind, found.low, found.high, found.optional) == (kind, low, high, optional)


def test_units_choices_defaults_and_help_come_along() -> None:
    assert control("method").choices == ("fast", "good")
    assert control("radius").unit == "m" and control("radius").default == 0.5
    assert control("radius").tooltip.startswith("How far.\n0.1 to 4 m")


def test_colours_and_vectors_have_widgets() -> None:
    kinds = {each.name: each.kind for each in controls_of(SunParams)}
    assert kinds == {"direction": "vector", "colour": "colour", "intensity": "number"}


def test_every_render_setting_can_be_changed_in_the_panel() -> None:
    groups = [(name, group) for name, group in RenderSettings() if isinstance(group, Params)]
    assert len(groups) > 4
    for name, group in [*groups, ("picture", PictureParams())]:
        for each in controls_of(type(group)):
            assert each.kind != "other", f"{name}.{each.name}"
            assert len(each.help) > 5


def every_control() -> list[Control]:
    """The controls of all groups that the panel shows."""
    groups = [type(group) for _, group in RenderSettings() if isinstance(group, Params)]
    return [each for group in (PictureParams, SkyParams, FogParams, *groups) for each in controls_of(group)]


def test_no_label_is_cut_off(overlay_io: IO) -> None:
    overlay_io.display_size = imgui.ImVec2(800, 600)
    room = LABEL_WIDTH - imgui.get_style().item_inner_spacing.x
    imgui.new_frame()
    widths = {each.label: imgui.calc_text_size(each.label).x for each in every_control() if each.kind != "switch"}
    imgui.render()
    assert len(widths) > 50 and not {label: width for label, width in widths.items() if width > room}


@pytest.mark.parametrize("size", [(1024, 768), (400, 300)])
def test_the_longest_help_under_the_mouse_fits_the_window(overlay_io: IO, size: tuple[int, int]) -> None:
    overlay_io.display_size = imgui.ImVec2(*size)
    longest = max((each.tooltip for each in every_control()), key=len)
    assert len(longest) > 300
    for _ in range(3):  # measured in one frame, placed in the next
        imgui.new_frame()
        overlay_io.mouse_pos = imgui.ImVec2(size[0] - 20, 100)
        draw_tooltip(longest)
        box = imgui.internal.find_window_by_name("##Tooltip_00")
        imgui.render()
    assert box.pos.x >= 0 and box.pos.x + box.size.x <= size[0]
    assert box.pos.y >= 0 and box.pos.y + box.size.y <= size[1]


class Rounded(Params):
    error: float = param(0.05, "Rounded to float32, its least is smaller and its most larger", ge=0.01, le=0.1)


class Mouse:
    """Moves and clicks on one widget of a window, frame by frame."""

    def __init__(self, io: IO, widget: Callable[[], None]) -> None:
        self.io, self.widget, self.middle = io, widget, 0.0
        io.display_size = imgui.ImVec2(400, 100)

    def at(self, x: float, held: bool) -> None:
        for _ in range(2):  # imgui takes a click only where it has seen the mouse
            self.io.add_mouse_pos_event(x, self.middle)
            self.io.add_mouse_button_event(0, held)
            self.draw()

    def type(self, text: str) -> None:
        self.io.add_key_event(imgui.Key.mod_ctrl, True)
        for held in (False, True, False):
            self.at(100, held)
        self.io.add_key_event(imgui.Key.mod_ctrl, False)
        self.io.add_input_characters_utf8(text)
        for pressed in (True, False):
            self.draw()
            self.io.add_key_event(imgui.Key.enter, pressed)
        self.draw()

    def draw(self) -> None:
        imgui.new_frame()
        imgui.set_next_window_pos((0, 0))
        imgui.set_next_window_size((400, 100))
        imgui.begin("widget")
        imgui.push_item_width(200)
        self.widget()
        self.middle = (imgui.get_item_rect_min().y + imgui.get_item_rect_max().y) / 2
        imgui.end()
        imgui.render()


@pytest.mark.parametrize(("x", "end"), [(0, 0.01), (390, 0.1)])
def test_the_ends_of_a_slider_are_not_refused(overlay_io: IO, x: float, end: float) -> None:
    assert float(np.float32(0.01)) < 0.01 and float(np.float32(0.1)) > 0.1
    group, refusals = Rounded(), set()
    mouse = Mouse(overlay_io, lambda: refusals.add(draw_group(group)))
    for place, held in ((100, False), (100, True), (x, True)):
        mouse.at(place, held)
    assert group.error == end and refusals == {""}


@pytest.mark.parametrize(("text", "expected"), [("nan", 0.5), ("1e99", 0.5), ("-inf", 0.5), ("7", 7)])
def test_what_is_no_number_is_not_taken_where_a_value_is_typed(overlay_io: IO, text: str, expected: float) -> None:
    values = [0.5]

    def slider() -> None:
        changed, value = draw_slider("slider", values[-1], 0.0, 1.0, "%.3g")
        values.extend([value] * changed)

    Mouse(overlay_io, slider).type(text)
    assert values[-1] == expected
