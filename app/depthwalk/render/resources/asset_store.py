"""Keep assets on the GPU within a budget of memory.

Assets are uploaded when they are first drawn. When the budget is used up, depth objects and fallback meshes that are
not needed are evicted, the least recently used first.
"""

import logging
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.captured_views import CaptureParams
from depthwalk.cook.cook import HeldArrays
from depthwalk.gpu.device import Device
from depthwalk.render.resources.captured_views import CapturedViewStore, ViewTextures
from depthwalk.render.resources.cooked_parts import CookedParts
from depthwalk.render.resources.depth_image_object import DepthObject, upload_depth
from depthwalk.render.resources.height_field import HeightFields
from depthwalk.render.resources.library import Background, Library
from depthwalk.render.resources.mesh_object import BYTES_PER_TRIANGLE, WHITE
from depthwalk.render.resources.mesh_store import MeshStore
from depthwalk.render.resources.texture_streaming import TextureStreaming
from depthwalk.render.resources.translucent_store import TranslucentStore
from depthwalk.scene.render_settings import DEFAULT_BUDGET
from depthwalk.types import Array

log = logging.getLogger(__name__)


class AssetStore:
    """Upload assets and own their GL objects, which several passes draw from.

    Meshes have the numbers of their assets. An asset's depth images become depth objects, one for each part of the
    asset, with the number of that part.

    Parameters
    ----------
    device
        The GPU that draws.
    library
        Provides the assets.

    Attributes
    ----------
    gl
        The scope that owns everything here.
    budget
        Bytes of GPU memory for depth objects and fallback meshes, which `stream` keeps to.
    before_release
        Called before GL objects are freed, so that passes can release their vertex arrays over them.
    parts
        The cooked parts of assets that depth objects show.
    textures
        The textures of the depth objects.
    meshes
        The store of the meshes.
    height_fields
        The height fields of planar depth images, for representations that do not warp.
    translucent
        The translucent and glowing triangles of meshes.
    background
        Loads, bakes and cooks depth images in the background; None: frames wait for them.
    """

    def __init__(self, device: Device, library: Library) -> None:
        self.gl = device.scope("assets")
        self.budget = DEFAULT_BUDGET
        self.before_release: Callable[[], None] = lambda: None
        self._library = library
        self.parts = CookedParts(library)
        self._depth: dict[int, DepthObject] = {}  # the least recently used first
        self._unlit: set[int] = set()  # of these, those that are shown without light
        self._reflecting: set[int] = set()  # and those that reflect the sky
        self._warned = False
        self._deferred = False  # whether the last frame lacks depth objects that are still to be uploaded
        self.meshes = MeshStore(self.gl, library)
        self.textures = TextureStreaming(self.gl, self.parts, self._depth, self._make_room)
        self.height_fields = HeightFields(self.gl, self.parts.baked)
        self._captured = CapturedViewStore(self.gl, library.captured_views)
        self.translucent = TranslucentStore(self.gl, library.translucent_mesh, len(library))
        self.background: Background | None = None

    def is_ready(self, asset: int) -> bool:
        """Return whether the depth images of the asset numbered `asset` can be shown; if not, start preparing them."""
        return self.background is None or self.background.is_cooked(asset, self.parts.options)

    def poll(self) -> bool:
        """Take over what the background has finished; return whether an asset can now be shown in another way."""
        if self.background is None:
            self.meshes.reader.poll()  # a mesh that was near may have moved away, so that nobody asks for it any more
            return False
        self.translucent.poll()
        made, read = self.background.poll(), self.meshes.reader.poll()
        if replaced := self.meshes.reader.take_replaced():
            self.before_release()
            self.meshes.free(replaced)
        return made or read or bool(replaced)

    @property
    def is_waiting(self) -> bool:
        """Return whether the next frame may show more than the last even if nothing in the scene changes."""
        beside = self.background is not None and self.background.is_busy
        stores = self.meshes.reader, self._captured, self.textures, self.translucent
        return self._deferred or any(store.is_busy for store in stores) or beside

    def depth_object(self, number: int) -> DepthObject:
        """Return the depth object numbered `number`, uploading it if necessary."""
        if number not in self._depth:
            grids, texture = self.parts.load(number)
            self._depth[number] = upload_depth(self.gl, self.parts.cooked(number).outline, grids)
            self.textures.begin(number, texture)
            if self._depth[number].is_unlit:
                self._unlit.add(number)
            if self._depth[number].reflects:
                self._reflecting.add(number)
        return self._depth[number]

    def captured_views(self, asset: int, params: CaptureParams) -> ViewTextures | None:
        """Return views of the mesh of the asset numbered `asset`, captured as `params` say.

        Where frames may not wait, returns None, or views captured with other params, until a thread has captured these.
        """
        return self._captured.views(asset, params, wait=self.background is None)

    def stream(self, needed: Sequence[int], seconds: float | None, *, releases: bool = True) -> NDArray[np.bool_]:
        """Upload what a frame needs, and evict the least recently used objects where the budget requires it.

        What the frame needs is never evicted; if that alone exceeds the budget, a warning is logged once.

        Parameters
        ----------
        needed
            Numbers of the depth objects that the frame needs, the most urgent first.
        seconds
            Time after which no further upload begins, to keep the frame rate even; None: all are uploaded.
        releases
            Whether other objects may be evicted. If not, objects for which there is no room are not uploaded.

        Returns
        -------
        NDArray[np.bool_]
            (len(parts),) which numbers are on the GPU; always True for assets, whose meshes are uploaded when they are
            drawn.
        """
        start = time.perf_counter()
        self._deferred = False
        for number in needed:
            if releases and number in self._depth:
                self._depth[number] = self._depth.pop(number)
        for number in needed:
            if number in self._depth:
                continue
            cooked = self.parts.cooked(number)
            if not releases and self.gpu_bytes + cooked.bytes > self.budget:
                continue
            is_held = isinstance(cooked.load, HeldArrays) and cooked.load.is_held
            # Otherwise the frame that switches from a mesh to its new depth images would show neither.
            if seconds is not None and time.perf_counter() - start > seconds and not is_held:
                self._deferred = True
                continue
            self._make_room(cooked.bytes, set(needed))
            self.depth_object(number)
        if releases:
            self._make_room(0, set(needed))  # an earlier frame may have needed more than the budget
        resident = np.ones(len(self.parts), bool)
        first = self.parts.first
        resident[first:] = [number in self._depth for number in range(first, len(self.parts))]
        return resident

    def within_budget(self, meshes: Sequence[int], triangles: Array, needed: Sequence[int]) -> list[int]:
        """Return which fallback meshes are read already, or may be because the budget has room for them.

        Parameters
        ----------
        meshes
            Numbers of the meshes, the most urgent first.
        triangles
            (len(parts),) of the mesh with each number; +inf where that is not known: then it is read if there is any
            room left.
        needed
            Numbers of the depth objects that the frame needs; others may be evicted.

        Returns
        -------
        list[int]
            Those of `meshes`, in their order.
        """
        unread = [mesh for mesh in meshes if mesh not in self.meshes.reader.meshes]
        if not unread:
            return list(meshes)
        of_images = sum(self._depth[number].bytes for number in needed if number in self._depth)
        room = float(self.budget - of_images - self.meshes.wanted_bytes)
        too_large = set()
        for mesh in unread:
            taken = BYTES_PER_TRIANGLE * triangles[mesh] if np.isfinite(triangles[mesh]) else 0.0
            if room <= 0 or taken > room:
                too_large.add(mesh)
            else:
                room -= taken
        return [mesh for mesh in meshes if mesh not in too_large]

    @property
    def gpu_bytes(self) -> int:
        """Return how many bytes of GPU memory depth objects, fallback meshes and captured views take."""
        drawn = sum([drawn.bytes for drawn in self._depth.values()])
        others = self.meshes.fallback_bytes, self.height_fields.bytes, self._captured.bytes, self.translucent.bytes
        return drawn + sum(others)

    @property
    def has_unlit(self) -> bool:
        """Return whether anything that is on the GPU is shown without light."""
        return bool(self._unlit) or self.meshes.has_unlit or self._captured.has_unlit

    @property
    def reflects(self) -> bool:
        """Return whether anything that is on the GPU reflects the sky."""
        return bool(self._reflecting) or self.meshes.reflects or self._captured.reflects

    @property
    def depth_count(self) -> int:
        """Return how many depth objects are on the GPU."""
        return len(self._depth)

    def _make_room(self, size: int, needed: set[int]) -> None:
        """Evict what is not `needed` until `size` more bytes fit into the budget, or nothing is left to evict."""
        if self.gpu_bytes + size <= self.budget:
            return
        unused, unwanted = [number for number in self._depth if number not in needed], self.meshes.unwanted_fallbacks
        if unused or unwanted:
            self.before_release()
        self.meshes.release_fallbacks(unwanted)
        excess = self.gpu_bytes + size - self.budget
        for number in unused:
            if excess <= 0:
                return
            excess -= self._depth[number].bytes
            self._free(number)
        if excess > 0 and not self._warned:
            self._warned = True
            log.warning(
                "the visible assets need more GPU memory than the %d MB of render.gpu_memory", self.budget / 1e6
            )

    def _free(self, number: int) -> None:
        """Free all of depth object `number`."""
        self.gl.free(*self._depth.pop(number).owned)
        self._unlit.discard(number)
        self._reflecting.discard(number)
        self.textures.forget(number)
        self.height_fields.free(number)

    def texture(self, path: Path | None) -> NDArray[np.uint8]:
        """Return the texels of an image file.

        Parameters
        ----------
        path
            The file; None: no image.

        Returns
        -------
        NDArray[np.uint8]
            (H, W, 4) sRGB and alpha, top row first; one white texel where there is no image.
        """
        return WHITE if path is None else self._library.texture(path)

    def release(self) -> None:
        """Free all GL objects and drop cooked data; assets that are drawn later are uploaded again."""
        self.before_release()
        self.gl.release()
        self.textures.release()
        self._depth.clear()
        self._unlit.clear()
        self._reflecting.clear()
        self.parts.forget()
        self.meshes.forget()
        self.height_fields.forget()
        self._captured.forget()
        self.translucent.forget()
