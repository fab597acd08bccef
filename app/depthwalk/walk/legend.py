"""Explain the false colours that `render.inspection.show` may ask for, at the upper edge of the window."""

from typing import get_args

from depthwalk.render.draw.object_colours import legend
from depthwalk.scene.effect_settings import HowDrawn, InspectionParams
from depthwalk.walk.hud_widgets import DIM, MARGIN, begin_overlay
from depthwalk.walk.native_imgui import imgui

_ORDER: tuple[HowDrawn, ...] = get_args(HowDrawn)
_TITLES: dict[HowDrawn, str] = {
    "representation": "How objects are drawn",
    "level": "Level of detail",
    "case": "Depth images that are warped",
    "error": "Error of impostors and meshes",
}
_SQUARE = 12.0
_NEXT = "X: next"


def next_shown(params: InspectionParams) -> None:
    """Let `params` show the next false colours; the lit picture follows the last ones."""
    at = 0 if params.how_drawn is None else _ORDER.index(params.how_drawn) + 1
    params.show = _ORDER[at] if at < len(_ORDER) else "picture"


def draw_legend(show: HowDrawn, left: float, right: float) -> None:
    """Draw what the colours of `show` mean, between `left` and `right`, widget coordinates."""
    begin_overlay("legend", ((left + right) / 2, MARGIN), (0.5, 0.0))
    padding, gap = imgui.get_style().window_padding.x, imgui.get_style().item_spacing.x
    widest = right - left - 2 * (MARGIN + padding)
    imgui.text(_TITLES[show])
    if imgui.calc_text_size(_TITLES[show]).x + gap + imgui.calc_text_size(_NEXT).x <= widest:
        imgui.same_line()
    imgui.text_colored(DIM, _NEXT)
    used = 0.0
    for text, colour in legend(show):
        width = _SQUARE + gap + imgui.calc_text_size(text).x
        if used and used + gap + width <= widest:
            imgui.same_line()
            used += gap + width
        else:
            used = width
        imgui.color_button(f"##{text}", (*colour, 1.0), imgui.ColorEditFlags_.no_tooltip, (_SQUARE, _SQUARE))
        imgui.same_line()
        imgui.text(text)
    imgui.end()
