"""Colliders are made once, in the background, and the ones used last stay in memory."""

from collections.abc import Iterator
from typing import cast

import pytest

from depthwalk.assets.library import SceneLibrary
from depthwalk.cook.cook import CookOptions
from depthwalk.errors import InputError
from depthwalk.walk.collision import collider_store
from depthwalk.walk.collision.collider import Collider
from depthwalk.walk.collision.collider_store import ColliderStore
from shapes import box

OPTIONS = CookOptions()


class Crates:
    """A library of crates, of which the asset with the number 9 cannot be read."""

    def __init__(self) -> None:
        self.read: list[int] = []

    def mesh(self, asset: int) -> object:
        self.read.append(asset)
        if asset == 9:
            raise InputError("crate.ply: has gone")
        return box(1.0, 1.0, 1.0)


@pytest.fixture
def store() -> Iterator[ColliderStore]:
    made = ColliderStore(cast(SceneLibrary, Crates()))
    yield made
    made.close()


def made(store: ColliderStore, asset: int) -> Collider | None:
    """The collider of an asset's mesh, asked for and waited for."""
    found = store.collider((asset, None), OPTIONS, 1.0)
    if found is None:
        for future in store._making.values():
            future.result(20)
        store.poll()
        found = store.collider((asset, None), OPTIONS, 1.0)
    return found


def reads(store: ColliderStore) -> list[int]:
    return cast(Crates, store._library).read


def test_each_is_made_once_and_what_cannot_be_read_stops_nobody(store: ColliderStore) -> None:
    assert store.collider((0, None), OPTIONS, 1.0) is None and store.is_busy
    assert made(store, 0) is made(store, 0) is not None and not store.is_busy
    assert made(store, 9) is None and made(store, 9) is None
    assert reads(store) == [0, 9] and store.arrived == 2


def test_those_used_last_stay_and_a_single_large_one_does(
    store: ColliderStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else the walls of a scene that is one huge mesh are made again and again, and never stop anybody."""
    first = made(store, 0)
    assert first is not None
    monkeypatch.setattr(collider_store, "_MOST_BYTES", 2.5 * first.nbytes)
    assert made(store, 1) is not None and made(store, 0) is first
    assert made(store, 2) is not None and made(store, 0) is first  # 1 had not been used for longest
    assert made(store, 1) is not first and reads(store) == [0, 1, 2, 1]
    monkeypatch.setattr(collider_store, "_MOST_BYTES", first.nbytes / 2)
    assert made(store, 3) is not None and made(store, 3) is not None
    assert reads(store) == [0, 1, 2, 1, 3]
