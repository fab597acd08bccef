"""Keep assets on the GPU within a budget of memory.

Assets are uploaded when they are first drawn. Depth objects, and the meshes that are drawn instead of them, give way to
others when they are not needed and the budget is used up; those not used for longest go first.
"""

import logging
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.captured_views import CaptureParams
from depthwalk.bake.images import BakedObject
from depthwalk.bake.model import BakedModel
from depthwalk.cook.cook import CookedObject, CookOptions, Preloaded
from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.cook.texture_detail import Detail, at_detail, can_leave_out, detail_for
from depthwalk.cook.virtual_texture import VirtualTexture
from depthwalk.gpu.device import Device
from depthwalk.render.resources.captured_views import CapturedViewStore, ViewTextures
from depthwalk.render.resources.depth_image_object import DepthObject, upload_depth, upload_texture
from depthwalk.render.resources.height_field import HeightFields
from depthwalk.render.resources.library import Background, Library
from depthwalk.render.resources.mesh_object import WHITE
from depthwalk.render.resources.mesh_store import MeshStore
from depthwalk.scene.render_settings import DEFAULT_BUDGET
from depthwalk.types import Array

log = logging.getLogger(__name__)

_LASTING = 1.25  # a texture loses texels only where pixels cover so many times as many as would be enough

_Part = TypeVar("_Part", BakedObject, CookedObject)


class _Reading(NamedTuple):
    """Hold a texture that a thread makes ready, and how much of the whole texture it will be."""

    detail: Detail
    texture: Future[VirtualTexture]


class AssetStore:
    """Upload assets and own their GL objects, which several passes draw from.

    Meshes have the numbers of their assets. An asset's depth images become depth objects, one for each part of the
    asset. Depth objects are numbered from `first_depth` on, in the order in which they are asked for, and keep their
    numbers when everything is released.

    Parameters
    ----------
    device
        The GPU that draws.
    library
        Where assets come from.

    Attributes
    ----------
    gl
        The scope that owns everything here.
    budget
        Bytes of GPU memory for depth objects and fallback meshes, which `stream` keeps to.
    before_release
        Called before GL objects are freed, so that passes can release their vertex arrays over them.
    cook_options
        How depth images are cooked; to be set while the store is empty.
    meshes
        The store of the meshes.
    height_fields
        The height fields of planar depth images, for representations that do not warp.
    background
        Makes depth images ready beside the frames; None: frames wait for them.
    """

    def __init__(self, device: Device, library: Library) -> None:
        self.gl = device.scope("assets")
        self.budget = DEFAULT_BUDGET
        self.before_release: Callable[[], None] = lambda: None
        self.cook_options = CookOptions()
        self._library = library
        self._assets: list[int] = []  # the asset of each depth object
        self._numbers: dict[int, range] = {}  # of the depth objects of each asset
        self._cooked: dict[int, CookedObject] = {}
        self._depth: dict[int, DepthObject] = {}  # in the order in which they were used
        self._loaded: dict[int, VirtualTexture] = {}  # whole, of depth objects that have no texture yet
        self._partial: dict[int, int] = {}  # texels of depth objects of which less than all may be on the GPU
        self._reading: dict[int, _Reading] = {}
        self._threads: ThreadPoolExecutor | None = None  # one, made when it is first needed
        self._warned = False
        self._deferred = False  # whether the last frame lacks depth objects that are still to be uploaded
        self.meshes = MeshStore(self.gl, library)
        self.height_fields = HeightFields(self.gl, self.baked)
        self._captured = CapturedViewStore(self.gl, library.captured_views)
        self.background: Background | None = None

    def __len__(self) -> int:
        """Return one more than the largest number of an asset or depth object."""
        return len(self._library) + len(self._assets)

    @property
    def first_depth(self) -> int:
        """Return the number of the first depth object; smaller numbers are those of assets."""
        return len(self._library)

    def knows(self, asset: int) -> bool:
        """Return whether `depth_numbers` can answer for the asset numbered `asset` without reading depth images."""
        return asset in self._numbers

    def depth_numbers(self, asset: int) -> range:
        """Return the numbers of the depth objects that show an asset, which is read and cooked if need be.

        Parameters
        ----------
        asset
            The number of the asset.

        Returns
        -------
        range
            One number for each part of the asset.
        """
        if asset not in self._numbers:
            objects, first = self._library.cooked(asset, self.cook_options), len(self)
            self._assets += [asset] * len(objects)
            self._numbers[asset] = range(first, len(self))
            self._cooked.update(zip(self._numbers[asset], objects, strict=True))
        return self._numbers[asset]

    def is_ready(self, asset: int) -> bool:
        """Return whether frames may show the depth images of the asset numbered `asset`; if not, prepare them."""
        return self.background is None or self.background.is_cooked(asset, self.cook_options)

    def poll(self) -> bool:
        """Take over what was made ready beside the frames; return whether an asset can now be shown in another way."""
        if self.background is None:
            return False
        made, read = self.background.poll(), self.meshes.poll()
        return made or read

    @property
    def is_waiting(self) -> bool:
        """Return whether the next frame may show more than the last, although nothing in the scene has changed."""
        beside = self.background is not None and self.background.is_busy
        return self._deferred or self.meshes.is_busy or self._captured.is_busy or bool(self._reading) or beside

    def cooked(self, number: int) -> CookedObject:
        """Return the depth object numbered `number` as it was cooked; its large arrays are not loaded yet."""
        if number not in self._cooked:
            asset = self.asset_of(number)
            self._cooked.update(self._by_number(asset, self._library.cooked(asset, self.cook_options)))
        return self._cooked[number]

    def is_shipped_cooked(self, number: int) -> bool:
        """Return whether the depth object numbered `number` is there cooked only, without the images it was made of."""
        return self._library.is_shipped_cooked(self.asset_of(number))

    def baked(self, number: int) -> BakedObject:
        """Read again the depth images that a depth object was cooked from.

        Parameters
        ----------
        number
            The number of the depth object.

        Returns
        -------
        BakedObject
            Its depth images, with pixels.

        Raises
        ------
        LookupError
            Where the asset has no depth images any more.
        """
        asset = self.asset_of(number)
        return self._part(self._model(asset).parts, number)

    def depth_object(self, number: int) -> DepthObject:
        """Return the depth object numbered `number` on the GPU, uploaded if it was not."""
        if number not in self._depth:
            grids, texture = self._load(number)
            uploaded = upload_depth(self.gl, self.cooked(number).outline, grids)
            self._depth[number] = uploaded
            if can_leave_out(texture):
                self._loaded[number] = texture
                self._partial[number] = texture.normals[..., 0].size
            else:
                uploaded.texture = upload_texture(self.gl, texture, Detail.FULL)
        return self._depth[number]

    def captured_views(self, asset: int, params: CaptureParams) -> ViewTextures | None:
        """Return views of the mesh of the asset numbered `asset`, captured as `params` say.

        Where frames may not wait for them, None, or views captured with other params, while a thread captures these.
        """
        return self._captured.views(asset, params, wait=self.background is None)

    def fit_textures(
        self, numbers: Sequence[int], footprint: Array, seconds: float | None, *, exact: bool = False
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
        """
        start = time.perf_counter()

        def is_late() -> bool:
            return seconds is not None and time.perf_counter() - start > seconds

        for number, size in zip(numbers, footprint.tolist(), strict=True):
            if number not in self._partial:
                continue
            drawn = self._depth[number]
            covered = size * drawn.least_texels
            wanted, lasting = (detail_for(c, self._partial[number]) for c in (covered, covered / _LASTING))
            if drawn.texture is None:
                self._show(number, Detail.QUARTER if is_late() else wanted, set(numbers))
            elif seconds is None and (drawn.texture.detail > wanted or (exact and drawn.texture.detail != wanted)):
                self._show(number, wanted, set(numbers))
            elif not lasting <= drawn.texture.detail <= wanted or number in self._reading:
                self._change_beside(number, wanted, is_late(), set(numbers))
        self._loaded.clear()

    @property
    def has_partial(self) -> bool:
        """Return whether any depth object was uploaded of which some texels may be left out."""
        return bool(self._partial)

    def _change_beside(self, number: int, wanted: Detail, is_late: bool, needed: set[int]) -> None:
        """Have a thread read the texture of depth object `number`; upload it in a later frame, unless that `is_late`.

        needed: numbers of the depth objects that must not give way to it.
        """
        if number not in self._reading:
            load, threads = self.cooked(number).load, self._threads or ThreadPoolExecutor(1, "textures")
            self._threads = threads
            self._reading[number] = _Reading(wanted, threads.submit(lambda: at_detail(load()[1], wanted)))
        elif self._reading[number].texture.done() and not is_late:
            reading = self._reading.pop(number)
            if reading.detail != wanted:
                return
            try:
                texture = reading.texture.result()
            except OSError:  # as in `_load`
                texture = at_detail(self._load(number)[1], wanted)
            self._replace_texture(number, texture, wanted, needed)

    def _show(self, number: int, detail: Detail, needed: set[int]) -> None:
        """Give depth object `number` a texture of `detail` at once. needed: numbers of what must not give way to it."""
        whole = self._loaded[number] if number in self._loaded else self._load(number)[1]
        self._replace_texture(number, at_detail(whole, detail), detail, needed)

    def _replace_texture(self, number: int, texture: VirtualTexture, detail: Detail, needed: set[int]) -> None:
        drawn = self._depth[number]
        if drawn.texture is not None:
            self.gl.free(*drawn.texture.owned)
            drawn.texture = None
        self._make_room(texture.table.nbytes + texture.bytes_with_mip_maps, needed)
        drawn.texture = upload_texture(self.gl, texture, detail)

    def _load(self, number: int) -> tuple[LodGeometry, VirtualTexture]:
        """Return geometry and texture of depth object `number`, cooked again where the cache has lost them."""
        try:
            return self.cooked(number).load()
        except OSError:  # lost, or damaged, since it was found
            return self._cook_again(number).load()

    def _cook_again(self, number: int) -> CookedObject:
        """Cook the asset of depth object `number` again, whose arrays the cache has lost.

        Return that object with its arrays in memory, so that a cache which fails again does no harm.
        """
        asset = self.asset_of(number)
        objects = self._library.cooked(asset, self.cook_options, again=True)
        self._cooked.update(self._by_number(asset, objects))
        return self._part(objects, number)

    def _by_number(self, asset: int, objects: tuple[CookedObject, ...]) -> dict[int, CookedObject]:
        """Return the cooked objects of an asset by the numbers of its depth objects, and warn unless there is one each.

        The number of parts changes where the asset's file is replaced after numbers were given. The scene is drawn on
        all the same, by `_part`.
        """
        numbers = self._numbers[asset]
        if len(objects) != len(numbers):
            log.warning(
                "asset %d was replaced: it has %d parts now, not %d; open the scene again to show it as it is",
                asset,
                len(objects),
                len(numbers),
            )
        return {number: self._part(objects, number) for number in numbers}

    def _part(self, parts: Sequence[_Part], number: int) -> _Part:
        """Return which of an asset's parts depth object `number` shows: the last one where too few are left."""
        return parts[min(number - self._numbers[self.asset_of(number)].start, len(parts) - 1)]

    def stream(self, needed: Sequence[int], seconds: float | None) -> NDArray[np.bool_]:
        """Upload what a frame needs, and release what was not used for longest where the budget does not allow both.

        What the frame needs is never released; where that alone is more than the budget, a warning says so once.

        Parameters
        ----------
        needed
            Numbers of the depth objects that the frame needs, the most urgent first.
        seconds
            Time after which no further upload begins, so that frames take equally long; None: all are uploaded.

        Returns
        -------
        NDArray[np.bool_]
            (len(self),) which numbers are on the GPU; those of assets, whose meshes are uploaded when they are drawn,
            always are.
        """
        start = time.perf_counter()
        self._deferred = False
        for number in needed:
            if number in self._depth:
                self._depth[number] = self._depth.pop(number)
        for number in needed:
            if number in self._depth:
                continue
            cooked = self.cooked(number)
            is_held = isinstance(cooked.load, Preloaded) and cooked.load.is_held
            # Where a mesh has just given way to depth images, the frame would otherwise show neither.
            if seconds is not None and time.perf_counter() - start > seconds and not is_held:
                self._deferred = True
                continue
            self._make_room(cooked.bytes, set(needed))
            self.depth_object(number)
        self._make_room(0, set(needed))  # an earlier frame may have needed more than the budget
        resident = np.ones(len(self), bool)
        resident[self.first_depth :] = [number in self._depth for number in range(self.first_depth, len(self))]
        return resident

    @property
    def gpu_bytes(self) -> int:
        """Return how many bytes of GPU memory depth objects, fallback meshes and captured views take."""
        drawn = sum(drawn.bytes for drawn in self._depth.values())
        return drawn + self.meshes.fallback_bytes + self.height_fields.bytes + self._captured.bytes

    @property
    def depth_count(self) -> int:
        """Return how many depth objects are on the GPU."""
        return len(self._depth)

    def _make_room(self, size: int, needed: set[int]) -> None:
        """Release what is not `needed` until `size` more bytes fit into the budget, or nothing is left to release."""
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
            log.warning("what is in sight takes more GPU memory than render.gpu_memory: %d MB", self.budget / 1e6)

    def _free(self, number: int) -> None:
        """Free all of depth object `number`."""
        self.gl.free(*self._depth.pop(number).owned)
        self._loaded.pop(number, None)
        self._reading.pop(number, None)
        self._partial.pop(number, None)
        self.height_fields.free(number)

    def asset_of(self, number: int) -> int:
        """Return the number of the asset that the depth object numbered `number` shows, or shows a part of."""
        return self._assets[number - len(self._library)]

    def _model(self, asset: int) -> BakedModel:
        """Return the depth images of an asset. Raises LookupError where it has none."""
        model = self._library.baked(asset)
        if model is None:
            raise LookupError(f"asset {asset} has no depth images")
        return model

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
        """Free all GL objects and forget what was cooked; what is drawn later is uploaded again."""
        self.before_release()
        self.gl.release()
        if self._threads is not None:
            self._threads.shutdown(cancel_futures=True)
        self._threads = None
        for kept in self._loaded, self._reading, self._partial:
            kept.clear()
        self._depth.clear()
        self._cooked.clear()
        self.meshes.forget()
        self.height_fields.forget()
        self._captured.forget()
