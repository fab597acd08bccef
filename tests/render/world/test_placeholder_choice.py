"""Which meshes stand in for depth images that are not ready, of a crowd seen from nobody knows where."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.resources.library import Library
from depthwalk.render.world import placeholders
from depthwalk.render.world.placeholders import Placeholders, find_placeholders
from depthwalk.scene.arrays import Representation
from shapes import scene_of

FACES = 100
CROWD = scene_of(*[(0, (x, 0.0, 50.0), 0.0, 1.0) for x in (40.0, 50.0, 60.0, 51.0, 90.0)]).objects


class Reader:
    """Has read a mesh with so many levels, or a preview of it, and notes for whom it simplifies meshes."""

    def __init__(self, levels: int, is_preview: bool) -> None:
        self._levels, self.meshes = levels, {0: SimpleNamespace(is_preview=is_preview)}
        self.simplified: list[int] = []

    def is_read(self, asset: int, simplified: bool = False, clustered: bool = False, own: bool = False) -> bool:
        if simplified:
            self.simplified.append(asset)
        return True

    def levels(self, asset: int) -> list[Any]:
        return [SimpleNamespace(mesh=SimpleNamespace(faces=np.zeros((FACES >> k, 3)))) for k in range(self._levels)]


class Balls:
    """A library of one asset, which has a mesh and depth images."""

    def __len__(self) -> int:
        return 1

    def has_mesh(self, asset: int) -> bool:
        return True

    has_baked = has_mesh


def found(reader: Reader) -> Placeholders:
    shown: list[set[int]] = []
    meshes = SimpleNamespace(reader=reader, show=shown.append)
    store = SimpleNamespace(background=object(), is_ready=lambda asset: False, meshes=meshes)
    table = find_placeholders(CROWD, cast(Library, Balls()), cast(AssetStore, store), None, None)
    assert shown == [{0}]
    return table


@pytest.mark.parametrize("is_preview", [False, True])
def test_a_crowd_that_is_too_large_is_shown_from_its_middle(monkeypatch: pytest.MonkeyPatch, is_preview: bool) -> None:
    """Where no viewer is known. Simplified levels, of which more could be drawn, are made of a whole mesh but not of a
    large one of which only a preview was read: that would keep the processor busy for minutes."""
    monkeypatch.setattr(placeholders, "_MAX_TRIANGLES", 3 * FACES)
    reader = Reader(1, is_preview)
    table = found(reader)
    assert table.hidden.tolist() == [True, False, False, False, True]
    assert reader.simplified == ([] if is_preview else [0]) and not table.ready[0] and table.has_mesh[0]


@pytest.mark.parametrize(("levels", "kind"), [(1, Representation.MESH), (3, Representation.MESH_LOD)])
def test_simplified_levels_are_drawn_where_there_are_any(levels: int, kind: Representation) -> None:
    """Else each object of a crowd is drawn in full, though the coarsest level was counted: frames of seconds."""
    assert found(Reader(levels, False)).representation[0] == kind
