"""False colours of objects: which tile, batch or representation each of them gets its colour from."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from depthwalk.cook.cases import BOTTOM_PIECE, TOP_PIECE
from depthwalk.render.draw.draw_lists import DrawBatch, DrawList, FrameDrawLists
from depthwalk.render.draw.frame_counts import DrawnTiles
from depthwalk.render.draw.object_colours import legend, object_colours, polygon_errors
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.render.view.view import View
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.effect_settings import HowDrawn
from depthwalk.types import Array


def polygons(*levels: int) -> DrawList:
    """A list of one mesh for each of these levels."""
    batches = [DrawBatch(asset=0, first=k, count=1, level=level) for k, level in enumerate(levels)]
    return DrawList(records=np.zeros(len(levels), PLACED_RECORD), batches=batches)


def plan(
    drawn_as: list[Representation],
    batches: tuple[DrawBatch, ...] = (),
    meshes: tuple[int, ...] = (),
    clustered: tuple[int, ...] = (),
    polygon_error: Array | None = None,
    **tiles: Any,
) -> FrameDrawLists:
    """Draw lists of a frame in which objects are drawn in these ways; columns of tiles that are not given are 0.

    meshes, clustered: the levels of polygons.
    """
    count = len(tiles["members"])
    columns = {name: np.zeros(count, int) for name in ("level", "pieces", "resolution", "step", "error")}
    lists = SimpleNamespace(
        drawn_as=np.array(drawn_as, np.uint8),
        tiled=np.array(drawn_as) == Representation.DPCI,
        object_rows=np.arange(len(drawn_as)),
        dmesh=SimpleNamespace(batches=list(batches)),
        mesh=polygons(*meshes),
        clusters=SimpleNamespace(objects=polygons(*clustered)),
        polygons=DrawList.joined([polygons(*meshes), polygons(*clustered)]),
        polygon_error=polygon_error,
        tiles=DrawnTiles(**columns | {name: np.array(column) for name, column in tiles.items()}),
    )
    return cast(FrameDrawLists, lists)


def meanings(lists: FrameDrawLists, show: HowDrawn) -> list[str]:
    """What the colour of each object says, number 0 first; "" for a colour that is not explained."""
    colours: Array = object_colours(lists, show).records["colour"][:, :3]
    explained = legend(show)
    palette = np.array([colour for _, colour in explained])
    nearest = np.linalg.norm(colours[:, None] - palette, axis=-1)
    return [explained[k][0] if away < 1e-6 else "" for k, away in zip(nearest.argmin(1), nearest.min(1), strict=True)]


DPCI, DMESH, RELIEF = Representation.DPCI, Representation.DMESH, Representation.RELIEF


def test_each_representation_has_a_colour() -> None:
    lists = plan([DPCI, DMESH, RELIEF, DPCI], meshes=(0, 3), clustered=(0, 1), members=[1, 1])
    images = ["impostor", "dmesh", "height field", "impostor"]
    assert meanings(lists, "representation") == ["", *images, "mesh", "simplified", *["clusters"] * 2]
    assert object_colours(lists, "representation").captured == dict(legend("representation"))["captured view"]


def test_objects_of_a_far_cluster_have_the_level_of_its_tile() -> None:
    """Others stand between tiles: those of an earlier phase come first, whatever they are."""
    batches = (DrawBatch(asset=0, first=0, count=1, level=5), DrawBatch(asset=1, first=1, count=2, level=0))
    lists = plan([DPCI, DMESH, DPCI, DPCI, DMESH, DMESH, DPCI], batches, members=[1, 2, 1], level=[3, 1, 9])
    assert meanings(lists, "level") == ["no levels", "3", "5", "1", "1", "0", "0", "7+"]


def test_cases_follow_the_caps_that_are_drawn() -> None:
    side, top, bottom = 2, 1 << TOP_PIECE, 1 << BOTTOM_PIECE
    batches = (DrawBatch(asset=0, first=0, count=1, pieces=side | bottom),)
    pieces = [side, side | top, side | top | bottom]
    lists = plan([DPCI, DPCI, DPCI, DMESH], batches, members=[1, 1, 1], pieces=pieces)
    assert meanings(lists, "case") == ["polygons", "side", "side + top", "all", "side + bottom"]


@pytest.mark.parametrize(
    ("error", "meaning"), [(0.0, "0"), (0.5, "half"), (1.0, "all that is allowed"), (3.0, "all that is allowed")]
)
def test_errors_are_relative_to_what_is_allowed(error: float, meaning: str) -> None:
    lists = plan([DPCI, DMESH], meshes=(0, 1), polygon_error=np.array([0.0, error]), members=[1], error=[error])
    assert meanings(lists, "error") == ["not known", meaning, "not known", "0", meaning]


def test_polygons_have_levels_after_all_depth_images_and_no_case() -> None:
    lists = plan([DPCI], meshes=(2, 9), clustered=(1,), members=[1], level=[0])
    assert meanings(lists, "level") == ["no levels", "0", "2", "7+", "1"]
    colours = object_colours(lists, "level")
    assert (colours.first_mesh, colours.first_clustered) == (2, 4)
    assert meanings(lists, "case")[2:] == ["polygons"] * 3


def test_the_error_of_a_mesh_is_that_of_its_level_at_its_distance() -> None:
    records = np.zeros(3, PLACED_RECORD)
    records["origin"], records["rotation"], records["scale"] = [(0, 0, -5), (0, 0, -10), (0, 0, -5)], (0, 0, 0, 1), 1
    records["scale"][1] = 2
    levels = [1, 1, 0]
    batches = [DrawBatch(asset=0, first=k, count=1, level=level) for k, level in enumerate(levels)]
    table = SimpleNamespace(
        nearest=lambda asset, viewer: np.linalg.norm(viewer, axis=1),
        meshes=SimpleNamespace(error=np.array([[0.0, 0.01]])),
    )
    view = View(Camera((0, 0, 0), (0, 0, -1), 1.0), (100, 100))
    found = polygon_errors(view, DrawList(records=records, batches=batches), cast(AssetTable, table), 4.0)
    pixels = 0.01 / 5 * view.detail_pixels
    np.testing.assert_allclose(found, [pixels / 4, pixels / 4, 0])
