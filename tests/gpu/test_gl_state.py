"""GL state for a block: what is set, and that it is what it was before."""

from types import SimpleNamespace

import moderngl
import pytest

from depthwalk.gpu.state import ALWAYS, State, StateKeeper


class Recorded:
    """A context that remembers what it was told."""

    def __init__(self):
        self.flags, self.direct = None, set()
        self.depth_func, self.wireframe, self.blend_func = "<", False, None

    def enable_only(self, flags):
        self.flags = flags

    def enable_direct(self, capability):
        self.direct.add(capability)

    def disable_direct(self, capability):
        self.direct.remove(capability)


def framebuffer():
    bound = []
    return SimpleNamespace(depth_mask=True, color_mask=(True,) * 4, use=lambda: bound.append(1), bound=bound)


def test_a_block_sets_what_it_names_and_keeps_what_is_around_it():
    context = Recorded()
    keeper = StateKeeper(context)
    with keeper.changed(depth_test=ALWAYS, cull=True, direct=(7, 8)):
        assert context.flags == moderngl.DEPTH_TEST | moderngl.CULL_FACE and context.depth_func == ALWAYS
        with keeper.changed(blend=(1, 1), cull=False, wireframe=True, direct=(8, 9)):
            assert context.flags == moderngl.DEPTH_TEST | moderngl.BLEND and context.blend_func == (1, 1)
            assert context.wireframe and context.direct == {8, 9}
        assert context.flags == moderngl.DEPTH_TEST | moderngl.CULL_FACE
        assert not context.wireframe and context.direct == {7, 8}
    assert keeper.now == State() and context.flags == moderngl.NOTHING
    assert context.depth_func == "<" and not context.direct


def test_state_is_restored_after_an_exception():
    context, target = Recorded(), framebuffer()
    keeper = StateKeeper(context)
    with pytest.raises(RuntimeError), keeper.changed(target, depth_write=False, cull=True):
        assert target.depth_mask is False and target.bound
        raise RuntimeError
    assert keeper.now == State() and context.flags == moderngl.NOTHING and target.depth_mask is True


def test_masks_are_those_of_the_framebuffer_again():
    target = framebuffer()
    with StateKeeper(Recorded()).changed(target, colour_mask=(True, False, False, True)):
        assert target.color_mask == (True, False, False, True)
    assert target.color_mask == (True,) * 4


def test_unknown_state_is_an_error_and_changes_nothing():
    context = Recorded()
    keeper = StateKeeper(context)
    with pytest.raises(TypeError), keeper.changed(culling=True):
        pass
    assert keeper.now == State()
