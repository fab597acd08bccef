"""GL state that lasts as long as a `with` block, and is then again what it was before, after an exception too."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TypedDict, Unpack

import moderngl

LESS = "<"  # depth functions, as moderngl names them
ALWAYS = "1"

ColourMask = tuple[bool, bool, bool, bool]


@dataclass(frozen=True, kw_only=True)
class State:
    """What may differ from draw to draw. Outside all blocks: the defaults here; counter-clockwise faces are front.

    depth_test: how a fragment's depth must compare with what is there, None: no test, and depth is not written; cull:
    back faces are left out; blend: factors of source and destination, None: no blending; wireframe: triangles as lines;
    direct: capabilities that moderngl has no name for, as GL numbers them.
    """

    depth_test: str | None = None
    cull: bool = False
    blend: tuple[int, int] | None = None
    wireframe: bool = False
    direct: tuple[int, ...] = ()


class Changes(TypedDict, total=False):
    """The fields of `State` that a block changes."""

    depth_test: str | None
    cull: bool
    blend: tuple[int, int] | None
    wireframe: bool
    direct: tuple[int, ...]


class StateKeeper:
    """The state of one context, as far as it was set through this: GL itself is never asked."""

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self.now = State()

    @contextmanager
    def changed(
        self,
        into: moderngl.Framebuffer | None = None,
        *,
        depth_write: bool = True,
        colour_mask: ColourMask | None = None,
        **changes: Unpack[Changes],
    ) -> Iterator[None]:
        """Set what is named for as long as the block lasts; what is not named stays as it is around it.

        Parameters
        ----------
        into : the framebuffer to draw into, which stays bound after the block.
        depth_write : whether its depth is written, where there is a test.
        colour_mask : which of red, green, blue and alpha are written into its one texture; None: all.
        changes : fields of `State`.
        """
        before = self.now
        masks = (into.depth_mask, into.color_mask) if into is not None else None
        try:
            self._set(replace(before, **changes))
            if into is not None:
                into.depth_mask = depth_write
                if colour_mask is not None:
                    into.color_mask = colour_mask
                into.use()
            yield
        finally:
            if into is not None and masks is not None:
                into.depth_mask = masks[0]
                if colour_mask is not None:
                    into.color_mask = masks[1]
            self._set(before)

    def _set(self, state: State) -> None:
        before, self.now, context = self.now, state, self._context
        flags = moderngl.NOTHING
        if state.depth_test is not None:
            flags |= moderngl.DEPTH_TEST
        if state.cull:
            flags |= moderngl.CULL_FACE
        if state.blend is not None:
            flags |= moderngl.BLEND
            context.blend_func = state.blend
        context.enable_only(flags)  # whatever others may have set, as the panel does
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
