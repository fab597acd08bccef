"""Set GL state for a `with` block; afterwards the previous state is restored, after an exception too.

No pass sets or resets GL state directly. The state that a draw needs is given by the `with` statement around it; draws
outside all blocks have the defaults of `State`.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from functools import partial
from typing import Any, NamedTuple, TypedDict, Unpack

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
        Whether back faces are culled.
    blend
        Factors of source and destination, as moderngl names them; None: no blending.
    wireframe
        Whether triangles are drawn as lines.
    direct
        Capabilities to enable that moderngl has no name for, by their GL numbers.
    depth_offset
        What is added to the depths of a polygon: as many times how much its depth changes from pixel to pixel, and as
        many of the smallest steps that depth resolves.
    """

    depth_test: str | None = None
    cull: bool = False
    blend: tuple[int, int] | None = None
    wireframe: bool = False
    direct: tuple[int, ...] = ()
    depth_offset: tuple[float, float] = (0.0, 0.0)


class Changes(TypedDict, total=False):
    """Name fields of `State` with the values that a block gives them; all may be left out."""

    depth_test: str | None
    cull: bool
    blend: tuple[int, int] | None
    wireframe: bool
    direct: tuple[int, ...]
    depth_offset: tuple[float, float]


class StateKeeper:
    """Set the state of one context and track it; GL itself is never queried, which would be slow.

    State that is set already is not set again. So other code that draws in this context must restore the flags, or
    `restore` must be called before the next block.

    Attributes
    ----------
    now
        The current state.
    """

    def __init__(self, context: moderngl.Context) -> None:
        """Start with the defaults of `State`; moderngl's `context` must have them, as a new one does."""
        self._context = context
        self._states: dict[tuple[Any, ...], State] = {}  # by the state around a block, and what the block changes
        self._calls: dict[tuple[State, State], list[tuple[Callable[[Any], None], Any]]] = {}  # that change one to other
        self.now = State()

    def changed(
        self,
        into: moderngl.Framebuffer | None = None,
        *,
        depth_write: bool = True,
        **changes: Unpack[Changes],
    ) -> AbstractContextManager[None]:
        """Set GL state for a `with` block; anything not named here stays as it is around the block.

        Parameters
        ----------
        into
            The framebuffer to draw into, which stays bound after the block; None leaves it as it is.
        depth_write
            Whether draws write the framebuffer's depth, where there is a depth test.
        **changes
            Fields of `State` with their new values.
        """
        key = self.now, *changes.items()
        state = self._states.get(key)
        if state is None:
            state = self._states[key] = self.now._replace(**changes)
        return _Block(self, state, into, depth_write)

    def restore(self) -> None:
        """Set the flags of the current state again, as other code may have changed them outside all blocks."""
        self._context.enable_only(_flags(self.now))

    def set(self, state: State) -> None:
        """Switch the context to `state`, with as few GL calls as possible."""
        before, self.now = self.now, state
        if state is before:
            return
        change = before, state
        if change not in self._calls:
            self._calls[change] = list(self._calls_for(before, state))
        for call, value in self._calls[change]:
            call(value)

    def _calls_for(self, before: State, state: State) -> Iterator[tuple[Callable[[Any], None], Any]]:
        """Yield what switches the context from one state to another: functions, each with its argument."""
        context = self._context
        was, wanted = _flags(before), _flags(state)
        if was & ~wanted:
            yield context.disable, was & ~wanted
        if wanted & ~was:
            yield context.enable, wanted & ~was
        if state.blend is not None and state.blend != before.blend:
            yield partial(setattr, context, "blend_func"), state.blend
        if (before.depth_test or LESS) != (state.depth_test or LESS):
            yield partial(setattr, context, "depth_func"), state.depth_test or LESS
        if before.wireframe != state.wireframe:
            yield partial(setattr, context, "wireframe"), state.wireframe
        if before.depth_offset != state.depth_offset:
            yield partial(setattr, context, "polygon_offset"), state.depth_offset
        yield from ((context.disable_direct, number) for number in before.direct if number not in state.direct)
        yield from ((context.enable_direct, number) for number in state.direct if number not in before.direct)


class _Block(AbstractContextManager[None]):
    """Hold the state of one `with` block and the state before. A generator would take twice as long to enter."""

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
    """Return moderngl's flags for what a state enables."""
    flags = moderngl.NOTHING
    if state.depth_test is not None:
        flags |= moderngl.DEPTH_TEST
    if state.cull:
        flags |= moderngl.CULL_FACE
    if state.blend is not None:
        flags |= moderngl.BLEND
    return flags
