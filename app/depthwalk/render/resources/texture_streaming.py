"""Give depth objects as much of their virtual textures as their pixels show, and change it beside the frames."""

import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple

from depthwalk.cook.texture_detail import Detail, at_detail, can_leave_out, detail_for
from depthwalk.cook.virtual_texture import VirtualTexture
from depthwalk.gpu.device import Scope
from depthwalk.render.resources.cooked_parts import CookedParts
from depthwalk.render.resources.depth_image_object import DepthObject
from depthwalk.render.resources.surface_texture import upload_texture
from depthwalk.types import Array

_LASTING = 1.25  # a texture loses texels only where pixels cover so many times as many as would be enough


class _Reading(NamedTuple):
    """Hold a texture that a thread makes ready, and how much of the whole texture it will be."""

    detail: Detail
    texture: Future[VirtualTexture]


class TextureStreaming:
    """Upload the textures of depth objects, and replace those of which pixels show less, or more, than is there.

    Small textures are uploaded whole, and stay so. Depth objects have the numbers of their parts, see `CookedParts`.

    Parameters
    ----------
    gl
        The scope of the asset store, which owns the GL objects.
    parts
        Where textures come from.
    objects
        The depth objects on the GPU, by number; kept up to date by the asset store.
    make_room
        Releases depth objects until as many bytes fit into the budget, but none whose number is in the set.
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
        self._texels: dict[int, int] = {}  # of the whole textures that may be on the GPU in part
        self._reading: dict[int, _Reading] = {}
        self._threads: ThreadPoolExecutor | None = None  # one, made when it is first needed

    @property
    def has_partial(self) -> bool:
        """Return whether any depth object was uploaded of which some texels may be left out."""
        return bool(self._texels)

    @property
    def is_busy(self) -> bool:
        """Return whether a texture is still being read, to take the place of another."""
        return bool(self._reading)

    def begin(self, number: int, texture: VirtualTexture) -> None:
        """Upload the whole `texture` of a new depth object, or wait until `fit` knows how much of it is needed."""
        if can_leave_out(texture):
            self._whole[number] = texture
            self._texels[number] = texture.normals[..., 0].size
        else:
            self._objects[number].texture = upload_texture(self._gl, texture, Detail.FULL)

    def fit(
        self,
        numbers: Sequence[int],
        footprint: Array,
        seconds: float | None,
        *,
        exact: bool = False,
        changes: bool = True,
    ) -> None:
        """Upload as much of each object's texture as its pixels show, and no more.

        Textures are changed in steps, see `Detail`. Where there is no time, what is on the GPU is shown on: coarser
        texels than there might be, but never none.

        Parameters
        ----------
        numbers
            Numbers of the depth objects that the frame shows, all of them uploaded.
        footprint
            (n,) the least length that a pixel covers on each object, metres, object frame.
        seconds
            Time after which no further texture is uploaded; a thread reads textures beside the frames. None: all have
            what they need when this returns.
        exact
            Whether no texture may have more than it needs, so that pictures do not depend on those before. Otherwise it
            keeps that while the viewer is not much farther away, lest it come and go.
        changes
            Whether textures that are on the GPU may be replaced. If not, only what has none gets one.
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
        """Forget the texture of depth object `number`, whose GL objects are freed with it."""
        for kept in self._whole, self._reading, self._texels:
            kept.pop(number, None)

    def release(self) -> None:
        """End the thread and forget all textures, whose GL objects are freed with those of the asset store."""
        if self._threads is not None:
            self._threads.shutdown(cancel_futures=True)
        self._threads = None
        for kept in self._whole, self._reading, self._texels:
            kept.clear()

    def _change_beside(self, number: int, wanted: Detail, is_late: bool, needed: set[int]) -> None:
        """Have a thread read the texture of depth object `number`; upload it in a later frame, unless that `is_late`.

        needed: numbers of the depth objects that must not give way to it.
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
        """Give depth object `number` a texture of `detail` at once. needed: numbers of what must not give way to it."""
        whole = self._whole[number] if number in self._whole else self._parts.load(number)[1]
        self._replace(number, at_detail(whole, detail), detail, needed)

    def _replace(self, number: int, texture: VirtualTexture, detail: Detail, needed: set[int]) -> None:
        drawn = self._objects[number]
        if drawn.texture is not None:
            self._gl.free(*drawn.texture.owned)
            drawn.texture = None
        self._make_room(texture.table.nbytes + texture.bytes_with_mip_maps, needed)
        drawn.texture = upload_texture(self._gl, texture, detail)
