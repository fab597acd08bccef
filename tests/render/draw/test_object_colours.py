"""False colours of objects: which tile, batch or representation each of them gets its colour from."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from depthwalk.cook.cases import BOTTOM_PIECE, TOP_PIECE
from depthwalk.render.draw.draw_lists import DrawBatch, FrameDrawLists
from depthwalk.render.draw.frame_counts import DrawnTiles
from depthwalk.render.draw.object_colours import legend, object_colours
from depthwalk.scene.arrays import Representation
from depthwalk.scene.effect_settings import HowDrawn
from depthwalk.types import Array


def plan(drawn_as: list[Representation], batches: tuple[DrawBatch, ...] = (), **tiles: Any) -> FrameDrawLists:
    """Draw lists of a frame in which objects are drawn in these ways; columns of tiles that are not given are 0."""
    count = len(tiles["members"])
    columns = {name: np.zeros(count, int) for name in ("level", "pieces", "resolution", "step", "error")}
    lists = SimpleNamespace(
        drawn_as=np.array(drawn_as, np.uint8),
        tiled=np.array(drawn_as) == Representation.DPCI,
        object_rows=np.arange(len(drawn_as)),
        dmesh=SimpleNamespace(batches=list(batches)),
        tiles=DrawnTiles(**columns | {name: np.array(column) for name, column in tiles.items()}),
    )
    return cast(FrameDrawLists, lists)


def meanings(lists: FrameDrawLists, show: HowDrawn) -> list[str]:
    """What the colour of each object says, number 0 first."""
    colours: Array = object_colours(lists, show).records["colour"][:, :3]
    explained = legend(show)
    palette = np.array([colour for _, colour in explained])
    nearest = np.linalg.norm(colours[:, None] - palette, axis=-1)
    assert (nearest.min(1) < 1e-6).all()
    return [explained[k][0] for k in nearest.argmin(1).tolist()]


DPCI, DMESH, RELIEF = Representation.DPCI, Representation.DMESH, Representation.RELIEF


def test_each_representation_has_a_colour() -> None:
    lists = plan([DPCI, DMESH, RELIEF, DPCI], members=[1, 1])
    expected = ["polygons", "impostor", "dmesh", "height field", "impostor"]
    assert meanings(lists, "representation") == expected
    assert object_colours(lists, "representation").captured == dict(legend("representation"))["captured view"]


def test_objects_of_a_far_cluster_have_the_level_of_its_tile() -> None:
    """Others stand between tiles: those of an earlier phase come first, whatever they are."""
    batches = (DrawBatch(asset=0, first=0, count=1, level=5), DrawBatch(asset=1, first=1, count=2, level=0))
    lists = plan([DPCI, DMESH, DPCI, DPCI, DMESH, DMESH, DPCI], batches, members=[1, 2, 1], level=[3, 1, 9])
    assert meanings(lists, "level") == ["polygons", "3", "5", "1", "1", "0", "0", "7+"]


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
    assert meanings(plan([DPCI, DMESH], (), members=[1], error=[error]), "error") == [
        "no impostor",
        meaning,
        "no impostor",
    ]
