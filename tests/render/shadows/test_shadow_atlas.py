"""Which maps are drawn again, and that the atlas owns one texture."""

from dataclasses import dataclass

import pytest

from depthwalk.render.shadows.shadow_atlas import ShadowAtlas


@dataclass(frozen=True)
class Shown:
    """A map that is as good as another where only its version differs by one."""

    content: int
    may_follow: bool = True

    def shows_same(self, other):
        return self.content == other.content

    def follows(self, before):
        return self.may_follow


@pytest.fixture
def atlas(gl_device):
    scope = gl_device.scope("test")
    atlas = ShadowAtlas(scope, columns=2)
    yield atlas
    atlas.release()
    assert not scope._objects


def drawn(atlas, maps):
    for tile, shown in maps.items():
        atlas.begin(tile, shown)
    return sorted(maps)


def test_only_maps_that_changed_are_stale(atlas):
    atlas.fit(3, 8)
    wanted = {0: Shown(1), 1: Shown(2), 2: Shown(3)}
    assert drawn(atlas, atlas.stale(wanted)) == [0, 1, 2] and not atlas.stale(wanted)
    assert sorted(atlas.stale(wanted | {1: Shown(5)})) == [1]
    atlas.forget()
    assert sorted(atlas.stale(wanted)) == [0, 1, 2]


def test_farther_maps_take_turns(atlas):
    """The nearest is always drawn, and of those that can wait the one drawn longest ago."""
    atlas.fit(4, 8)
    drawn(atlas, atlas.due({tile: Shown(0) for tile in range(4)}))
    turns = [drawn(atlas, atlas.due({tile: Shown(frame) for tile in range(4)})) for frame in range(1, 5)]
    assert turns == [[0, 1], [0, 2], [0, 3], [0, 1]]
    assert [atlas.shown(tile).content for tile in range(4)] == [4, 4, 2, 3]
    cannot_wait = {tile: Shown(9, may_follow=False) for tile in range(4)}
    assert sorted(atlas.due(cannot_wait)) == [0, 1, 2, 3]


def test_another_size_is_another_texture_and_forgets_its_maps(atlas, gl_device):
    before = gl_device.live["texture"]
    texture = atlas.fit(3, 8)
    assert texture.size == (16, 16) and atlas.fit(3, 8) is texture and atlas.fit(4, 8) is texture
    drawn(atlas, {0: Shown(1)})
    assert atlas.fit(3, 16).size == (32, 32) and sorted(atlas.stale({0: Shown(1)})) == [0]
    assert atlas.fit(1, 16).size == (16, 16)
    assert gl_device.live["texture"] == before + 1


def test_nothing_is_drawn_before_there_is_a_texture(atlas):
    with pytest.raises(ValueError, match="no texture"):
        atlas.begin(0, Shown(1))
