"""Set GL state for as long as a `with` block lasts; afterwards it is what it was before, after an exception too.

No pass sets GL state by hand or resets it. What a draw needs stands in the `with` statement around it, and draws
outside all blocks find the defaults of `State`.
"""

from collections.abc import Iterator
from contextlib import contextmanager
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

    Attributes
    ----------
    now
        The state at the moment.
    """

    def __init__(self, context: moderngl.Context) -> None:
        """Begin with the defaults of `State`, in which moderngl's `context` must be, as a new one is."""
        self._context = context
        self.now = State()

    @contextmanager
    def changed(
        self,
        into: moderngl.Framebuffer | None = None,
        *,
        depth_write: bool = True,
        **changes: Unpack[Changes],
    ) -> Iterator[None]:
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
        before = self.now
        wrote_depth = into is None or into.depth_mask
        try:
            self._set(before._replace(**changes))
            if into is not None:
                into.depth_mask = depth_write
                into.use()
            yield
        finally:
            if into is not None:
                into.depth_mask = wrote_depth
            self._set(before)

    def _set(self, state: State) -> None:
        """Make `state` the context's, with as few GL calls as that takes."""
        before, self.now, context = self.now, state, self._context
        flags = moderngl.NOTHING
        if state.depth_test is not None:
            flags |= moderngl.DEPTH_TEST
        if state.cull:
            flags |= moderngl.CULL_FACE
        if state.blend is not None:
            flags |= moderngl.BLEND
            context.blend_func = state.blend
        context.enable_only(flags)  # always: others, as the panel, may have set flags of their own
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
