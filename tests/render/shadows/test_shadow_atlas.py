"""Which maps are drawn again, and that the atlas owns one texture."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import cast

import pytest

from depthwalk.gpu.device import Device
from depthwalk.render.shadows.casters import ShadowMap
from depthwalk.render.shadows.shadow_atlas import ShadowAtlas


@dataclass(frozen=True)
class Shown:
    """A map that is as good as another where only its version differs by one."""

    content: int
    may_follow: bool = True
    place: int = 0
    provisional: bool = False

    def shows_same(self, other: "Shown") -> bool:
        return (self.content, self.place) == (other.content, other.place)

    def sees_same(self, other: "Shown") -> bool:
        return self.place == other.place

    def follows(self, before: "Shown", from_afar: bool = False) -> bool:
        return self.may_follow or from_afar


@pytest.fixture
def atlas(gl_device: Device) -> Iterator[ShadowAtlas]:
    scope = gl_device.scope("test")
    atlas = ShadowAtlas(scope, columns=2)
    yield atlas
    atlas.release()
    assert not scope._objects


def shown(content: int, may_follow: bool = True, place: int = 0, provisional: bool = False) -> ShadowMap:
    return cast(ShadowMap, Shown(content, may_follow, place, provisional))


def drawn(atlas: ShadowAtlas, maps: Mapping[int, ShadowMap]) -> list[int]:
    for tile, shadow_map in maps.items():
        atlas.begin(tile, shadow_map)
    return sorted(maps)


def due(atlas: ShadowAtlas, wanted: Mapping[int, ShadowMap]) -> dict[int, ShadowMap]:
    """What a frame draws that finishes one map of those that may wait."""
    later = list(atlas.waiting(atlas.stale(wanted)))
    return {tile: shadow_map for tile, shadow_map in atlas.stale(wanted).items() if tile not in later[1:]}


def test_only_maps_that_changed_are_stale(atlas: ShadowAtlas) -> None:
    atlas.fit(3, 8)
    wanted = {0: shown(1), 1: shown(2), 2: shown(3)}
    assert drawn(atlas, atlas.stale(wanted)) == [0, 1, 2] and not atlas.stale(wanted)
    assert sorted(atlas.stale(wanted | {1: shown(5)})) == [1]
    atlas.forget()
    assert sorted(atlas.stale(wanted)) == [0, 1, 2]


def test_farther_maps_take_turns(atlas: ShadowAtlas) -> None:
    """The nearest is drawn whenever its objects change, and of those that can wait the one drawn longest ago."""
    atlas.fit(4, 8)
    drawn(atlas, due(atlas, {tile: shown(0) for tile in range(4)}))
    turns = [drawn(atlas, due(atlas, {tile: shown(frame) for tile in range(4)})) for frame in range(1, 5)]
    assert turns == [[0, 1], [0, 2], [0, 3], [0, 1]]
    assert [cast(Shown, atlas.shown(tile)).content for tile in range(4)] == [4, 4, 2, 3]
    cannot_wait = {tile: shown(9, may_follow=False) for tile in range(4)}
    assert sorted(due(atlas, cannot_wait)) == [0, 1, 2, 3]


def test_maps_that_only_moved_take_turns_and_so_does_the_nearest(atlas: ShadowAtlas) -> None:
    atlas.fit(3, 8)
    drawn(atlas, due(atlas, {tile: shown(0) for tile in range(3)}))
    moved = {tile: shown(1, place=1) for tile in range(3)}
    assert [drawn(atlas, due(atlas, moved)) for _ in range(4)] == [[0], [1], [2], []]
    assert drawn(atlas, due(atlas, {0: shown(2, place=1), 1: shown(2, place=2), 2: shown(1, place=1)})) == [0, 1]
    elsewhere = {tile: shown(2, may_follow=False, place=9) for tile in range(3)}
    assert sorted(due(atlas, elsewhere)) == [0, 1, 2]


def test_where_somebody_moves_only_the_farthest_must_reach_him(atlas: ShadowAtlas) -> None:
    atlas.fit(3, 8)
    drawn(atlas, due(atlas, {tile: shown(0) for tile in range(3)}))
    elsewhere = atlas.stale({tile: shown(0, may_follow=False, place=9) for tile in range(3)})
    assert not atlas.waiting(elsewhere) and list(atlas.waiting(elsewhere, last=2)) == [0, 1]


def test_the_nearest_takes_turns_too_where_it_is_provisional(atlas: ShadowAtlas) -> None:
    atlas.fit(3, 8)
    drawn(atlas, due(atlas, {tile: shown(0, provisional=True) for tile in range(3)}))
    assert [drawn(atlas, due(atlas, {tile: shown(1) for tile in range(3)})) for _ in range(4)] == [[0], [1], [2], []]
    assert drawn(atlas, due(atlas, {tile: shown(2) for tile in range(3)})) == [0, 1]


def test_a_provisional_map_that_looks_as_it_should_is_none_any_more(atlas: ShadowAtlas) -> None:
    atlas.fit(2, 8)
    drawn(atlas, due(atlas, {tile: shown(0, provisional=True) for tile in range(2)}))
    assert not atlas.stale({tile: shown(0) for tile in range(2)})
    assert list(atlas.waiting(atlas.stale({tile: shown(1) for tile in range(2)}))) == [1]


def test_another_size_is_another_texture_and_forgets_its_maps(atlas: ShadowAtlas, gl_device: Device) -> None:
    before = gl_device.live["texture"]
    texture = atlas.fit(3, 8)
    assert texture.size == (16, 16) and atlas.fit(3, 8) is texture and atlas.fit(4, 8) is texture
    drawn(atlas, {0: shown(1)})
    assert atlas.fit(3, 16).size == (32, 32) and sorted(atlas.stale({0: shown(1)})) == [0]
    assert atlas.fit(1, 16).size == (16, 16)
    assert gl_device.live["texture"] == before + 1


def test_nothing_is_drawn_before_there_is_a_texture(atlas: ShadowAtlas) -> None:
    with pytest.raises(ValueError, match="no texture"):
        atlas.begin(0, (shown(1)))
