"""Draw the tables and transparent boxes of which HUD, help and the card of an object are made."""

from collections.abc import Sequence

from depthwalk.walk.native_imgui import imgui

MARGIN = 10.0
LABELS = 84.0  # width of the column of names
NUMBERS = 48.0  # width of the column of right-aligned numbers
CLOSE_ROWS = imgui.ImVec2(4, 0.5)  # cell padding: the help fits a window of 480 lines, the HUD one of 768
OVERLAY = (
    imgui.WindowFlags_.no_decoration
    | imgui.WindowFlags_.no_inputs
    | imgui.WindowFlags_.always_auto_resize
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_focus_on_appearing
    | imgui.WindowFlags_.no_nav
)
OPAQUE = 0.82  # opacity of backgrounds drawn over pictures
DIM = (0.62, 0.67, 0.74, 1.0)
BRIGHT = (1.0, 0.86, 0.55, 1.0)


def begin_overlay(
    name: str,
    place: tuple[float, float],
    pivot: tuple[float, float],
    alpha: float = OPAQUE,
    flags: int = OVERLAY,
) -> None:
    """Begin an imgui window over the picture, which `imgui.end` ends.

    Parameters
    ----------
    name
        The name of the window.
    place
        Where its point `pivot` lies, window coordinates.
    pivot
        A point of the window: parts of its width and height from the upper left corner, 0 to 1.
    alpha
        Opacity of its background, 0 to 1.
    flags
        What the window can do; by default it only shows something.
    """
    imgui.set_next_window_pos(place, imgui.Cond_.always, pivot)
    imgui.set_next_window_bg_alpha(alpha)
    imgui.begin(name, None, flags)


def draw_table(name: str, rows: Sequence[tuple[str, str]], right: bool = False, labels: float = LABELS) -> None:
    """Draw names, `labels` pixels wide, and values; with `right`, these are numbers, right-aligned."""
    if imgui.begin_table(name, 2, imgui.TableFlags_.sizing_fixed_fit):
        imgui.table_setup_column("name", imgui.TableColumnFlags_.width_fixed, labels)
        # otherwise a column is as wide as the previous frame's content, and cuts off new texts
        values = NUMBERS + 8 if right else _widest(rows)
        imgui.table_setup_column("value", imgui.TableColumnFlags_.width_fixed, values)
        for label, value in rows:
            imgui.table_next_row()
            imgui.table_next_column()
            imgui.text_colored(DIM, label)
            imgui.table_next_column()
            if right:
                start = imgui.get_cursor_pos_x()
                imgui.set_cursor_pos_x(start + max(0.0, NUMBERS - imgui.calc_text_size(value).x))
            imgui.text(value)
        imgui.end_table()


def table_width(rows: Sequence[tuple[str, str]]) -> float:
    """Return the width of a table of names and values that are not numbers, pixels."""
    return LABELS + _widest(rows) + 4 * CLOSE_ROWS.x


def _widest(rows: Sequence[tuple[str, str]]) -> float:
    """Return the width of the widest of the values of a table, pixels."""
    return max((imgui.calc_text_size(value).x for _, value in rows), default=0.0)
