"""Draw the head-up display (HUD), the help, short messages and the loading progress over the picture."""

import textwrap
from collections.abc import Sequence

from depthwalk.assets.progress import Progress
from depthwalk.walk.hud_rows import CAMERA_ROWS, count_rows, pass_rows, viewer_rows
from depthwalk.walk.hud_widgets import (
    BRIGHT,
    CLOSE_ROWS,
    DIM,
    LABELS,
    MARGIN,
    OPAQUE,
    OVERLAY,
    begin_overlay,
    draw_table,
    table_width,
)
from depthwalk.walk.native_imgui import imgui
from depthwalk.walk.panel import Area
from depthwalk.walk.state import State

_WIDTH = 255.0
_PASSES = 122.0  # width of the column of names of passes, which holds `material_resolve`
_ROOM = 2.5  # widths of the HUD; a narrower window has room for its first lines only
_TINY = 460.0, 330.0  # (width, height) of windows in which these lines, too, would cover the objects
_SLOWER = 1.3  # ratio of frame time to picture time from which frames count as drawn in slices
_FITTED = imgui.WindowFlags_.always_auto_resize
_NARROWEST_TOAST = 300.0
_CHARACTER = 8.0  # mean width of a character of a message
_STOP = "B stops"
HELP = (
    ("W A S D", "move, as do the arrow keys"),
    ("E / Q", "up / down"),
    ("Shift", "move faster"),
    ("Right drag", "look around"),
    ("Click or C", "capture the mouse; Esc releases it"),
    ("Wheel", "speed; in orbit: nearer / farther"),
    ("G / O", "walk / orbit about a target; again: fly"),
    ("Drag", "in orbit: turn; Shift or middle button: pan"),
    ("Double click", "in orbit: make this point the target"),
    ("T / I", "orbit about / inspect what is under the mouse"),
    ("F / Home", "see all objects / return to the first camera"),
    ("4 5 6", "see all from front, right, above; again: opposite"),
    ("N", "turntable: about the target; walking: look around"),
    ("V", "copy the camera, as a line for the scene file"),
    ("U", "turn a model: y or z points upward"),
    ("P / K", "play / record a camera path; again: stop, save"),
    ("Space", "stop what is animated / let it go on"),
    ("L", "focus on the window's centre (depth of field)"),
    ("R", "reload the scene file; keep the view"),
    ("Gamepad", "sticks move and look, triggers up / down"),
    ("Drop files", "open a scene, meshes or a camera path"),
    ("1 2 3", "draw as the scene says / depth images / mesh"),
    ("X", "false colours: how objects are drawn; again: next"),
    ("Tab / Ctrl+S", "settings panel / save what it changed"),
    ("B", "stop baking depth images"),
    ("Z / H", "HUD / this help"),
    ("F11 / F12", "full screen / screenshot"),
    ("Esc", "close help, panel, window"),
)


def draw_hud(state: State) -> float:
    """Draw the HUD of the walk `state` at the window's left edge, and return its right end, widget coordinates.

    It shows frame times, what was drawn, and the viewer's position. In a narrow window, where all this would cover the
    objects, it shows only the frame times, and what is being played or recorded; in a tiny one, a single line.
    """
    if any(extent < least for extent, least in zip(imgui.get_io().display_size, _TINY, strict=True)):
        return _draw_line(state)
    display, padding = imgui.get_io().display_size, imgui.get_style().window_padding
    viewer, passes, counts = viewer_rows(state), pass_rows(state.renderer.timers.milliseconds), _counted(state)
    width = max(_WIDTH, table_width(viewer), table_width(counts)) + 2 * padding.x
    narrow = display.x < _ROOM * width
    # imgui would size the window for the previous frame's content, and cut off new rows
    imgui.set_next_window_size((width, max(display.y - 2 * MARGIN, 1)))
    begin_overlay("hud", (MARGIN, MARGIN), (0, 0), flags=OVERLAY & ~_FITTED | imgui.WindowFlags_.no_background)
    imgui.text_colored(DIM, "H help   Tab panel   Z hides this")
    _draw_rate(state, curve=not narrow)
    imgui.push_style_var(imgui.StyleVar_.cell_padding, CLOSE_ROWS)
    if narrow:
        draw_table("viewer", [row for row in viewer if row[0] in CAMERA_ROWS])
    else:
        _draw_viewer(state, viewer)
        if passes:  # not in the first picture
            imgui.separator()
        _draw_passes(state, passes)  # last, since a low window may have no room for it
        _draw_counts(counts)
    imgui.pop_style_var()
    bottom = imgui.get_cursor_screen_pos().y - imgui.get_style().item_spacing.y + padding.y
    imgui.end()
    _draw_panel((MARGIN, MARGIN), (MARGIN + width, bottom))
    return MARGIN + width


def _draw_line(state: State) -> float:
    """Draw the HUD of a tiny window, and return its right end, widget coordinates."""
    rate = f"{1 / state.times.smoothed:.1f} FPS" if state.times.smoothed else "FPS"
    rows = [f"{name} {value}" for name, value in viewer_rows(state) if name in CAMERA_ROWS]
    begin_overlay("hud line", (0, 0), (0, 0))
    imgui.text_colored(BRIGHT, rate)
    imgui.same_line()
    imgui.text_colored(DIM, "   ".join([*rows, "H help", "Z hides this"]))
    right = imgui.get_window_pos().x + imgui.get_window_size().x
    imgui.end()
    return right


def draw_crosshair() -> None:
    """Mark the centre of the window, on which the key L focuses."""
    display = imgui.get_io().display_size
    x, y = display.x / 2, display.y / 2
    canvas, colour = imgui.get_background_draw_list(), imgui.get_color_u32((1.0, 1.0, 1.0, 0.6))
    canvas.add_line((x - 7, y), (x + 7, y), colour)
    canvas.add_line((x, y - 7), (x, y + 7), colour)


def draw_help(left: float, right: float) -> Area | None:
    """Draw the list of keys centred between HUD and panel; if there is no room, before both.

    In a window that is too low for it the wheel scrolls it.

    Parameters
    ----------
    left
        The right end of the HUD, widget coordinates.
    right
        The left end of the panel, widget coordinates.

    Returns
    -------
    Area or None
        The rectangle in which the wheel scrolls: left, top, right, bottom, widget coordinates; None if it need not.
    """
    display, padding = imgui.get_io().display_size, imgui.get_style().window_padding.x
    height = len(HELP) * (imgui.get_text_line_height() + 2 * CLOSE_ROWS.y) + 2 * imgui.get_style().window_padding.y
    scrolls = height > display.y
    bar = imgui.get_style().scrollbar_size if scrolls else 0.0
    half = (LABELS + 8 + max(imgui.calc_text_size(text).x for _, text in HELP) + bar) / 2 + padding
    fits = right - left > 2 * half
    middle = (left + right) / 2 if fits else max(half, right - half)  # over the HUD if there is no room, then opaque
    imgui.push_style_var(imgui.StyleVar_.cell_padding, CLOSE_ROWS)
    flags = OVERLAY
    if scrolls:
        imgui.set_next_window_size((min(2 * half, display.x), display.y))
        flags = OVERLAY & ~(_FITTED | imgui.WindowFlags_.no_scrollbar | imgui.WindowFlags_.no_inputs)
    # Placed by its left end, where the keys are: imgui makes it no wider than the window.
    begin_overlay("help", (middle - half, display.y / 2), (0.0, 0.5), alpha=0.92 if fits else 1.0, flags=flags)
    draw_table("help", HELP)
    place, size = imgui.get_window_pos(), imgui.get_window_size()
    if not fits:
        imgui.internal.bring_window_to_display_front(imgui.internal.get_current_window())
    imgui.end()
    imgui.pop_style_var()
    return (place.x, place.y, place.x + size.x, place.y + size.y) if scrolls else None


def draw_toast(message: str, floor: float, left: float, right: float) -> None:
    """Draw a message near the bottom of the window.

    Parameters
    ----------
    message
        The text.
    floor
        Window coordinate above which the message stays.
    left, right
        The right end of the HUD and the left end of the panel, widget coordinates. The message stays between them, or
        lies over both if the space is too narrow.
    """
    if right - left < _NARROWEST_TOAST:
        left, right = 0.0, imgui.get_io().display_size.x
    text = message_lines(message, right - left - 4 * MARGIN)
    size = imgui.calc_text_size(text)
    left, top = (left + right - size.x) / 2, floor - size.y - 2 * MARGIN
    canvas = imgui.get_foreground_draw_list()
    box = (left - MARGIN, top - MARGIN), (left + size.x + MARGIN, top + size.y + MARGIN)
    canvas.add_rect_filled(*box, imgui.get_color_u32((0.14, 0.16, 0.20, 0.95)), 6.0)
    canvas.add_text((left, top), imgui.get_color_u32(BRIGHT), text)


def message_lines(message: str, width: float) -> str:
    """Return a message with line breaks, so that it is about `width` wide, widget coordinates, and names stay whole."""
    characters = max(20, int(width / _CHARACTER))
    return "\n".join(textwrap.fill(line, characters, break_on_hyphens=False) for line in message.splitlines())


def draw_background(progress: Progress, right: float) -> float:
    """Draw a bar along the window's lower edge: the `progress` of assets that are baked in the background.

    Parameters
    ----------
    progress
        Progress of the baking.
    right
        The left end of the panel, widget coordinates.

    Returns
    -------
    float
        The upper end of the bar, widget coordinates.
    """
    display = imgui.get_io().display_size
    imgui.set_next_window_size((min(520, right - 2 * MARGIN), 0))
    begin_overlay("background", (right / 2, display.y - MARGIN), (0.5, 1.0))
    imgui.progress_bar(progress.fraction, (-1, 0), background_text(progress))
    imgui.text_colored(DIM, f"{progress.name}: {progress.stage}" if progress.name else "starting")
    imgui.same_line(imgui.get_window_size().x - imgui.calc_text_size(_STOP).x - MARGIN)
    imgui.text_colored(DIM, _STOP)
    top = imgui.get_window_pos().y
    imgui.end()
    return top


def background_text(progress: Progress) -> str:
    """Return the text on the bar of `draw_background`: the progress, and the time left."""
    seconds = progress.seconds_left
    left = "" if seconds is None else f", {max(round(seconds), 1)} s left"
    return f"depth images: {progress.done} of {progress.total}{left}"


def draw_backdrop(picture: imgui.ImTextureRef) -> None:
    """Draw a picture, row 0 at the bottom, behind all widgets and as large as the window."""
    size = imgui.get_io().display_size
    imgui.get_background_draw_list().add_image(picture, (0, 0), (size.x, size.y), (0, 1), (1, 0))


def draw_progress(title: str, lines: list[str]) -> None:
    """Draw the progress of loading in the middle of the window.

    `title` is shown above `lines`, one for each step of loading; the last one is in progress and bright.
    """
    display = imgui.get_io().display_size
    imgui.set_next_window_size((min(460, display.x), 0))
    begin_overlay("progress", (display.x / 2, display.y / 2), (0.5, 0.5))
    imgui.text(title)
    imgui.separator()
    for line in lines[:-1]:
        imgui.text_colored(DIM, line)
    for line in lines[-1:]:
        imgui.text_colored(BRIGHT, line)
    imgui.end()


def _draw_rate(state: State, curve: bool) -> None:
    seconds = state.times.smoothed
    if seconds:
        imgui.text_colored(BRIGHT, f"{1 / seconds:5.1f} FPS")
        imgui.same_line()
        imgui.text(f"{seconds * 1e3:6.1f} ms")
        imgui.same_line()
        imgui.text_colored(DIM, f"max {state.times.milliseconds.max():.0f} ms")
    if (scene := state.scene_times.smoothed) > _SLOWER * seconds > 0:
        pixels = f" at {100 * state.scene_scale:.0f} %" if state.scene_scale < 1 else ""
        _dim_wrapped(f"scene {1 / scene:.1f} FPS, {scene * 1e3:.0f} ms{pixels}")
    times = state.times.milliseconds
    if curve and len(times) > 1:
        imgui.plot_lines("##frames", times, 0, None, 0.0, float(times.max()) * 1.15, (_WIDTH, 40))


def _dim_wrapped(text: str) -> None:
    imgui.push_text_wrap_pos(_WIDTH)
    imgui.text_colored(DIM, text)
    imgui.pop_text_wrap_pos()


def _draw_panel(upper_left: tuple[float, float], lower_right: tuple[float, float]) -> None:
    """Draw a background behind an imgui window that has none of its own."""
    style = imgui.get_style()
    colour = style.color_(imgui.Col_.window_bg)
    filled = imgui.get_color_u32((colour.x, colour.y, colour.z, OPAQUE))
    imgui.get_background_draw_list().add_rect_filled(upper_left, lower_right, filled, style.window_rounding)


def _draw_passes(state: State, rows: Sequence[tuple[str, str]]) -> None:
    if rows := _rows_with_room(rows, 1):
        imgui.text_colored(DIM, "ms per pass" + (" (GPU timers)" if state.renderer.timers.kind == "gpu" else ""))
        draw_table("passes", rows, right=True, labels=_PASSES)


def _counted(state: State) -> list[tuple[str, str]]:
    plan = state.renderer.plan
    return [] if plan is None else count_rows(plan.counts | state.shares.latest)


def _draw_counts(rows: Sequence[tuple[str, str]]) -> None:
    if rows := _rows_with_room(rows, 0):
        imgui.separator()
        draw_table("counts", rows)


def _rows_with_room(rows: Sequence[tuple[str, str]], above: int) -> list[tuple[str, str]]:
    """Return as many of the first `rows` of a table, drawn below `above` lines, as fit within the window."""
    line = imgui.get_text_line_height() + 2 * CLOSE_ROWS.y
    end = imgui.get_window_pos().y + imgui.get_cursor_pos_y() + above * imgui.get_text_line_height_with_spacing()
    bottom = imgui.get_io().display_size.y - MARGIN - imgui.get_style().window_padding.y - 2 * CLOSE_ROWS.y
    fitting = []
    for name, text in rows:
        end += line * (1 + max(name.count("\n"), text.count("\n")))
        if end > bottom:
            break
        fitting.append((name, text))
    return fitting


def _draw_viewer(state: State, rows: Sequence[tuple[str, str]]) -> None:
    imgui.separator()
    _dim_wrapped(state.renderer.device.renderer)
    draw_table("viewer", rows)
