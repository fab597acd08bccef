"""Lay out the widgets of the window: HUD, panel, help, the atlas of impostors, progress and messages."""

from depthwalk.assets.progress import Progress
from depthwalk.render.view.view import View
from depthwalk.walk import hud
from depthwalk.walk.atlas_view import AtlasView
from depthwalk.walk.legend import draw_legend
from depthwalk.walk.object_card import draw_card, draw_outlines
from depthwalk.walk.overlay import Overlay
from depthwalk.walk.panel import Area, draw_atlas, draw_panel
from depthwalk.walk.state import State


def draw_widgets(
    state: State, overlay: Overlay, atlas_view: AtlasView, progress: Progress | None, *, in_screenshot: bool
) -> list[Area]:
    """Draw the widgets that `state` shows, in a frame of imgui.

    Parameters
    ----------
    state
        What is shown; the panel changes it.
    overlay
        Draws the frame.
    atlas_view
        The picture of the impostors.
    progress
        Progress of background work on assets; None shows nothing.
    in_screenshot
        Whether a screenshot is being taken, which leaves out messages.

    Returns
    -------
    list[Area]
        The parts of the window where the mouse belongs to widgets.
    """
    areas = []
    left = hud.draw_hud(state) if state.hud else 0.0
    if state.hud and state.renderer.settings.dof.mode != "none":
        hud.draw_crosshair()
    if state.atlas:
        areas.append(draw_atlas(overlay.renderer.show(atlas_view.texture), atlas_view.aspect, left))
    right, floor = overlay.io.display_size.x, overlay.io.display_size.y
    if state.panel:
        areas.append(panel := draw_panel(state, left))
        right = panel[0]
    if (report := state.inspected.report) is not None and not state.help:
        impostor, allowed = state.inspected.impostor, state.renderer.settings.warp.reuse_error
        has_tile = state.inspected.tile(state.renderer) is not None
        tile = overlay.renderer.show(atlas_view.tile_texture) if has_tile else None
        draw_outlines(View(state.camera, (round(overlay.io.display_size.x), round(floor))), report)
        draw_card(report, impostor, tile, allowed, left=left, right=right)
    if (show := state.renderer.settings.inspection.how_drawn) is not None and not state.help:
        draw_legend(show, left, right)
    if state.help:
        scrolled = hud.draw_help(left, right)
        areas += [scrolled] if scrolled else []
    if in_screenshot:
        return areas
    if progress is not None:
        floor = hud.draw_background(progress, right)
    if notice := state.notice:
        hud.draw_toast(notice, floor, left, right)
    return areas
