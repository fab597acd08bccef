"""Stream the virtual textures of depth objects, at the resolution that their pixels need, in the background."""

import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple

from depthwalk.cook.texture_detail import Detail, at_detail, can_leave_out, detail_for
from depthwalk.cook.virtual_texture import VirtualTexture
from depthwalk.gpu.device import Scope
from depthwalk.render.resources.cooked_parts import CookedParts
from depthwalk.render.resources.depth_image_object import DepthObject
from depthwalk.render.resources.surface_texture import texture_bytes, upload_texture
from depthwalk.types import Array

_LASTING = 1.25  # hysteresis: a texture is reduced only if pixels are larger than it needs by this factor


class _Reading(NamedTuple):
    """Hold a texture that a thread is loading, and which part of the whole texture it will be."""

    detail: Detail
    texture: Future[VirtualTexture]


class TextureStreaming:
    """Upload the textures of depth objects, and replace those that are finer or coarser than their pixels need.

    Small textures are uploaded whole, and stay so. Depth objects have the numbers of their parts, see `CookedParts`.

    Parameters
    ----------
    gl
        The scope of the asset store, which owns the GL objects.
    parts
        Provides the textures.
    objects
        The depth objects on the GPU, by number; kept up to date by the asset store.
    make_room
        Evicts depth objects until as many bytes fit into the budget, but none whose number is in the set.
    """

    def __init__(
        self,
        gl: Scope,
        parts: CookedParts,
        objects: Mapping[int, DepthObject],
        make_room: Callable[[int, set[int]], None],
    ) -> None:
        self._gl, self._parts, self._objects, self._make_room = gl, parts, objects, make_room
        self._whole: dict[int, VirtualTexture] = {}  # of depth objects that have no texture yet
        self._texels: dict[int, int] = {}  # in the whole textures of objects that may have a part of theirs on the GPU
        self._reading: dict[int, _Reading] = {}
        self._threads: ThreadPoolExecutor | None = None  # a single thread, created on first use

    @property
    def has_partial(self) -> bool:
        """Return whether any depth object on the GPU may have a part of its texture only."""
        return bool(self._texels)

    @property
    def is_busy(self) -> bool:
        """Return whether a texture is being read to replace another."""
        return bool(self._reading)

    def begin(self, number: int, texture: VirtualTexture) -> None:
        """Upload the `texture` of a new depth object if it is small; otherwise `fit` chooses which part is needed."""
        if can_leave_out(texture):
            self._whole[number] = texture
            self._texels[number] = texture.normals[..., 0].size
        else:
            drawn = self._objects[number]
            drawn.show_texture(self._gl, upload_texture(self._gl, texture, Detail.FULL, drawn.tells_roughness))

    def fit(
        self,
        numbers: Sequence[int],
        footprint: Array,
        seconds: float | None,
        *,
        exact: bool = False,
        changes: bool = True,
    ) -> None:
        """Upload each object's texture at the resolution that its pixels need.

        Textures change in steps, see `Detail`. While there is no time, the texture on the GPU stays in use; it may be
        coarser than needed, but never missing.

        Parameters
        ----------
        numbers
            Numbers of the depth objects that the frame shows, all of them uploaded.
        footprint
            (n,) the least length that a pixel covers on each object, metres, object frame.
        seconds
            Time after which no further texture is uploaded; a thread reads textures in the background. None: all have
            the resolution that they need when this returns.
        exact
            Whether no texture may be finer than needed, so that pictures do not depend on earlier ones. Otherwise
            textures are reduced only when the viewer is clearly farther away, lest they change back and forth.
        changes
            Whether textures that are on the GPU may be replaced. If not, only objects without a texture get one.
        """
        start, shown = time.perf_counter(), set(numbers)

        def is_late() -> bool:
            return seconds is not None and time.perf_counter() - start > seconds

        for number, size in zip(numbers, footprint.tolist(), strict=True):
            if number not in self._texels:
                continue
            drawn = self._objects[number]
            covered = size * drawn.least_texels
            wanted, lasting = (detail_for(c, self._texels[number]) for c in (covered, covered / _LASTING))
            if drawn.texture is None:
                self._show(number, Detail.QUARTER if is_late() else wanted, shown)
            elif not changes:
                continue
            elif seconds is None and (drawn.texture.detail > wanted or (exact and drawn.texture.detail != wanted)):
                self._show(number, wanted, shown)
            elif not lasting <= drawn.texture.detail <= wanted or number in self._reading:
                self._change_beside(number, wanted, is_late(), shown)
        self._whole.clear()

    def forget(self, number: int) -> None:
        """Drop the texture of depth object `number`, whose GL objects are freed with the object."""
        for kept in self._whole, self._reading, self._texels:
            kept.pop(number, None)

    def release(self) -> None:
        """End the thread and drop all textures, whose GL objects are freed with those of the asset store."""
        if self._threads is not None:
            self._threads.shutdown(cancel_futures=True)
        self._threads = None
        for kept in self._whole, self._reading, self._texels:
            kept.clear()

    def _change_beside(self, number: int, wanted: Detail, is_late: bool, needed: set[int]) -> None:
        """Let a thread read the texture of depth object `number`, and upload it in a later frame that is not late.

        needed: numbers of the depth objects that must not be evicted for it.
        """
        if number not in self._reading:
            load, threads = self._parts.cooked(number).load, self._threads or ThreadPoolExecutor(1, "textures")
            self._threads = threads
            self._reading[number] = _Reading(wanted, threads.submit(lambda: at_detail(load()[1], wanted)))
        elif self._reading[number].texture.done() and not is_late:
            reading = self._reading.pop(number)
            if reading.detail != wanted:
                return
            try:
                texture = reading.texture.result()
            except OSError:  # as in `CookedParts.load`
                texture = at_detail(self._parts.load(number)[1], wanted)
            self._replace(number, texture, wanted, needed)

    def _show(self, number: int, detail: Detail, needed: set[int]) -> None:
        """Upload the texture of depth object `number` at `detail` at once. needed: objects that must not be evicted."""
        whole = self._whole[number] if number in self._whole else self._parts.load(number)[1]
        self._replace(number, at_detail(whole, detail), detail, needed)

    def _replace(self, number: int, texture: VirtualTexture, detail: Detail, needed: set[int]) -> None:
        drawn = self._objects[number]
        drawn.free_texture(self._gl)
        self._make_room(texture_bytes(texture, drawn.tells_roughness), needed)
        drawn.show_texture(self._gl, upload_texture(self._gl, texture, detail, drawn.tells_roughness))
