"""Provide the assets of a scene to the renderer, as arrays, when they are first asked for.

Depth images are found beside the mesh or in the cache; what is found nowhere is baked, and the cache keeps it. What
bakes is imported when something has to be baked: the first picture of most scenes needs nothing of it.
"""

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.assets import derived_data
from depthwalk.assets.asset_files import (
    complaints_about,
    mesh_key,
    model_params,
    range_key,
    read_hashed,
    read_keyed,
    read_meso,
    read_relief,
    read_translucent,
)
from depthwalk.assets.cooked import cooked_objects
from depthwalk.assets.missing_images import bake_missing
from depthwalk.bake.cache import find_baked, keep_baked
from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.bake.file import read_baked, read_header
from depthwalk.bake.model import BakedModel
from depthwalk.bake.params import ModelParams
from depthwalk.cook.cook import GRID_TEXELS, CookedObject, CookOptions, HeldArrays, Prefetcher
from depthwalk.cook.cooked_file import cooked_key, find_cooked, read_cooked
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.errors import InputError
from depthwalk.ingest.formats import is_cooked_file
from depthwalk.ingest.image import load_texture
from depthwalk.ingest.loader import check_height
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.scene.scene import Asset, BakedAsset, DepthImageAsset, MeshAsset

log = logging.getLogger(__name__)

_NEEDS_IMAGES = (
    "lod.mode `paper`, lod.cases other than `complete`, and warp.order `epipole` need the depth images (.dpci.exr)"
)


Report = Callable[[str, str], None]
"""Called with the name of an asset, and what is being done for it."""


class SceneLibrary:
    """Read and bake the assets of a scene, by their numbers, when they are first asked for.

    Meshes and their levels are kept in memory until `forget_mesh`. Depth images are not: where they are asked for
    again, they are read again, since the renderer keeps what it needs of them. Every method raises InputError for files
    that cannot be used.

    What the cache keeps has the key of the bytes that it was made of. Where a file is replaced after the key of its
    asset was first asked for, `key` returns the old key until the new file is baked, and then the new one.

    Attributes
    ----------
    report
        Called with the name of an asset and what is being done for it; may be replaced.
    """

    def __init__(
        self,
        assets: tuple[Asset, ...],
        report: Report = lambda name, stage: None,
        processes: int | None = 1,
        ahead: Prefetcher | None = None,
    ) -> None:
        """Make a library of a scene's assets; nothing is read yet.

        Parameters
        ----------
        assets
            The assets, by number.
        report
            Called with the name of an asset and what is being done for it.
        processes
            How many missing assets to bake at a time; None: as many as there are cores. More than one is for programs
            whose main module can be imported again, since that is how processes are started.
        ahead
            Reads the arrays of cooked objects while the caller does something else; None: they are read when they are
            asked for.
        """
        self._assets = assets
        self._processes, self._ahead = processes, ahead
        self.report = report
        self._keys: dict[int, str] = {}
        self._unkept: dict[str, BakedModel] = {}  # by key: models that the cache could not keep
        self._meshes: dict[int, tuple[Mesh, str]] = {}  # with the hash of the bytes that they were read from
        self._levels: dict[int, tuple[MeshLevel, ...]] = {}
        self._clusters: dict[int, MeshClusters | None] = {}
        self._in_memory: dict[tuple[int, CookOptions], tuple[CookedObject, ...]] = {}  # see `read_ahead`
        self._warned = False  # of cooked files, which cannot follow some settings

    def sibling(self, assets: tuple[Asset, ...]) -> "SceneLibrary":
        """Return a library of other `assets`, which bakes as many at a time as this one."""
        return SceneLibrary(assets, processes=self._processes)

    def __len__(self) -> int:
        """Return the number of assets."""
        return len(self._assets)

    def has_baked(self, asset: int) -> bool:
        """Return whether the scene gives the asset numbered `asset` depth images, be they baked yet or not."""
        spec = self._assets[asset]
        return not isinstance(spec, MeshAsset) or spec.dpci is not None

    def has_height_field(self, asset: int) -> bool:
        """Return whether the asset numbered `asset` is a relief, and so one planar depth image."""
        spec = self._assets[asset]
        return isinstance(spec, DepthImageAsset) and spec.size is not None

    def has_mesh(self, asset: int) -> bool:
        """Return whether the asset numbered `asset` has a mesh, without reading it."""
        return _mesh_spec(self._assets[asset]) is not None

    def texture(self, path: Path) -> NDArray[np.uint8]:
        """Return the texels (H, W, 4) uint8, sRGB with alpha, row 0 at the top, of the image file `path`."""
        return load_texture(path)

    def key(self, asset: int) -> str:
        """Return the key in the cache of the depth images of the asset numbered `asset`.

        It is "" where the cache keeps none, or keeps them without the meso-structure that they are drawn with.
        """
        if asset not in self._keys:
            self._keys[asset] = _key_of(self._assets[asset])
        return self._keys[asset]

    # Depth images ----------------------------------------------------------------------------------------------------

    def baked(self, asset: int) -> BakedModel | None:
        """Return the depth images of the asset numbered `asset`; None where it has none.

        Those that are found neither beside the mesh nor in the cache are baked, and kept in the cache.
        """
        spec = self._assets[asset]
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
            How it is cooked; of no effect where the scene names cooked depth images.
        again
            Whether to cook although the cache has the objects, because what it has cannot be loaded.

        Raises
        ------
        LookupError
            Where the asset has no depth images.
        """
        return self._read_ahead(self._cooked(asset, options, again))

    def _read_ahead(self, objects: tuple[CookedObject, ...]) -> tuple[CookedObject, ...]:
        """Return `objects`, whose arrays begin to be read where the library reads ahead."""
        return objects if self._ahead is None else self._ahead.read(objects)

    def read_ahead(self, assets: Sequence[int], options: CookOptions, most: float) -> None:
        """Read assets before they are asked for: cooked depth images, and meshes of what has no depth images.

        Arrays of depth images are held until they are first asked for. Nothing is baked or cooked: depth images that
        neither the scene names nor the cache has are passed over. No thread is started.

        Parameters
        ----------
        assets
            Numbers of the assets to read.
        options
            How depth images are cooked.
        most
            How many bytes of arrays to hold; the first asset that takes more, and what follows, is read when it is
            asked for.

        Raises
        ------
        InputError
            For files that cannot be used.
        """
        for asset in assets:
            mesh = None if self.has_baked(asset) else self.mesh(asset)
            objects = self._found_cooked(asset, options)
            most -= sum(cooked.bytes for cooked in objects) + (mesh.nbytes if mesh else 0)
            if most < 0:
                self.forget_mesh(asset)
                return
            self._in_memory[asset, options] = tuple(replace(cooked, load=HeldArrays(cooked.load)) for cooked in objects)

    def _found_cooked(self, asset: int, options: CookOptions) -> tuple[CookedObject, ...]:
        """Return the cooked depth images of the asset numbered `asset`; none where they are still to be made."""
        spec = self._assets[asset]
        if isinstance(spec, BakedAsset) and is_cooked_file(spec.baked):
            return read_cooked(spec.baked)
        key = self.key(asset) if self.has_baked(asset) else ""
        return (find_cooked(key, options) if key else None) or ()

    def _cooked(self, asset: int, options: CookOptions, again: bool) -> tuple[CookedObject, ...]:
        held = self._in_memory.pop((asset, options), ())
        if held and not again:
            return held
        spec = self._assets[asset]
        if not (isinstance(spec, BakedAsset) and is_cooked_file(spec.baked)):
            begin = partial(self.report, spec.name, "cooking")
            key, baked = partial(self.key, asset), partial(self._baked_to_cook, asset, options)
            return cooked_objects(key, baked, options, again=again, begin=begin)
        if options != CookOptions() and not self._warned:
            self._warned = True
            log.warning(
                "%s: holds cooked depth images, drawn as they are, like all such; %s", spec.baked, _NEEDS_IMAGES
            )
        self.report(spec.name, "depth images")
        return read_cooked(spec.baked)

    def _baked_to_cook(self, asset: int, options: CookOptions) -> BakedModel | None:
        """Return an asset's depth images, to be cooked.

        Where they are not there and cooking would not use their coarse grids, they are baked without, which takes a
        fifth less time, and are not kept: the cache keeps what is cooked of them.
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

        The call does nothing where the library bakes one asset at a time, or where at most one lacks its depth images:
        the method `baked` makes these when they are asked for. It also tries again what fails here, and raises its
        error.

        Parameters
        ----------
        assets
            Numbers of the assets to look for.
        """
        if self._processes != 1:
            bake_missing((self._assets[asset] for asset in assets), self._processes, self.report)

    def _mesh_model(self, asset: int, spec: MeshAsset, max_stepped: int | None = None) -> BakedModel:
        """Return the depth images of a mesh, with the relief that the scene lays over them.

        Those baked with `max_stepped`, see `bake_model`, lack grids that others ask for; the cache does not keep them.
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
        """Return a planar depth image as it is: reading it takes no longer than reading a file of the cache."""
        from depthwalk.bake.planar import bake_planar

        return BakedModel(parts=(bake_planar(read_relief(spec), key="", cut=spec.method == "cut"),))

    def _found_or_made(
        self, name: str, source: Path, key: str, bake: Callable[[], BakedModel], keep: bool = True
    ) -> BakedModel:
        """Find the model of `key` beside its source or in the cache; else bake it, and keep it there if `keep`."""
        found = self._unkept.get(key) or find_baked(source, key)
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
            log.warning("cannot keep the depth images of %s: %s", name, error)
            self._unkept[baked.key] = baked
        return baked

    def _bake_mesh(self, asset: int, spec: MeshAsset, params: ModelParams, max_stepped: int | None) -> BakedModel:
        """Read the mesh, unless it is in memory, and bake it under the key of what was read; see `bake_model`."""
        from depthwalk.bake.parts import bake_model

        # Not by `mesh`, which would keep in memory a mesh that may be drawn by its depth images only.
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

    # Meshes ----------------------------------------------------------------------------------------------------------

    def mesh(self, asset: int) -> Mesh | None:
        """Return the mesh of the asset numbered `asset`, asset frame, metres; None where it has none."""
        spec = _mesh_spec(self._assets[asset])
        if spec is None:
            return None
        if asset not in self._meshes:
            self._meshes[asset] = self._read_mesh(spec)
        return self._meshes[asset][0]

    def mesh_levels(self, asset: int) -> tuple[MeshLevel, ...]:
        """Return the mesh of the asset numbered `asset` and its simplified levels, the finest first.

        The result is empty where the asset has no mesh.
        """
        if asset not in self._levels:
            spec, mesh = _mesh_spec(self._assets[asset]), self.mesh(asset)
            if spec is not None and mesh is not None:
                self._levels[asset] = derived_data.simplified_levels(
                    spec, *self._meshes[asset], partial(self.report, spec.name)
                )
            else:
                self._levels[asset] = ()
        return self._levels[asset]

    def mesh_clusters(self, asset: int) -> MeshClusters | None:
        """Return the clusters of the mesh of the asset numbered `asset`; None where it has no mesh."""
        if asset not in self._clusters:
            spec, mesh = _mesh_spec(self._assets[asset]), self.mesh(asset)
            if spec is not None and mesh is not None:
                self._clusters[asset] = derived_data.clusters(
                    spec, *self._meshes[asset], partial(self.report, spec.name)
                )
            else:
                self._clusters[asset] = None
        return self._clusters[asset]

    def captured_views(self, asset: int, params: CaptureParams) -> CapturedViews | None:
        """Return views of the mesh of the asset numbered `asset`, captured as `params` say; None where it has no mesh.

        They are not kept in memory.
        """
        spec, mesh = _mesh_spec(self._assets[asset]), self.mesh(asset)
        if spec is None or mesh is None:
            return None
        return derived_data.captured_views(spec, *self._meshes[asset], params, partial(self.report, spec.name))

    def translucent_mesh(self, asset: int) -> Mesh | None:
        """Return the mesh of the asset numbered `asset` if any of it lets light through or glows, else None.

        The mesh is not kept in memory.
        """
        spec = _mesh_spec(self._assets[asset])
        if spec is None:
            return None
        known = self._meshes.get(asset)  # once: other threads forget meshes
        if known is not None:
            return known[0] if known[0].is_translucent else None
        return read_translucent(spec)

    def take_mesh(self, asset: int, mesh: Mesh, source: str) -> None:
        """Keep `mesh` as that of the asset numbered `asset`; `source` is the hash of the bytes it was read from."""
        self._meshes[asset] = mesh, source

    def forget_mesh(self, asset: int) -> None:
        """Free the memory of the mesh and the levels of the asset numbered `asset`, until they are asked for again."""
        self._meshes.pop(asset, None)
        self._levels.pop(asset, None)
        self._clusters.pop(asset, None)

    def _read_mesh(self, spec: MeshAsset) -> tuple[Mesh, str]:
        """Read the mesh of an asset, and say so."""
        self.report(spec.name, "reading")
        return read_hashed(spec)


def _mesh_spec(spec: Asset) -> MeshAsset | None:
    """Return how the mesh of an asset is read; None where it has none."""
    if isinstance(spec, BakedAsset):
        return spec.source
    return spec if isinstance(spec, MeshAsset) else None


def _key_of(spec: Asset) -> str:
    """Return the key of an asset's depth images; "" where they are not kept, or not as they are drawn."""
    if isinstance(spec, DepthImageAsset):
        return range_key(spec) if spec.size is None else ""
    if isinstance(spec, BakedAsset):
        if is_cooked_file(spec.baked):
            return cooked_key(spec.baked) or ""
        return str(read_header(spec.baked)["depthwalk.key"])
    if spec.dpci is None or spec.dpci.meso is not None:
        return ""
    return mesh_key(spec, model_params(spec.dpci))
