"""Provide the assets of a scene to the renderer, as arrays, when they are first requested.

Depth images are found beside the mesh or in the cache; missing ones are baked and stored in the cache. The baker is
imported only when something must be baked: the first picture of most scenes does not need it.
"""

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.assets.asset_files import (
    complaints_about,
    mesh_key,
    model_params,
    range_key,
    read_keyed,
    read_meso,
    read_relief,
)
from depthwalk.assets.cooked import cooked_objects
from depthwalk.assets.mesh_library import MeshLibrary, Report
from depthwalk.assets.missing_images import bake_missing
from depthwalk.bake.cache import find_baked, keep_baked
from depthwalk.bake.file import read_baked, read_header
from depthwalk.bake.model import BakedModel
from depthwalk.bake.params import ModelParams
from depthwalk.cook.cook import GRID_TEXELS, CookedObject, CookOptions, HeldArrays, Prefetcher
from depthwalk.cook.cooked_file import cooked_key, find_cooked, read_cooked
from depthwalk.errors import InputError
from depthwalk.files import reason
from depthwalk.ingest.formats import is_cooked_file
from depthwalk.ingest.image import load_texture
from depthwalk.ingest.loader import check_height
from depthwalk.scene.scene import Asset, BakedAsset, DepthImageAsset, MeshAsset, told_at

log = logging.getLogger(__name__)

_NEEDS_IMAGES = (
    "lod.mode `paper`, lod.cases other than `complete`, and warp.order `epipole` need the depth images (.dpci.exr)"
)


class SceneLibrary(MeshLibrary):
    """Read and bake the assets of a scene, by their numbers, when they are first requested.

    Meshes and their levels are kept in memory until `forget_mesh`. Depth images are not: if they are requested again,
    they are read again, since the renderer keeps what it needs of them. Every method raises InputError for files that
    cannot be used.

    Cache entries have the key of the bytes that they were made from. If a file is replaced after the key of its asset
    was first requested, `key` returns the old key until the new file is baked, and then the new one.

    Attributes
    ----------
    report
        Called with the name of an asset and the stage that begins; may be replaced.
    """

    def __init__(
        self,
        assets: tuple[Asset, ...],
        report: Report = lambda name, stage: None,
        processes: int | None = 1,
        ahead: Prefetcher | None = None,
    ) -> None:
        """Create a library of a scene's assets; nothing is read yet.

        Parameters
        ----------
        assets
            The assets, by number.
        report
            Called with the name of an asset and the stage that begins.
        processes
            Number of missing assets to bake at a time; None: as many as there are cores. More than one requires a
            program whose main module can be imported again, since that is how processes are started.
        ahead
            Reads the arrays of cooked objects while the caller does something else; None: they are read when they are
            requested.
        """
        super().__init__(assets, report)
        self._processes, self._ahead = processes, ahead
        self._keys: dict[int, str] = {}
        self._not_stored: dict[str, BakedModel] = {}  # models that the cache could not store, by key
        self._in_memory: dict[tuple[int, CookOptions], tuple[CookedObject, ...]] = {}  # see `read_ahead`
        self._warned = False  # about cooked files, which do not support some settings

    def sibling(self, assets: tuple[Asset, ...]) -> "SceneLibrary":
        """Return a library of other `assets`, which bakes as many at a time as this one."""
        return SceneLibrary(assets, processes=self._processes)

    def __len__(self) -> int:
        """Return the number of assets."""
        return len(self._assets)

    def has_baked(self, asset: int) -> bool:
        """Return whether the scene gives the asset numbered `asset` depth images, whether baked yet or not."""
        spec = self._assets[asset]
        return not isinstance(spec, MeshAsset) or spec.dpci is not None

    def has_height_field(self, asset: int) -> bool:
        """Return whether the asset numbered `asset` is a relief, and so one planar depth image."""
        spec = self._assets[asset]
        return isinstance(spec, DepthImageAsset) and spec.size is not None

    def texture(self, path: Path) -> NDArray[np.uint8]:
        """Return the texels (H, W, 4) uint8, sRGB with alpha, row 0 at the top, of the image file `path`."""
        return load_texture(path)

    def sky_image(self, path: Path) -> NDArray[np.float32]:
        """Return the texels (H, W, 3) float32, linear, row 0 at the zenith, of the sky in the image file `path`."""
        from depthwalk.ingest.sky_image import load_sky_image  # here, since few scenes have any

        return load_sky_image(path)

    def key(self, asset: int) -> str:
        """Return the key in the cache of the depth images of the asset numbered `asset`.

        It is "" if the cache stores none, or stores them without the meso-structure that they are drawn with.
        """
        if asset not in self._keys:
            with told_at(self._assets[asset]):
                self._keys[asset] = _key_of(self._assets[asset])
        return self._keys[asset]

    def baked(self, asset: int) -> BakedModel | None:
        """Return the depth images of the asset numbered `asset`; None if it has none.

        If they are neither beside the mesh nor in the cache, they are baked, and stored in the cache.
        """
        spec = self._assets[asset]
        with told_at(spec):
            if isinstance(spec, DepthImageAsset):
                return self._planar(spec) if spec.size is not None else self._range_model(asset, spec)
            if isinstance(spec, BakedAsset):
                if is_cooked_file(spec.baked):
                    raise InputError(f"{spec.baked}: holds cooked depth images; {_NEEDS_IMAGES}")
                return read_baked(spec.baked)
            return None if spec.dpci is None else self._mesh_model(asset, spec)

    def cooked(self, asset: int, options: CookOptions, *, again: bool = False) -> tuple[CookedObject, ...]:
        """Return the cooked depth images of an asset, one object for each part.

        Parameters
        ----------
        asset
            The number of the asset.
        options
            How it is cooked; without effect if the scene names cooked depth images.
        again
            Whether to cook even if the cache has the objects, because what it has cannot be loaded.

        Raises
        ------
        LookupError
            If the asset has no depth images.
        """
        return self._prefetched(self._cooked(asset, options, again))

    def _prefetched(self, objects: tuple[CookedObject, ...]) -> tuple[CookedObject, ...]:
        """Return `objects`, and begin reading their arrays if the library reads ahead."""
        return objects if self._ahead is None else self._ahead.read(objects)

    def read_ahead(self, assets: Sequence[int], options: CookOptions, most: float) -> None:
        """Read assets before they are requested: cooked depth images, and meshes of assets without depth images.

        Arrays of depth images are held until they are first requested. Nothing is baked or cooked: depth images that
        neither the scene names nor the cache has are skipped. No thread is started.

        Parameters
        ----------
        assets
            Numbers of the assets to read.
        options
            How depth images are cooked.
        most
            Most bytes of arrays to hold; the first asset that exceeds it, and all after it, are read when they are
            requested.

        Raises
        ------
        InputError
            For files that cannot be used.
        """
        for asset in assets:
            mesh = None if self.has_baked(asset) else self.mesh(asset)
            objects = self.stored(asset, options)
            most -= sum(cooked.bytes for cooked in objects) + (mesh.nbytes if mesh else 0)
            if most < 0:
                self.forget_mesh(asset)
                return
            self._in_memory[asset, options] = tuple(replace(cooked, load=HeldArrays(cooked.load)) for cooked in objects)

    def stored(self, asset: int, options: CookOptions) -> tuple[CookedObject, ...]:
        """Return the cooked depth images of an asset as its file or the cache has them, whatever was read in advance.

        Parameters
        ----------
        asset
            The number of the asset.
        options
            How they were cooked.

        Returns
        -------
        tuple[CookedObject, ...]
            An object for each part; none if they have yet to be made, or are not stored.
        """
        spec = self._assets[asset]
        if isinstance(spec, BakedAsset) and is_cooked_file(spec.baked):
            return _read_cooked(spec)
        key = self.key(asset) if self.has_baked(asset) else ""
        return (find_cooked(key, options) if key else None) or ()

    def _cooked(self, asset: int, options: CookOptions, again: bool) -> tuple[CookedObject, ...]:
        held = self._in_memory.pop((asset, options), ())
        if held and not again:
            return held
        spec = self._assets[asset]
        if not (isinstance(spec, BakedAsset) and is_cooked_file(spec.baked)):
            begin = partial(self.report, spec.name, "preparing for the GPU")
            key, baked = partial(self.key, asset), partial(self._baked_to_cook, asset, options)
            return cooked_objects(key, baked, options, again=again, begin=begin)
        if options != CookOptions() and not self._warned:
            self._warned = True
            log.warning("%s: like all cooked depth images, it is drawn as it was cooked; %s", spec.baked, _NEEDS_IMAGES)
        self.report(spec.name, "depth images")
        return _read_cooked(spec)

    def _baked_to_cook(self, asset: int, options: CookOptions) -> BakedModel | None:
        """Return an asset's depth images, to be cooked.

        If they are missing and cooking would not use their coarse grids, they are baked without these, which takes a
        fifth less time, and are not stored: the cache stores the cooked objects.
        """
        spec = self._assets[asset]
        if not isinstance(spec, MeshAsset) or spec.dpci is None or spec.dpci.meso or options.needs_coarse_grids:
            return self.baked(asset)
        return self._mesh_model(asset, spec, GRID_TEXELS)

    def is_shipped_cooked(self, asset: int) -> bool:
        """Return whether the scene names cooked depth images of the asset numbered `asset`, so that none are made."""
        spec = self._assets[asset]
        return isinstance(spec, BakedAsset) and is_cooked_file(spec.baked)

    def bake_missing(self, assets: Sequence[int]) -> None:
        """Bake into the cache, several at a time, the depth images of assets for which none are found.

        This does nothing if the library bakes one asset at a time, or if at most one lacks its depth images: `baked`
        makes these when they are requested. It also retries what fails here, and raises its error.

        Parameters
        ----------
        assets
            Numbers of the assets to check.
        """
        if self._processes != 1:
            bake_missing((self._assets[asset] for asset in assets), self._processes, self.report)

    def _mesh_model(self, asset: int, spec: MeshAsset, max_stepped: int | None = None) -> BakedModel:
        """Return the depth images of a mesh, with the relief that the scene lays over them.

        Those baked with `max_stepped`, see `bake_model`, lack grids that others need; the cache does not store them.
        """
        assert spec.dpci is not None
        params = model_params(spec.dpci)
        key = self.key(asset) or mesh_key(spec, params)
        self.report(spec.name, "depth images")
        bake = partial(self._bake_mesh, asset, spec, params, max_stepped)
        baked = self._found_or_made(spec.name, spec.mesh, key, bake, keep=max_stepped is None)
        if spec.dpci.meso is None:
            return baked
        meso = read_meso(spec.dpci.meso)
        return BakedModel(parts=tuple(replace(part, meso=meso) for part in baked.parts))

    def _range_model(self, asset: int, spec: DepthImageAsset) -> BakedModel:
        """Return the depth images of a range image or panorama."""
        return self._found_or_made(spec.name, spec.depth, self.key(asset), lambda: self._bake_range(asset, spec))

    def _planar(self, spec: DepthImageAsset) -> BakedModel:
        """Return a planar depth image without caching it: reading it is as fast as from the cache."""
        from depthwalk.bake.planar import bake_planar

        return BakedModel(parts=(bake_planar(read_relief(spec), key="", cut=spec.method == "cut"),))

    def _found_or_made(
        self, name: str, source: Path, key: str, bake: Callable[[], BakedModel], keep: bool = True
    ) -> BakedModel:
        """Find the model of `key` beside its source or in the cache; otherwise bake it, and store it if `keep`."""
        found = self._not_stored.get(key) or find_baked(source, key)
        if found is not None:
            return found
        start = time.perf_counter()
        baked = bake()
        log.info("baked %s in %.1f s", name, time.perf_counter() - start)
        if not keep:
            return baked
        try:
            keep_baked(baked)
        except OSError as error:  # a full or read-only disk costs the next start time, not this one
            log.warning("cannot store the depth images of %s in the cache: %s", name, reason(error))
            self._not_stored[baked.key] = baked
        return baked

    def _bake_mesh(self, asset: int, spec: MeshAsset, params: ModelParams, max_stepped: int | None) -> BakedModel:
        """Read the mesh, unless it is in memory, and bake it under the key of what was read; see `bake_model`."""
        from depthwalk.bake.parts import bake_model

        # Not through `mesh`, which would keep a mesh in memory that may be drawn only by its depth images.
        mesh, source = self._meshes.get(asset) or self._read_mesh(spec)
        check_height(mesh, spec.mesh)
        key = mesh_key(spec, params, source)
        self._note_key(asset, key)
        return bake_model(mesh, params, key, lambda stage: self.report(spec.name, stage), max_stepped=max_stepped)

    def _bake_range(self, asset: int, spec: DepthImageAsset) -> BakedModel:
        """Read a range image or panorama and resample it to depth images, under the key of what was read."""
        from depthwalk.bake.panorama import bake_panorama
        from depthwalk.bake.planar import bake_range

        self.report(spec.name, "reading")
        image, key = read_keyed(spec)
        self._note_key(asset, key)
        self.report(spec.name, "resampling")
        with complaints_about(spec.depth):
            if spec.panorama is not None:
                return BakedModel(parts=(bake_panorama(image, key, cut=spec.method == "cut"),))
            return BakedModel(parts=(bake_range(image, key),))

    def _note_key(self, asset: int, key: str) -> None:
        """Remember `key` as that of the asset's depth images, which are being baked, if it has one."""
        if self.key(asset):
            self._keys[asset] = key


def _read_cooked(spec: BakedAsset) -> tuple[CookedObject, ...]:
    """Return cooked depth images."""
    with told_at(spec):
        return read_cooked(spec.baked)


def _key_of(spec: Asset) -> str:
    """Return the key of an asset's depth images; "" if they are not stored, or not as they are drawn."""
    if isinstance(spec, DepthImageAsset):
        return range_key(spec) if spec.size is None else ""
    if isinstance(spec, BakedAsset):
        if is_cooked_file(spec.baked):
            return cooked_key(spec.baked) or ""
        return str(read_header(spec.baked)["depthwalk.key"])
    if spec.dpci is None or spec.dpci.meso is not None:
        return ""
    return mesh_key(spec, model_params(spec.dpci))
