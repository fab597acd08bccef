"""Which object is inspected, and the card that tells of it."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from imgui_bundle import imgui
from imgui_bundle._imgui_bundle.imgui import IO
from pyglm import glm

from depthwalk.cook.cases import Case
from depthwalk.render.object_report import ImpostorReport, MeshReport, ObjectReport
from depthwalk.render.passes.object_id import ObjectIdPass
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.bounds import Cylinders
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.walk import inspected
from depthwalk.walk.inspected import Inspected
from depthwalk.walk.object_card import cylinder_lines, draw_card, draw_outlines, object_rows, on_screen

VIEW = View(Camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), np.pi / 2), (200, 100))
IMPOSTOR = ImpostorReport(
    level=3,
    triangles=6246,
    case=Case.SIDE_AND_TOP,
    step=4,
    tile=(16, 32, 120, 240),
    resolution=0.7,
    error=0.25,
    rectangle=np.array([[-1.0, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]),
)
REPORT = ObjectReport(
    number=1234,
    asset="bust",
    node="south walk",
    distance=12.345,
    mesh_triangles=99938,
    images=(21, 512, 512),
    parts=1,
    impostors=(IMPOSTOR,),
    other=None,
    mesh=None,
    clustered=False,
    in_view=True,
    cylinders=Cylinders(np.zeros((1, 3)), np.array([[0.0, 1, 0]]), np.array([1.0]), np.array([0.5])),
)


class FakeIds(ObjectIdPass):
    """Draws nothing."""

    def __init__(self) -> None:
        super().__init__()
        self.requested = False


@pytest.fixture
def renderer(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A renderer whose frames show the object `shown` everywhere."""
    settings = SimpleNamespace(warp=SimpleNamespace(reuse_error=1.0))
    fake = SimpleNamespace(passes=[FakeIds()], shown=7, targets=object(), settings=settings, painted=[])
    fake.draw_tile = lambda targets, tile: fake.painted.append(tile)
    monkeypatch.setattr(inspected, "object_at", lambda renderer, ids, point: renderer.shown)
    monkeypatch.setattr(inspected, "report_object", lambda renderer, number: replace(REPORT, number=number))
    return fake


def draw_frame(renderer: Any, chosen: Inspected) -> bool:
    renderer.passes[0].has_drawn = renderer.passes[0].requested
    return chosen.update(cast(Renderer, renderer), renderer)


def test_the_next_frame_that_was_asked_tells_which_object_it_is(renderer: Any) -> None:
    chosen = Inspected()
    chosen.update(renderer, renderer)
    assert chosen.report is None
    chosen.seek(renderer, glm.dvec3(1, 2, 3))
    chosen.update(renderer, renderer)  # a frame that was all but finished, without the pass
    assert chosen.number is None and renderer.passes[0].requested
    draw_frame(renderer, chosen)
    assert chosen.number == 7 and chosen.report is not None and chosen.report.number == 7
    assert not renderer.passes[0].requested and chosen.impostor is IMPOSTOR
    renderer.shown = 8
    draw_frame(renderer, chosen)  # later frames report it again, and look for nothing
    assert chosen.number == 7 and renderer.painted == [IMPOSTOR.tile] * 2


def test_a_tile_that_may_be_gone_is_not_painted(renderer: Any) -> None:
    renderer.settings.warp.reuse_error = 0.0
    chosen = Inspected()
    chosen.seek(renderer, glm.dvec3(1, 2, 3))
    draw_frame(renderer, chosen)
    assert chosen.impostor is IMPOSTOR and not renderer.painted


def test_the_same_object_again_the_sky_or_the_ground_end_it(renderer: Any) -> None:
    chosen = Inspected()
    seen: list[int | None] = []
    for point, shown in ((glm.dvec3(1), 7), (glm.dvec3(1), 7), (glm.dvec3(1), 7), (None, 7), (glm.dvec3(1), 8)):
        renderer.shown = shown
        chosen.seek(renderer, point)
        draw_frame(renderer, chosen)
        seen.append(chosen.number)
    renderer.shown = None  # the ground
    chosen.seek(renderer, glm.dvec3(1))
    assert not draw_frame(renderer, chosen)  # it ended an inspection
    assert seen == [7, None, 7, None, 8] and chosen.number is None and chosen.report is None
    chosen.seek(renderer, glm.dvec3(1))
    assert draw_frame(renderer, chosen) and not draw_frame(renderer, chosen)  # nothing to end; told once


def test_the_largest_impostor_is_shown_of_an_object_in_parts() -> None:
    small = replace(IMPOSTOR, tile=(0, 0, 8, 8))
    assert Inspected(report=replace(REPORT, impostors=(small, IMPOSTOR, small))).impostor is IMPOSTOR
    assert Inspected(report=replace(REPORT, impostors=())).impostor is None


def test_the_card_tells_how_an_object_is_drawn() -> None:
    assert object_rows(REPORT, IMPOSTOR, 1.0) == [
        ("object", "1,234 in south walk"),
        ("distance", "12.3 m"),
        ("made of", "99,938 triangles"),
        ("images", "21 of 512 × 512"),
        ("drawn as", "impostor"),
        ("level", "3, 6,246 triangles"),
        ("case", "side + top"),
        ("Iter_step", "4"),
        ("tile", "120 × 240 texels, scale 70%"),
        ("error", "0.25 of 1 allowed pixels"),
    ]


@pytest.mark.parametrize(
    ("change", "drawn"),
    [
        ({"impostors": (), "mesh": MeshReport(level=0, triangles=99938)}, "mesh"),
        ({"impostors": (), "other": Representation.DMESH}, "dmesh"),
        ({"impostors": (), "clustered": True}, "part of a far cluster"),
        ({"impostors": ()}, "nothing: it is hidden"),
        ({"impostors": (), "in_view": False}, "nothing: it is out of sight"),
    ],
)
def test_other_ways_are_told_too(change: dict[str, Any], drawn: str) -> None:
    rows = object_rows(replace(REPORT, **change, images=None, mesh_triangles=0, node="", distance=12345.6), None, 1.0)
    assert rows[:2] == [("object", "1,234"), ("distance", "12,346 m")]
    assert rows[2] == ("drawn as", drawn)
    assert rows[3:] == ([("", "99,938 triangles")] if "mesh" in change else [])
    simplified = replace(REPORT, impostors=(), mesh=MeshReport(level=2, triangles=1560))
    assert object_rows(simplified, None, 1.0)[-1] == ("", "1,560 triangles, level 2")


def test_lines_are_projected_to_where_the_picture_shows_them() -> None:
    line = np.array([[0.0, 0, 0], [5, 0, 0], [5, 2.5, 0]])  # 5 m ahead, where the picture is 20 m wide and 10 high
    assert on_screen(VIEW, line) == pytest.approx(
        np.array([[[0.5, 0.5], [0.75, 0.5]], [[0.75, 0.5], [0.75, 0.25]]]), abs=1e-9
    )


def test_lines_end_just_in_front_of_the_viewer() -> None:
    straight = on_screen(VIEW, np.array([[0.0, -1, 0], [0, -1, 10]]))  # along the floor, past the viewer's feet
    assert straight[0, 0] == pytest.approx([0.5, 0.6]) and straight[0, 1, 0] == pytest.approx(0.5)
    assert straight[0, 1, 1] == pytest.approx(0.5 + 1 / 0.01 / 2)
    backward = on_screen(VIEW, np.array([[0.0, -1, 10], [0, -1, 0]]))
    assert backward[0, ::-1] == pytest.approx(straight[0])
    assert on_screen(VIEW, np.array([[0.0, 0, 6], [0, 0, 7]])).shape == (0, 2, 2)


@pytest.mark.parametrize("axis", [(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.6, 0.0, 0.8)])
def test_the_lines_of_a_cylinder_lie_on_it(axis: tuple[float, float, float]) -> None:
    cylinder = Cylinders(np.array([[1.0, 2, 3]]), np.array([axis]), np.array([2.0]), np.array([0.5]))
    lines = cylinder_lines(replace(REPORT, cylinders=cylinder))
    assert len(lines) == 6
    for points in lines:
        along = (points - cylinder.centre) @ np.array(axis)
        across = np.linalg.norm(points - cylinder.centre - along[:, None] * np.array(axis), axis=1)
        assert np.abs(along) == pytest.approx(2.0) and across == pytest.approx(0.5)


@pytest.mark.parametrize(("width", "left"), [(1280, 289.0), (480, 289.0), (480, 0.0)])
def test_the_card_lies_within_the_window(overlay_io: IO, width: int, left: float) -> None:
    overlay_io.display_size = imgui.ImVec2(width, 480)

    def draw() -> None:
        draw_outlines(VIEW, REPORT)
        draw_card(REPORT, IMPOSTOR, None, 1.0, left=left, right=width)

    card = drawn(draw)
    assert card.pos.x >= (left if width > 1000 else 0) and card.pos.x + card.size.x <= width
    assert card.pos.y >= 0 and card.pos.y + card.size.y <= 480


def drawn(widgets: Callable[[], None]) -> Any:
    """The card's window, measured in one frame and placed in the next."""
    for _ in range(3):
        imgui.new_frame()
        widgets()
        imgui.render()
    return imgui.internal.find_window_by_name("object")
