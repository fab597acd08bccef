"""Set GL state for as long as a `with` block lasts; afterwards it is what it was before, after an exception too.

No pass sets GL state by hand or resets it. What a draw needs stands in the `with` statement around it, and draws
outside all blocks find the defaults of `State`.
"""

from contextlib import AbstractContextManager
from typing import NamedTuple, TypedDict, Unpack

import moderngl

LESS = "<"  # depth functions, as moderngl names them
ALWAYS = "1"


class State(NamedTuple):
    """Hold the GL state that may differ from draw to draw. Counter-clockwise faces are front faces.

    Attributes
    ----------
    depth_test
        How a fragment's depth must compare with the depth buffer's, as moderngl names it; None: no test, and depth is
        not written.
    cull
        Whether back faces are left out.
    blend
        Factors of source and destination, as moderngl names them; None: no blending.
    wireframe
        Whether triangles are drawn as lines.
    direct
        The capabilities to enable that moderngl has no name for, as GL numbers them.
    """

    depth_test: str | None = None
    cull: bool = False
    blend: tuple[int, int] | None = None
    wireframe: bool = False
    direct: tuple[int, ...] = ()


class Changes(TypedDict, total=False):
    """Name fields of `State` with the values that a block gives them; all may be left out."""

    depth_test: str | None
    cull: bool
    blend: tuple[int, int] | None
    wireframe: bool
    direct: tuple[int, ...]


class StateKeeper:
    """Set the state of one context and remember it; GL itself is never asked, which would be slow.

    What is set already is not set again. So whoever else draws in this context must leave flags as they were, or
    `restore` is called before the next block.

    Attributes
    ----------
    now
        The state at the moment.
    """

    def __init__(self, context: moderngl.Context) -> None:
        """Begin with the defaults of `State`, in which moderngl's `context` must be, as a new one is."""
        self._context = context
        self.now = State()

    def changed(
        self,
        into: moderngl.Framebuffer | None = None,
        *,
        depth_write: bool = True,
        **changes: Unpack[Changes],
    ) -> AbstractContextManager[None]:
        """Set GL state for as long as a `with` block lasts; what is not named here stays as it is around the block.

        Parameters
        ----------
        into
            The framebuffer to draw into, which stays bound after the block; None leaves it as it is.
        depth_write
            Whether draws write the framebuffer's depth, where there is a depth test.
        **changes
            Fields of `State` with their new values.
        """
        return _Block(self, self.now._replace(**changes), into, depth_write)

    def restore(self) -> None:
        """Set the tests and steps of the present state anew: others may have changed them outside all blocks."""
        self._context.enable_only(_flags(self.now))

    def set(self, state: State) -> None:
        """Make `state` the context's, with as few GL calls as that takes."""
        before, self.now, context = self.now, state, self._context
        if state == before:
            return
        was, wanted = _flags(before), _flags(state)
        if was & ~wanted:
            context.disable(was & ~wanted)
        if wanted & ~was:
            context.enable(wanted & ~was)
        if state.blend is not None and state.blend != before.blend:
            context.blend_func = state.blend
        if (before.depth_test or LESS) != (state.depth_test or LESS):
            context.depth_func = state.depth_test or LESS
        if before.wireframe != state.wireframe:
            context.wireframe = state.wireframe
        for capability in before.direct:
            if capability not in state.direct:
                context.disable_direct(capability)
        for capability in state.direct:
            if capability not in before.direct:
                context.enable_direct(capability)


class _Block(AbstractContextManager[None]):
    """Hold the state of one `with` block, and what it was before. A generator would take twice as long to enter."""

    __slots__ = ("_before", "_changes_mask", "_depth_write", "_into", "_keeper", "_state")

    def __init__(self, keeper: StateKeeper, state: State, into: moderngl.Framebuffer | None, depth_write: bool) -> None:
        self._keeper, self._state, self._into, self._depth_write = keeper, state, into, depth_write

    def __enter__(self) -> None:
        into = self._into
        self._before = self._keeper.now
        if into is not None:
            self._changes_mask = into.depth_mask != self._depth_write
            if self._changes_mask:
                into.depth_mask = self._depth_write
            into.use()
        self._keeper.set(self._state)

    def __exit__(self, *error: object) -> None:
        if self._into is not None and self._changes_mask:
            self._into.depth_mask = not self._depth_write
        self._keeper.set(self._before)


def _flags(state: State) -> int:
    """Return what moderngl calls the tests and steps that a state switches on."""
    flags = moderngl.NOTHING
    if state.depth_test is not None:
        flags |= moderngl.DEPTH_TEST
    if state.cull:
        flags |= moderngl.CULL_FACE
    if state.blend is not None:
        flags |= moderngl.BLEND
    return flags
