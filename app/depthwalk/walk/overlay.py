"""Draw a frame of widgets over the screen: imgui's context, font and style.

Widgets are laid out in *widget coordinates*, from the window's upper left corner: pixels on a desktop of ordinary
density, and several pixels each on one that enlarges everything, so that texts are as large as those of other programs.
"""

from collections.abc import Callable

import moderngl

from depthwalk.gpu.device import Device
from depthwalk.walk.bundle import FOLDER
from depthwalk.walk.imgui_renderer import ImguiRenderer
from depthwalk.walk.native_imgui import imgui

_FONT = "assets/fonts/Roboto/Roboto-Regular.ttf"  # comes with imgui-bundle; has Greek and Cyrillic
_FONT_PIXELS = 16.0
_SMALLEST = 640, 480  # (width, height) in widget coordinates, in which help and panel fit
_READABLE = 0.7  # pixels to a unit of widget coordinates, at which texts can just be read


class Overlay:
    """Own an imgui context, and draw its widgets over pictures.

    Parameters
    ----------
    device
        The GPU that draws.
    density
        Returns by how much the desktop enlarges what it shows, which changes with the monitor that the window is on.

    Attributes
    ----------
    io
        The input and output settings of the context.
    renderer
        Draws the widgets' triangles.
    """

    def __init__(self, device: Device, density: Callable[[], float]) -> None:
        self._density = density
        self._imgui = imgui.create_context()
        self.io = imgui.get_io()
        self.io.set_ini_filename("")  # write no imgui.ini into the user's folder
        set_up_look(self.io)
        try:
            self.renderer = ImguiRenderer(device)
        except BaseException:  # imgui makes a new context current only if there is none
            imgui.destroy_context(self._imgui)
            raise

    def draw(
        self,
        screen: moderngl.Framebuffer,
        buffer_size: tuple[int, int],
        dt: float,
        widgets: Callable[[], None],
    ) -> None:
        """Draw a frame of widgets over a picture.

        Parameters
        ----------
        screen
            The framebuffer that is drawn over.
        buffer_size
            (width, height) of the window in pixels, above 0.
        dt
            Seconds since the last frame.
        widgets
            Calls imgui to describe the widgets. After an exception of it the overlay can only be released.
        """
        unit = pixels_per_unit(buffer_size, self._density())
        self.io.display_size = imgui.ImVec2(*(pixels / unit for pixels in buffer_size))
        self.io.display_framebuffer_scale = imgui.ImVec2(unit, unit)
        self.io.delta_time = max(dt, 1e-5)
        imgui.new_frame()
        widgets()  # if this raises, the overlay is released: imgui could only complain of what was begun and not ended
        imgui.render()
        self.renderer.draw(imgui.get_draw_data(), screen)

    def release(self) -> None:
        """Free the GL objects and destroy imgui's context."""
        try:
            self.renderer.release()
        finally:
            imgui.destroy_context(self._imgui)


def pixels_per_unit(buffer_size: tuple[int, int], density: float) -> float:
    """Return the number of pixels to a unit of widget coordinates: the desktop's `density` where the window is large.

    A window that has no room for the widgets at that size has smaller ones, as far as texts stay readable.

    Parameters
    ----------
    buffer_size
        (width, height) of the window in pixels.
    density
        By how much the desktop enlarges what it shows.
    """
    room = min(pixels / least for pixels, least in zip(buffer_size, _SMALLEST, strict=True))
    return max(min(density, room), min(max(room, _READABLE), 1.0))


def set_up_look(io: imgui.IO) -> None:
    """Set font, colours and spacing of the walk in imgui's current context, whose settings are `io`."""
    font = FOLDER / _FONT
    if font.is_file():
        io.fonts.add_font_from_file_ttf(str(font), _FONT_PIXELS)
    imgui.style_colors_dark()
    style = imgui.get_style()
    style.window_rounding = 6.0
    style.frame_rounding = 4.0
    style.grab_rounding = 4.0
    style.window_border_size = 0.0
    style.window_padding = imgui.ImVec2(12, 10)
    style.item_spacing = imgui.ImVec2(8, 5)
    colours = {
        imgui.Col_.window_bg: (0.09, 0.10, 0.12, 0.92),
        imgui.Col_.popup_bg: (0.09, 0.10, 0.12, 1.0),  # lists of the panel lie over other texts
        imgui.Col_.title_bg: (0.09, 0.10, 0.12, 1.0),
        imgui.Col_.title_bg_active: (0.14, 0.16, 0.20, 1.0),
        imgui.Col_.frame_bg: (0.19, 0.21, 0.25, 1.0),
        imgui.Col_.frame_bg_hovered: (0.25, 0.28, 0.34, 1.0),
        imgui.Col_.header: (0.18, 0.21, 0.26, 1.0),
        imgui.Col_.header_hovered: (0.25, 0.29, 0.36, 1.0),
        imgui.Col_.slider_grab: (0.85, 0.66, 0.33, 0.7),
        imgui.Col_.slider_grab_active: (1.0, 0.80, 0.45, 0.8),
        imgui.Col_.check_mark: (1.0, 0.80, 0.45, 1.0),
        imgui.Col_.plot_lines: (1.0, 0.80, 0.45, 1.0),
        imgui.Col_.button: (0.28, 0.32, 0.40, 1.0),
    }
    for colour, value in colours.items():
        style.set_color_(colour, imgui.ImVec4(*value))
