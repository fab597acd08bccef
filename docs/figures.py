"""Draw the line figures of the documentation as SVG: `python docs/make_images.py cylinder shift impostor cases tables`.

All coordinates are pixels, x to the right and y down. Points that the text computes (where a sample lands on the warp
plane) are computed here by the same formula, so that the figures are to scale.
"""

import math
from typing import Any

from depthwalk.bench import plots
from depthwalk.bench.tables.table import Curves

Point = tuple[float, float]

_INK, _FAINT, _RED, _BLUE, _GREEN = "#222", "#999", "#c0392b", "#2563a8", "#2e8b57"
_FONT = 'font-family="sans-serif" font-size="14"'


def cylinder() -> str:
    """Return the cylinder with a ray of each kind, and beside it the side image that its rays fill."""
    middle, top, bottom, across, squash = 170.0, 70.0, 290.0, 110.0, 28.0
    hit = (middle - 40, 190.0)
    parts = [
        f'<ellipse cx="{middle}" cy="{top}" rx="{across}" ry="{squash}" fill="#e8f0fa" stroke="{_INK}"/>',
        f'<path d="M{middle - across} {top}V{bottom}A{across} {squash} 0 0 0 {middle + across} {bottom}V{top}"'
        f' fill="none" stroke="{_INK}"/>',
        f'<path d="M{middle - 40} 262C{middle - 75} 230 {middle - 20} 205 {middle - 42} 180C{middle - 70} 130'
        f' {middle + 60} 100 {middle + 45} 175C{middle + 35} 215 {middle + 75} 240 {middle + 40} 262Z"'
        f' fill="#eee0c8" stroke="{_INK}"/>',
        line((middle, 26), (middle, 320), _FAINT, dashed=True),
        text((middle + 6, 24), "axis, +Y"),
        line((middle, top), (middle + across, top), _FAINT, dashed=True),
        text((middle + 45, top - 6), "R"),
        arrow((middle - across, hit[1]), hit, _RED),
        text((middle - across - 4, hit[1] - 8), "d", _RED, "end"),
        arrow((middle + 20, top), (middle + 20, 128), _BLUE),
        text((middle + 27, 104), "top", _BLUE),
        arrow((middle + 14, bottom + 20), (middle + 14, 264), _GREEN),
        text((middle + 22, bottom + 18), "bottom", _GREEN),
        text((middle + across + 8, top + 5), "y1"),
        text((middle + across + 8, bottom + 5), "y0"),
    ]
    left, right = 400.0, 680.0
    parts += [
        f'<rect x="{left}" y="{top}" width="{right - left}" height="{bottom - top}" fill="#fbf4f3" stroke="{_INK}"/>'
    ]
    for column in range(1, 14):
        x = left + (right - left) * column / 14
        parts.append(line((x, top), (x, bottom), "#ddd"))
    for row in range(1, 11):
        y = top + (bottom - top) * row / 11
        parts.append(line((left, y), (right, y), "#ddd"))
    texel = f'<rect x="{left + 80}" y="{top + 100}" width="20" height="20" fill="{_RED}"/>'
    parts += [
        texel,
        text((left + 106, top + 96), "one ray, one texel:", _RED),
        text((left + 106, top + 138), "depth d, colour, normal", _RED),
        text(((left + right) / 2, bottom + 24), "θ, wraps at the seam θ = 0", _INK, "middle"),
        text((left, top - 10), "side image: W × H texels"),
    ]
    return svg(720, 330, parts)


def shift() -> str:
    """Return the shift of two samples in the warp plane, seen from above: the farther one moves more."""
    viewer, plane = (70.0, 250.0), 290.0
    foot = (plane, viewer[1])
    parts = [
        f'<circle cx="430" cy="160" r="140" fill="#f6f6f6" stroke="{_FAINT}" stroke-dasharray="5 4"/>',
        text((500, 296), "cylinder from above", _FAINT),
        line((plane, 20), (plane, 320), _INK, width=2),
        text((plane - 8, 34), "warp plane", _INK, "end"),
        line(viewer, foot, _FAINT, dashed=True),
        text(((viewer[0] + plane) / 2, viewer[1] + 20), "D_t", _INK, "middle"),
        dot(viewer, _INK),
        text((viewer[0] - 4, viewer[1] - 12), "viewer C", _INK, "middle"),
        dot(foot, _INK),
        text((plane + 8, viewer[1] + 18), "epipole e"),
    ]
    for sample, colour, name in (((510.0, 70.0), _RED, ""), ((384.0, 196.0), _BLUE, "′")):
        depth = sample[0] - plane
        nearness = (plane - viewer[0]) / (plane - viewer[0] + depth)
        target = (plane, foot[1] + nearness * (sample[1] - foot[1]))
        parts += [
            line(viewer, sample, colour),
            line((plane, sample[1]), sample, colour, dashed=True),
            dot(sample, colour),
            text((sample[0] + 8, sample[1] - 4), f"B{name}", colour),
            dot((plane, sample[1]), colour),
            text((plane - 9, sample[1] + 4), f"S{name}", colour, "end"),
            dot(target, colour),
            text((plane + 8, target[1] + 5), f"X{name}", colour),
        ]
    parts += [
        text(((plane + 510) / 2, 62), "depth", _RED, "middle"),
        text((580, 150), "λ = D_t / (D_t + depth)"),
        text((580, 174), "X − e = λ (S − e)"),
        arrow((plane - 34, 72), (plane - 34, 158), _RED),
        text((plane - 42, 118), "shift", _RED, "end"),
    ]
    return svg(760, 340, parts)


def impostor() -> str:
    """Return a camera that looks through an impostor quad at the surface behind it, which a polygon intersects."""
    camera, plane = (60.0, 170.0), 290.0
    middle, across = (405.0, 170.0), 115.0
    parts = [
        f'<circle cx="{middle[0]}" cy="{middle[1]}" r="{across}" fill="#eee0c8" stroke="{_FAINT}"/>',
        line((plane, 60), (plane, 280), _BLUE, width=4),
        text((plane - 10, 76), "impostor quad on the warp plane", _BLUE, "end"),
        dot(camera, _INK),
        text((camera[0], camera[1] - 14), "camera C", _INK, "middle"),
    ]
    surface = []
    for degrees in range(-18, 19, 4):
        slope = math.radians(degrees)
        along = (math.cos(slope), math.sin(slope))
        offset = (middle[0] - camera[0], middle[1] - camera[1])
        forward = offset[0] * along[0] + offset[1] * along[1]
        squared = across**2 - (offset[0] ** 2 + offset[1] ** 2 - forward**2)
        if squared < 0:
            continue
        distance = forward - math.sqrt(squared)
        surface.append((camera[0] + distance * along[0], camera[1] + distance * along[1]))
    for point in surface:
        parts += [line(camera, point, "#c7d6e8"), dot(point, _RED, 3)]
    parts.append(line((300, 40), (352, 300), _GREEN, width=3))
    marked = surface[1]
    crossing = camera[1] + (marked[1] - camera[1]) * (plane - camera[0]) / (marked[0] - camera[0])
    parts += [
        dot((plane, crossing), _BLUE),
        line((526, 116), (marked[0] + 6, marked[1]), _RED, dashed=True),
        text((plane - 8, crossing - 6), "X, with λ from the atlas", _BLUE, "end"),
        text((530, 120), "P = C + (X − C) / λ", _RED),
        text((308, 42), "a polygon: in front above, hidden below,", _GREEN),
        text((362, 312), "pixel by pixel, as P decides", _GREEN),
    ]
    return svg(720, 340, parts)


def cases() -> str:
    """Return the paper's three cases: the viewer beside, above and below the object, and the images it needs."""
    parts = []
    names = ("1: beside: side", "2: above: side + top", "3: below: side + bottom")
    for number, (name, height) in enumerate(zip(names, (150.0, 60.0, 250.0), strict=True)):
        left = 20 + number * 235
        eye, low, high = (left + 26.0, height), 210.0, 110.0
        x0, x1 = left + 110.0, left + 190.0
        parts += [
            f'<rect x="{x0}" y="{high}" width="{x1 - x0}" height="{low - high}" fill="#f6f6f6" stroke="{_FAINT}"/>',
            line((left + 10, high), (x0, high), _FAINT, dashed=True),
            line((left + 10, low), (x0, low), _FAINT, dashed=True),
            line((x0, high), (x0, low), _RED, width=5),
            dot(eye, _INK, 6),
            line(eye, (x0, high), "#bbb"),
            line(eye, (x0, low), "#bbb"),
            text((left + 110, 302), name, _INK, "middle"),
        ]
        if number == 1:
            parts += [line((x0, high), (x1, high), _BLUE, width=5), line(eye, (x1, high), "#bbb")]
        if number == 2:
            parts += [line((x0, low), (x1, low), _GREEN, width=5), line(eye, (x1, low), "#bbb")]
    parts += [text((28, 104), "y1", _FAINT, "end"), text((28, 214), "y0", _FAINT, "end")]
    return svg(720, 320, parts)


def curves(title: str, shown: dict[str, Any]) -> str:
    """Return the curves of a table, both axes logarithmic, each named where it ends.

    Parameters
    ----------
    title
        What the curves show.
    shown
        The fields of `Curves`, as `depthwalk tables --json` writes them.
    """
    plot = plots.curves(title, Curves(label=shown["label"], x=tuple(shown["x"]), columns=shown["columns"]))
    parts = [line((plots.LEFT, y), (plots.RIGHT, y), "#ddd") for y, _ in plot.ticks]
    parts += [text((plots.LEFT - 6, y + 4), label, _FAINT, "end") for y, label in plot.ticks]
    for x, label in plot.marks:
        parts += [line((x, plots.TOP), (x, plots.BOTTOM), _FAINT, dashed=True)]
        parts += [text((x, plots.BOTTOM + 18), label, _FAINT, "middle")]
    for number, shape in enumerate(plot.lines):
        parts.append(f'<polyline points="{shape.points}" fill="none" stroke="{shape.colour}" stroke-width="2"/>')
        parts.append(text((plots.LEFT + 8 + 150 * number, plots.BOTTOM + 44), shape.name, shape.colour))
    parts.append(text((plots.RIGHT, plots.BOTTOM + 44), plot.label, _INK, "end"))
    return svg(plots.RIGHT + 24, plots.BOTTOM + 56, parts)


def svg(width: int, height: int, parts: list[str]) -> str:
    """Return a whole SVG file of `width` × `height` pixels with a white background."""
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" {_FONT}>'
    return "\n".join([head, f'<rect width="{width}" height="{height}" fill="#fff"/>', *parts, "</svg>", ""])


def line(start: Point, end: Point, colour: str, *, dashed: bool = False, width: float = 1.2) -> str:
    """Return a straight line."""
    dashes = ' stroke-dasharray="5 4"' if dashed else ""
    ends = f'x1="{start[0]:.4g}" y1="{start[1]:.4g}" x2="{end[0]:.4g}" y2="{end[1]:.4g}"'
    return f'<line {ends} stroke="{colour}" stroke-width="{width}"{dashes}/>'


def arrow(start: Point, end: Point, colour: str) -> str:
    """Return a line that ends in a head."""
    direction = math.atan2(end[1] - start[1], end[0] - start[0])
    head = [end]
    for turn in (math.radians(155), -math.radians(155)):
        head.append((end[0] + 10 * math.cos(direction + turn), end[1] + 10 * math.sin(direction + turn)))
    corners = " ".join(f"{x:.4g},{y:.4g}" for x, y in head)
    return line(start, end, colour, width=2) + f'<polygon points="{corners}" fill="{colour}"/>'


def dot(place: Point, colour: str, radius: float = 4) -> str:
    """Return a filled circle."""
    return f'<circle cx="{place[0]:.4g}" cy="{place[1]:.4g}" r="{radius}" fill="{colour}"/>'


def text(place: Point, words: str, colour: str = _INK, anchor: str = "start") -> str:
    """Return a line of text whose `anchor` (start, middle or end) is at `place`."""
    return f'<text x="{place[0]:.4g}" y="{place[1]:.4g}" fill="{colour}" text-anchor="{anchor}">{words}</text>'
