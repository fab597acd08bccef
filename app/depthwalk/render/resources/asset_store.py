"""Assets on the GPU: depth images as grids and pages, meshes as vertex buffers. Loaded when first drawn; depth images
that are not seen give way to others within a budget of memory."""

import logging
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject
from depthwalk.bake.model import BakedModel
from depthwalk.cook.cook import CookedObject, CookOptions, cook_object
from depthwalk.cook.cooked_file import find_cooked, keep_cooked
from depthwalk.gpu.device import Device
from depthwalk.render.resources.depth_image_object import DepthObject, upload_depth
from depthwalk.render.resources.mesh_object import WHITE
from depthwalk.render.resources.mesh_store import MeshLibrary, MeshStore
from depthwalk.scene.render_settings import DEFAULT_BUDGET

log = logging.getLogger(__name__)


class Library(MeshLibrary, Protocol):
    """Where the renderer gets assets from, by number; it never reads files itself."""

    def __len__(self) -> int: ...
    def has_baked(self, asset: int) -> bool: ...
    def has_mesh(self, asset: int) -> bool: ...
    def cook_object(self, assets: Sequence[int]) -> None: ...
    def key(self, asset: int) -> str: ...  # of its depth images, by which what is made of them is kept; "": nowhere
    def baked(self, asset: int) -> BakedModel | None: ...
    def texture(self, path: Path) -> NDArray[np.uint8]: ...


class AssetStore:
    """Uploads assets and owns their GL objects. Several passes draw from it.

    Meshes go by the number of their asset. Depth objects, of which an asset may have several, are numbered from there
    on, in the order in which they are asked for, and keep their numbers when all is released.

    budget: bytes of GPU memory for depth objects and the meshes that stand in for them, which `stream` keeps to;
    before_release: called before GL objects of some go; form: of what is uploaded; to be set while it is empty.
    """

    def __init__(self, device: Device, library: Library) -> None:
        self.gl = device.scope("assets")
        self.budget = DEFAULT_BUDGET
        self.before_release: Callable[[], None] = lambda: None
        self.form = CookOptions()
        self._library = library
        self._assets: list[int] = []  # of each depth object
        self._numbers: dict[int, range] = {}
        self._prepared: dict[int, CookedObject] = {}
        self._depth: dict[int, DepthObject] = {}  # the last used last
        self._warned = False
        self.meshes = MeshStore(self.gl, library)

    def __len__(self) -> int:
        """One more than the largest number given."""
        return len(self._library) + len(self._assets)

    @property
    def first_depth(self) -> int:
        """The number from which on depth objects are numbered."""
        return len(self._library)

    def knows(self, asset: int) -> bool:
        """Whether `depth_numbers` need not read the depth images of `asset`."""
        return asset in self._numbers

    def depth_numbers(self, asset: int) -> range:
        """The numbers of the depth objects that show `asset`; its depth images are read for it."""
        if asset not in self._numbers:
            objects, first = self._prepare(asset), len(self)
            self._assets += [asset] * len(objects)
            self._numbers[asset] = range(first, len(self))
            self._prepared.update(zip(self._numbers[asset], objects, strict=True))
        return self._numbers[asset]

    def prepared(self, number: int) -> CookedObject:
        """What depth object `number` is, without its pixels."""
        if number not in self._prepared:
            asset = self.asset_of(number)
            self._prepared.update(zip(self._numbers[asset], self._prepare(asset), strict=True))
        return self._prepared[number]

    def baked(self, number: int) -> BakedObject:
        """What depth object `number` is made of; read for it."""
        asset = self.asset_of(number)
        return self._model(asset).parts[number - self._numbers[asset].start]

    def depth_object(self, number: int) -> DepthObject:
        if number not in self._depth:
            prepared = self.prepared(number)
            try:
                grids, pages = prepared.load()
            except OSError:  # removed from the cache or damaged since it was found there
                prepared = self._cook_again(number)
                grids, pages = prepared.load()
            self._depth[number] = upload_depth(self.gl, prepared.outline, grids, pages)
        return self._depth[number]

    def _cook_again(self, number: int) -> CookedObject:
        """Build what the cache has lost of the asset of depth object `number`; return that object with its arrays in
        memory, so that a cache which fails again does no harm."""
        asset = self.asset_of(number)
        objects = self._cook(asset)
        self._prepared.update(zip(self._numbers[asset], self._keep(asset, objects), strict=True))
        return objects[number - self._numbers[asset].start]

    def stream(self, needed: Sequence[int], seconds: float | None) -> NDArray[np.bool_]:
        """Uploads the depth objects `needed`, in that order, and lets go of those not used for longest where the budget
        would not hold both. Which of all numbers are there (numbers,); meshes always are.

        seconds: after which no further upload begins, so that frames stay even; None: all that is needed comes. What a
        frame needs is never let go of: where that is more than the budget, a warning says so once.
        """
        start = time.perf_counter()
        for number in needed:
            if number in self._depth:
                self._depth[number] = self._depth.pop(number)
        for number in needed:
            if number in self._depth:
                continue
            if seconds is not None and time.perf_counter() - start > seconds:
                break
            self._make_room(self.prepared(number).bytes, set(needed))
            self.depth_object(number)
        self._make_room(0, set(needed))  # for what a frame before needed that was too much
        there = np.ones(len(self), bool)
        there[len(self._library) :] = [number in self._depth for number in range(len(self._library), len(self))]
        return there

    @property
    def gpu_bytes(self) -> int:
        """What depth objects, and meshes that stand in for them, take on the GPU."""
        return sum(self._prepared[number].bytes for number in self._depth) + self.meshes.stand_in_bytes

    @property
    def depth_count(self) -> int:
        """How many depth objects are on the GPU."""
        return len(self._depth)

    def _make_room(self, size: int, needed: set[int]) -> None:
        if self.gpu_bytes + size <= self.budget:
            return
        unused, unwanted = [number for number in self._depth if number not in needed], self.meshes.unwanted
        if unused or unwanted:
            self.before_release()
        self.meshes.let_go(unwanted)
        excess = self.gpu_bytes + size - self.budget
        for number in unused:
            if excess <= 0:
                return
            self.gl.free(*self._depth.pop(number).owned)
            excess -= self._prepared[number].bytes
        if excess > 0 and not self._warned:
            self._warned = True
            log.warning("what is in sight takes more GPU memory than render.gpu_memory: %d MB", self.budget / 1e6)

    def asset_of(self, number: int) -> int:
        """The asset that depth object `number` shows, or a part of which."""
        return self._assets[number - len(self._library)]

    def _model(self, asset: int) -> BakedModel:
        model = self._library.baked(asset)
        if model is None:
            raise LookupError(f"asset {asset} has no depth images")
        return model

    def _prepare(self, asset: int) -> tuple[CookedObject, ...]:
        """From the cache; else it is built and the cache keeps it."""
        key = self._library.key(asset)
        objects = find_cooked(key, self.form) if key else None
        return self._keep(asset, self._cook(asset)) if objects is None else objects

    def _cook(self, asset: int) -> tuple[CookedObject, ...]:
        """What is made of the asset's depth images, in memory."""
        return tuple(cook_object(part, self.form) for part in self._model(asset).parts)

    def _keep(self, asset: int, objects: tuple[CookedObject, ...]) -> tuple[CookedObject, ...]:
        """The same, kept in the cache and read from there where that is possible."""
        key = self._library.key(asset)  # asked for again: the asset's file may have changed before it was baked
        if key:
            try:
                return keep_cooked(key, self.form, objects)
            except OSError as error:  # they stay in memory
                log.warning("cannot keep what was prepared of depth images: %s", error)
        return objects

    def texture(self, path: Path | None) -> NDArray[np.uint8]:
        """Texels (H, W, 4) of an image file, sRGB; one white texel for None."""
        return WHITE if path is None else self._library.texture(path)

    def release(self) -> None:
        self.before_release()
        self.gl.release()
        self._depth.clear()
        self._prepared.clear()
        self.meshes.forget()
