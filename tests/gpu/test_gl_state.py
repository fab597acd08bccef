"""GL state for a block: what is set, and that it is what it was before."""

from typing import cast

import moderngl
import pytest

from depthwalk.gpu.state import ALWAYS, State, StateKeeper


class Recorded:
    """A context that remembers what it was told."""

    def __init__(self) -> None:
        self.flags = 0
        self.direct: set[int] = set()
        self.depth_func, self.wireframe = "<", False
        self.blend_func: tuple[int, int] | None = None
        self.polygon_offset = 0.0, 0.0

    def enable_only(self, flags: int) -> None:
        self.flags = flags

    def enable(self, flags: int) -> None:
        assert not self.flags & flags, "set already"
        self.flags |= flags

    def disable(self, flags: int) -> None:
        assert self.flags & flags == flags, "not set"
        self.flags &= ~flags

    def enable_direct(self, capability: int) -> None:
        self.direct.add(capability)

    def disable_direct(self, capability: int) -> None:
        self.direct.remove(capability)


class Target:
    """A framebuffer that counts how often it was bound."""

    def __init__(self) -> None:
        self.depth_mask, self.bound = True, 0

    def use(self) -> None:
        self.bound += 1


def keeper_of(context: Recorded) -> StateKeeper:
    return StateKeeper(cast(moderngl.Context, context))


def test_a_block_sets_what_it_names_and_keeps_what_is_around_it() -> None:
    context = Recorded()
    keeper = keeper_of(context)
    with keeper.changed(depth_test=ALWAYS, cull=True, direct=(7, 8), depth_offset=(-1.0, -2.0)):
        assert context.flags == moderngl.DEPTH_TEST | moderngl.CULL_FACE and context.depth_func == ALWAYS
        with keeper.changed(blend=(1, 1), cull=False, wireframe=True, direct=(8, 9)):
            assert context.flags == moderngl.DEPTH_TEST | moderngl.BLEND and context.blend_func == (1, 1)
            assert context.wireframe and context.direct == {8, 9} and context.polygon_offset == (-1.0, -2.0)
        assert context.flags == moderngl.DEPTH_TEST | moderngl.CULL_FACE
        assert not context.wireframe and context.direct == {7, 8}
    assert keeper.now == State() and context.flags == moderngl.NOTHING
    assert context.depth_func == "<" and not context.direct and context.polygon_offset == (0.0, 0.0)


def test_state_is_restored_after_an_exception() -> None:
    context, target = Recorded(), Target()
    keeper = keeper_of(context)
    with pytest.raises(RuntimeError), keeper.changed(cast(moderngl.Framebuffer, target), depth_write=False, cull=True):
        assert target.depth_mask is False and target.bound
        raise RuntimeError
    assert keeper.now == State() and context.flags == moderngl.NOTHING and target.depth_mask is True


def test_unknown_state_is_an_error_and_changes_nothing() -> None:
    context = Recorded()
    keeper = keeper_of(context)
    with pytest.raises(ValueError), keeper.changed(culling=True):  # type: ignore[call-arg]
        pass
    assert keeper.now == State()


def test_flags_that_others_have_changed_are_restored() -> None:
    context = Recorded()
    keeper = keeper_of(context)
    with keeper.changed(cull=True):
        context.flags = moderngl.BLEND
        keeper.restore()
        assert context.flags == moderngl.CULL_FACE
    assert context.flags == moderngl.NOTHING
