"""Draw the panel: representation, mode, lens, path, environment, then a section per group of the render settings."""

import math

from pyglm import glm

from depthwalk.geometry.vectors import components
from depthwalk.params import Params
from depthwalk.scene.arrays import Representation
from depthwalk.scene.environment import AmbientParams, SkyParams, SunParams
from depthwalk.scene.render_settings import PictureParams
from depthwalk.scene.saved_values import count_text
from depthwalk.scene.yaml_text import block_lines
from depthwalk.walk.controls import SPEED_RANGE
from depthwalk.walk.fields import LABEL_WIDTH, draw_group, draw_slider, draw_tooltip
from depthwalk.walk.files import SavedTo
from depthwalk.walk.native_imgui import imgui
from depthwalk.walk.playback import Playback
from depthwalk.walk.state import Keeping, State, representation_name
from depthwalk.walk.viewer import Mode

_WIDTH = 340.0
_NARROWEST = 220.0  # width in windows too narrow for that
_MARGIN = 10.0
_CHOICES: tuple[Representation | None, ...] = (None, *Representation)
_MODES = tuple(Mode)
_OPEN = ("shadows", "output")  # groups that a user is likely to look for first; all open would fill several windows
_FOV_RANGE = 10.0, 120.0  # degrees, the ends of the slider; Ctrl+click allows what cameras of scene files allow
_SUN_MAX = 5.0  # the end of the slider; Ctrl+click allows more
_DIRECTION_DIGITS = 6  # of the sun's, decimal places: 0.002 degrees of azimuth where it is highest
_SAVE: dict[SavedTo, str] = {"file": "Save", "new file": "Save copy"}
_KEEPING = {
    Keeping.COPY: "Copy them to the clipboard, as lines for a scene file",
    Keeping.SAVE: "Write them into the scene file (Ctrl+S)",
    Keeping.UNDO: "Return to the values of the scene file",
}
_MOST_LINES = 24  # of changed values that a tooltip shows

Area = tuple[float, float, float, float]  # left, top, right, bottom, widget coordinates


def draw_panel(state: State, left: float) -> Area:
    """Draw the panel of the walk `state` at the window's right edge, and apply the user's changes to the walk.

    If it overlaps the HUD, whose right end is `left`, it is opaque, so that texts do not shine through. Returns the
    rectangle that the panel covers: left, top, right, bottom, widget coordinates.
    """
    display = imgui.get_io().display_size
    width = max(min(_WIDTH, display.x - 2 * _MARGIN), _NARROWEST)
    if display.x - width - _MARGIN < left:
        imgui.set_next_window_bg_alpha(1.0)
    imgui.set_next_window_pos((display.x - width - _MARGIN, _MARGIN), imgui.Cond_.always)
    imgui.set_next_window_size_constraints((width, 0), (width, max(display.y - 2 * _MARGIN, 60)))
    flags = imgui.WindowFlags_.no_move | imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_nav
    imgui.begin("Settings \u2013 Tab closes###Settings", None, flags)
    imgui.push_item_width(-LABEL_WIDTH)
    _draw_changes(state, narrow=width < _WIDTH)
    _draw_view(state)
    if state.playback is not None and imgui.collapsing_header("camera path", imgui.TreeNodeFlags_.default_open):
        _draw_path(state, state.playback)
    if imgui.collapsing_header("environment", imgui.TreeNodeFlags_.default_open):
        _draw_environment(state)
    settings = state.renderer.settings
    if imgui.collapsing_header("picture", imgui.TreeNodeFlags_.default_open):
        draw_group(settings, PictureParams)
    for name, group in sorted(settings, key=lambda item: item[0] not in _OPEN):
        opens = imgui.TreeNodeFlags_.default_open if name in _OPEN else imgui.TreeNodeFlags_.none
        if isinstance(group, Params) and imgui.collapsing_header(name.replace("_", " "), opens):
            imgui.push_id(name)
            refusal = draw_group(group)
            imgui.pop_id()
            if refusal:
                state.tell(refusal)
    imgui.pop_item_width()
    return _end()


def draw_atlas(picture: imgui.ImTextureRef, aspect: float, left: float) -> Area:
    """Draw the atlas of impostors at the bottom of the window.

    Parameters
    ----------
    picture
        The texture of the atlas, as `ImguiRenderer.show` returns it.
    aspect
        Width / height of the atlas.
    left
        The right end of the HUD, widget coordinates.

    Returns
    -------
    Area
        The rectangle that the picture covers: left, top, right, bottom, widget coordinates.
    """
    display = imgui.get_io().display_size
    width = max(160.0, min(600.0, display.x - left - _WIDTH - 6 * _MARGIN))
    height = max(40.0, min(width / aspect, display.y * 0.3))
    imgui.set_next_window_pos((left + _MARGIN, display.y - _MARGIN), imgui.Cond_.always, (0, 1))
    flags = imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_nav
    imgui.begin("Impostor atlas", None, flags | imgui.WindowFlags_.no_collapse)
    imgui.image(picture, (height * aspect, height))
    return _end()


def _end() -> Area:
    left_top, size = imgui.get_window_pos(), imgui.get_window_size()
    imgui.end()
    return left_top.x, left_top.y, left_top.x + size.x, left_top.y + size.y


def _draw_changes(state: State, narrow: bool) -> None:
    """Draw how many values differ from the scene file's, with buttons that keep or undo them.

    While there are none the row stays, since whatever is under the mouse would move when the first value changes. In a
    `narrow` panel the buttons have a row of their own.
    """
    changed = state.changed
    imgui.align_text_to_frame_padding()
    if not changed:
        imgui.text_disabled("Nothing changed")
        if narrow:
            imgui.dummy((0, imgui.get_frame_height()))
        return
    imgui.text(f"{count_text(changed)} changed")
    if imgui.is_item_hovered():
        lines = block_lines(changed)
        draw_tooltip("\n".join([*lines[:_MOST_LINES], *["\u2026"] * (len(lines) > _MOST_LINES)]))
    for keeping, tooltip in _KEEPING.items():
        label = _SAVE.get(state.saved_to) if keeping is Keeping.SAVE else keeping.value.capitalize()
        if label is None:
            continue
        if not narrow or keeping is not Keeping.COPY:
            imgui.same_line()
        if imgui.button(label):
            state.asked = keeping
        if imgui.is_item_hovered(imgui.HoveredFlags_.delay_normal):
            draw_tooltip(tooltip)


def _draw_view(state: State) -> None:
    current = _CHOICES.index(state.renderer.world.representation)
    names = [representation_name(choice) for choice in _CHOICES]
    changed, index = imgui.combo("representation", current, names)
    if changed:
        state.represent(_CHOICES[index])
    _, state.atlas = imgui.checkbox("show impostor atlas", state.atlas)
    walker = state.walker
    changed, index = imgui.combo("mode", _MODES.index(state.mode), [mode.value for mode in _MODES])
    if changed:
        state.set_mode(_MODES[index])
    flags = imgui.SliderFlags_.logarithmic | imgui.SliderFlags_.always_clamp
    changed, speed = draw_slider("speed", walker.speed, *SPEED_RANGE, "%.3g m/s", flags)
    if changed:
        state.set_speed(speed)
    changed, fov = draw_slider("field of view", math.degrees(state.camera.fov), *_FOV_RANGE, "%.0f\u00b0")
    if changed:
        state.set_fov(math.radians(fov))
    draw_group(state.scene.walk, only=("collide",))


def _draw_path(state: State, playback: Playback) -> None:
    if imgui.button("Stop" if playback.playing else "Play", (90, 0)):
        state.toggle_path()
    imgui.same_line()
    _, playback.loop = imgui.checkbox("loop", playback.loop)
    moved, seconds = draw_slider("time", playback.time, 0.0, playback.duration, "%.2f s")
    if moved:
        state.seek(min(max(seconds, 0.0), playback.duration))


def _draw_intensity(label: str, light: SunParams | AmbientParams) -> None:
    changed, intensity = draw_slider(label, light.intensity, 0.0, _SUN_MAX, "%.2f")
    if changed:
        light.intensity = min(max(intensity, 0.0), 100.0)


def _draw_environment(state: State) -> None:
    """Draw the sun's controls, by its position instead of its light's direction; sky and fog if the scene has them.

    Light that the sky gives instead cannot be changed.
    """
    environment = state.scene.environment
    sun, ambient, sky = environment.sun, environment.ambient, environment.sky
    imgui.begin_disabled(sky is not None and sky.is_sun)
    elevation, azimuth, _ = glm.degrees(glm.polar(-glm.dvec3(*sun.direction)))
    turned, azimuth = draw_slider("sun azimuth", azimuth, -180, 180, "%.0f\u00b0")
    raised, elevation = draw_slider("sun elevation", elevation, -89, 89, "%.0f\u00b0")
    if turned or raised:
        direction = components(-glm.euclidean(glm.radians(glm.dvec2(elevation, azimuth))))
        x, y, z = (round(part, _DIRECTION_DIGITS) for part in direction)
        sun.direction = x, y, z
    _draw_intensity("sun intensity", sun)
    imgui.end_disabled()
    imgui.begin_disabled(sky is not None and sky.light)
    _draw_intensity("ambient intensity", ambient)
    imgui.end_disabled()
    if sky is None:
        draw_group(environment, only=("background",))
    for name, part in (("sky", sky), ("fog", environment.fog)):
        if part is not None and imgui.tree_node(name):
            refusal = draw_group(part, only=part.used_keys if isinstance(part, SkyParams) else ())
            imgui.tree_pop()
            if refusal:
                state.tell(refusal)
