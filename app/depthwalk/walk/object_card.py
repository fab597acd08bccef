"""Draw what is known about the inspected object: figures, its tile, and outlines around it in the picture."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import Case
from depthwalk.render.object_report import ImpostorReport, ObjectReport
from depthwalk.render.view.view import View
from depthwalk.types import Array
from depthwalk.walk.hud_rows import CASES
from depthwalk.walk.hud_widgets import BRIGHT, CLOSE_ROWS, MARGIN, begin_overlay, draw_table
from depthwalk.walk.native_imgui import imgui

_ALL = "side + top + bottom"  # where there is more room than in the HUD
_CORNERS = 48  # of the polygon that stands for a circle
_NEAREST = 0.01  # metres in front of the viewer up to which lines are drawn
_CYLINDER, _IMPOSTOR = (1.0, 0.86, 0.55, 0.8), (0.45, 0.85, 1.0, 0.9)
_WIDTH, _TILE_HEIGHT = 250.0, 150.0  # of the card and of the picture of the tile, window coordinates


def object_rows(report: ObjectReport, impostor: ImpostorReport | None, allowed_error: float) -> list[tuple[str, str]]:
    """Return names and texts of the rows about an inspected object.

    Parameters
    ----------
    report
        What a frame says about the object.
    impostor
        The impostor to describe; None if the object was not drawn by any.
    allowed_error
        The reprojection error at which an impostor is warped again, pixels.

    Returns
    -------
    list[tuple[str, str]]
        A name and a text for each row.
    """
    rows = [("object", f"{report.number:,}" + (f" in {report.node}" if report.node else ""))]
    rows.append(("distance", f"{report.distance:,.3g} m" if report.distance < 1000 else f"{report.distance:,.0f} m"))
    if report.mesh_triangles:
        rows.append(("made of", f"{report.mesh_triangles:,} triangles"))
    if report.images is not None:
        count, width, height = report.images
        parts = f", {report.parts} parts" if report.parts > 1 else ""
        rows.append(("images", f"{count} of {width} \u00d7 {height}{parts}"))
    rows.append(("drawn as", _representation(report)))
    if report.mesh is not None:
        level = "" if report.mesh.level == 0 else f", level {report.mesh.level}"
        rows.append(("", f"{report.mesh.triangles:,} triangles{level}"))
    if impostor is not None:
        rows += _impostor_rows(impostor, allowed_error)
    return rows


def _representation(report: ObjectReport) -> str:
    """Return in a few words how an object was drawn."""
    drawn = {
        "impostor": bool(report.impostors),
        "mesh": report.mesh is not None,
        "part of a far cluster": report.clustered,
    }
    if report.other is not None:
        drawn[report.other.label] = True
    not_drawn = "nothing: it is hidden" if report.in_view else "nothing: it is out of sight"
    return " + ".join(name for name, is_so in drawn.items() if is_so) or not_drawn


def _impostor_rows(impostor: ImpostorReport, allowed_error: float) -> list[tuple[str, str]]:
    _, _, width, height = impostor.tile
    scale = "" if impostor.resolution > 0.995 else f", scale {impostor.resolution:.0%}"
    return [
        ("level", f"{impostor.level}, {impostor.triangles:,} triangles"),
        ("case", _ALL if impostor.case is Case.ALL else CASES[impostor.case.name.lower()]),
        ("Iter_step", f"{impostor.step}"),
        ("tile", f"{width} \u00d7 {height} texels{scale}"),
        ("error", f"{impostor.error * allowed_error:.2f} of {allowed_error:g} allowed pixels"),
    ]


def draw_card(
    report: ObjectReport,
    impostor: ImpostorReport | None,
    tile: imgui.ImTextureRef | None,
    allowed_error: float,
    *,
    left: float,
    right: float,
) -> None:
    """Draw the figures of an inspected object, with a picture of its tile.

    Parameters
    ----------
    report, impostor, allowed_error
        As in `object_rows`.
    tile
        The picture of the impostor's tile, as `ImguiRenderer.show` returns it; None without one.
    left, right
        The right end of the HUD and the left end of the panel, window coordinates. The card is drawn beside the HUD, or
        in the lower left corner if there is no room.
    """
    display = imgui.get_io().display_size
    has_room = right - left > _WIDTH + 3 * MARGIN
    place, pivot = ((left + MARGIN, MARGIN), (0.0, 0.0)) if has_room else ((MARGIN, display.y - MARGIN), (0.0, 1.0))
    begin_overlay("object", place, pivot)
    imgui.text_colored(BRIGHT, report.asset)
    imgui.push_style_var(imgui.StyleVar_.cell_padding, CLOSE_ROWS)
    draw_table("object", object_rows(report, impostor, allowed_error))
    imgui.pop_style_var()
    if tile is not None and impostor is not None and has_room:
        _, _, width, height = impostor.tile
        scale = min(_WIDTH / width, _TILE_HEIGHT / height)
        imgui.image(tile, (scale * width, scale * height))
    imgui.end()


def draw_outlines(view: View, report: ObjectReport) -> None:
    """Draw the cylinders around an inspected object, and the rectangles of its impostors, over the picture.

    Parameters
    ----------
    view
        The view that the window shows; the size of its picture does not matter.
    report
        What the last frame says about the object.
    """
    display, canvas = imgui.get_io().display_size, imgui.get_background_draw_list()
    size = np.array([display.x, display.y])
    rectangles = np.array([closed(impostor.rectangle) for impostor in report.impostors]).reshape(-1, 5, 3)
    for colour, lines in ((_CYLINDER, cylinder_lines(report)), (_IMPOSTOR, rectangles)):
        packed = imgui.get_color_u32(colour)
        for line in lines:
            for start, end in (size * segment for segment in on_screen(view, line)):
                canvas.add_line(tuple(start), tuple(end), packed, 1.5)


def closed(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a line (n, 3) that leads back to its first point, (n + 1, 3)."""
    return np.concatenate([line, line[:1]])


def cylinder_lines(report: ObjectReport) -> list[NDArray[np.float64]]:
    """Return lines (n, 3) along the bounding cylinders of an object, metres, world: two circles and four sides each."""
    cylinders = report.cylinders
    turns = np.linspace(0, 2 * np.pi, _CORNERS + 1)
    lines = []
    for centre, axis, half_height, radius in zip(
        *(np.asarray(column, float) for column in (cylinders.centre, cylinders.axis)),
        cylinders.half_height.tolist(),
        cylinders.radius.tolist(),
        strict=True,
    ):
        across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        across /= np.linalg.norm(across)
        circle = radius * (np.cos(turns)[:, None] * across + np.sin(turns)[:, None] * np.cross(axis, across))
        upper, lower = centre + circle + half_height * axis, centre + circle - half_height * axis
        lines += [upper, lower, *np.stack([lower, upper], 1)[: -1 : _CORNERS // 4]]
    return lines


def on_screen(view: View, line: Array) -> NDArray[np.float64]:
    """Project a line, and cut off what is behind the viewer.

    Parameters
    ----------
    view
        The view.
    line
        (n, 3) points that it connects, metres, world.

    Returns
    -------
    numpy.ndarray
        (k, 2, 2) start and end of the segments in front of the viewer: parts of the picture's width and height, from
        its upper left corner.
    """
    ends = np.stack([line[:-1], line[1:]], 1)
    right, up, ahead = np.moveaxis((ends - view.position) @ view.axes.T, -1, 0)
    is_ahead = ahead > _NEAREST
    kept = is_ahead.any(1)
    right, up, ahead, is_ahead = right[kept], up[kept], ahead[kept], is_ahead[kept]
    # The end behind the viewer is moved along the segment to where it passes the nearest distance.
    along = np.divide(_NEAREST - ahead, ahead[:, ::-1] - ahead, where=~is_ahead, out=np.zeros_like(ahead))
    right, up, ahead = (values + along * (values[:, ::-1] - values) for values in (right, up, ahead))
    wide, high = view.half_extent
    return np.stack([(1 + right / (ahead * wide)) / 2, (1 - up / (ahead * high)) / 2], -1)
