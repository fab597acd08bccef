"""The assets of a scene, read and baked when first asked for. The renderer sees only arrays."""

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.assets.batch_bake import Job, bake_all, levels_key, mesh_key, model_params, read_hashed
from depthwalk.bake.cache import BAKED, bake_key, find_baked, has_key, keep_baked, sidecar
from depthwalk.bake.level_file import find_levels, keep_levels
from depthwalk.bake.levels import mesh_levels
from depthwalk.bake.meso import Meso
from depthwalk.bake.meso_file import load_meso
from depthwalk.bake.model import BakedModel
from depthwalk.bake.parts import ModelParams, bake_model
from depthwalk.bake.planar import bake_planar, bake_range
from depthwalk.cache import make_room
from depthwalk.errors import InputError
from depthwalk.ingest.image import PlanarImage, load_texture
from depthwalk.ingest.loader import check_height
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.ingest.range_image import Intrinsics, RangeImage, load_depth_image, load_range_image
from depthwalk.ingest.sources import source_hash
from depthwalk.scene.scene import Asset, DepthImageAsset, MeshAsset
from depthwalk.scene.schema import MesoParams

log = logging.getLogger(__name__)

_READINGS = 3  # of a range image that changes meanwhile

Report = Callable[[str, str], None]  # asset's name, what is being done


class SceneLibrary:
    """`baked`, `mesh` and `mesh_levels` by asset number; each is made once. Depth images are read anew where they are
    asked for again: the renderer keeps what it needs of them. Raises InputError for files that cannot be used.

    What is kept in the cache has the key of the bytes that it was made of: where a file was replaced after its asset's
    key was first asked for, `key` is that of the new one from when it is baked.

    report: told what is being done; may be replaced. processes: bake that many missing assets at a time, None: as many
    as there are cores. Only programs may say so whose main module can be imported again: processes do.
    """

    def __init__(
        self,
        assets: tuple[Asset, ...],
        report: Report = lambda name, stage: None,
        processes: int | None = 1,
    ) -> None:
        self._assets = assets
        self._processes = processes
        self.report = report
        self._keys: dict[int, str] = {}
        self._unkept: dict[str, BakedModel] = {}  # by key: what could not be stored
        self._meshes: dict[int, tuple[Mesh, str]] = {}  # with the hash of what it was read from
        self._levels: dict[int, tuple[MeshLevel, ...]] = {}

    def sibling(self, assets: tuple[Asset, ...]) -> "SceneLibrary":
        """A library of other assets, which bakes as many at a time."""
        return SceneLibrary(assets, processes=self._processes)

    def __len__(self) -> int:
        return len(self._assets)

    def has_baked(self, asset: int) -> bool:
        spec = self._assets[asset]
        return isinstance(spec, DepthImageAsset) or spec.dpci is not None

    def has_mesh(self, asset: int) -> bool:
        return isinstance(self._assets[asset], MeshAsset)

    def key(self, asset: int) -> str:
        """What the asset's depth images depend on; empty where they are not stored, or not as they are drawn."""
        if asset not in self._keys:
            self._keys[asset] = self._find_key(self._assets[asset])
        return self._keys[asset]

    def _find_key(self, spec: Asset) -> str:
        if isinstance(spec, DepthImageAsset):
            return _range_key(spec) if spec.intrinsics is not None else ""
        if spec.dpci is None or spec.dpci.meso is not None:
            return ""
        return mesh_key(spec, model_params(spec.dpci))

    def cook_object(self, assets: Sequence[int]) -> None:
        """Bakes into the cache, several at a time, what is missing of the depth images of `assets`. What fails is left
        for `baked` to complain about."""
        missing = self._missing(assets) if self._processes != 1 else []
        if len(missing) < 2:
            return
        names, done = [job.spec.name for job in missing], 0

        def stage(number: int, name: str) -> None:
            self.report(names[number], f"{name} ({done} of {len(missing)} baked)")

        try:
            missing[0].out.parent.mkdir(parents=True, exist_ok=True)
            with closing(bake_all(missing, self._processes, stage)) as outcomes:
                for number, outcome in outcomes:
                    done += 1
                    if not isinstance(outcome, InputError):
                        make_room(missing[number].out)
        except OSError as error:
            log.warning("cannot keep depth images: %s", error)

    def _missing(self, assets: Sequence[int]) -> list[Job]:
        """What has to be baked for `assets`."""
        jobs: dict[str, Job] = {}  # by key: assets may share one
        for spec in (self._assets[asset] for asset in assets):
            if isinstance(spec, MeshAsset) and spec.dpci is not None:
                params = model_params(spec.dpci)
                key = mesh_key(spec, params)
                if not (has_key(sidecar(spec.mesh), key) or has_key(BAKED.file(key), key)):
                    jobs[key] = Job(spec, params, BAKED.file(key))
        return list(jobs.values())

    def mesh(self, asset: int) -> Mesh | None:
        spec = self._assets[asset]
        if isinstance(spec, DepthImageAsset):
            return None
        if asset not in self._meshes:
            self._meshes[asset] = self._read_mesh(spec)
        return self._meshes[asset][0]

    def mesh_levels(self, asset: int) -> tuple[MeshLevel, ...]:
        """The mesh and its simplified levels, finest first; none where the asset has no mesh."""
        if asset not in self._levels:
            spec, mesh = self._assets[asset], self.mesh(asset)
            if isinstance(spec, MeshAsset) and mesh is not None:
                self._levels[asset] = self._make_levels(spec, *self._meshes[asset])
            else:
                self._levels[asset] = ()
        return self._levels[asset]

    def forget_mesh(self, asset: int) -> None:
        """Frees the memory of the asset's mesh and its levels, until they are asked for again."""
        self._meshes.pop(asset, None)
        self._levels.pop(asset, None)

    def texture(self, path: Path) -> NDArray[np.uint8]:
        return load_texture(path)

    def _read_mesh(self, spec: MeshAsset) -> tuple[Mesh, str]:
        self.report(spec.name, "reading")
        return read_hashed(spec)

    def baked(self, asset: int) -> BakedModel | None:
        spec = self._assets[asset]
        if isinstance(spec, DepthImageAsset):
            return self._bake_image(asset, spec)
        if spec.dpci is None:
            return None
        params = model_params(spec.dpci)
        key = self.key(asset) or mesh_key(spec, params)
        self.report(spec.name, "depth images")
        baked = self._baked_once(spec.name, spec.mesh, key, lambda: self._bake_mesh(asset, spec, params))
        if spec.dpci.meso is None:
            return baked
        meso = read_meso(spec.dpci.meso)
        return BakedModel(parts=tuple(replace(part, meso=meso) for part in baked.parts))

    def _bake_mesh(self, asset: int, spec: MeshAsset, params: ModelParams) -> BakedModel:
        # Not by `mesh`, which would keep for good what may be drawn by its depth images only.
        mesh, source = self._meshes.get(asset) or self._read_mesh(spec)
        check_height(mesh, spec.mesh)
        key = mesh_key(spec, params, source)
        self._note_key(asset, key)
        return bake_model(mesh, params, key, lambda stage: self.report(spec.name, stage))

    def _note_key(self, asset: int, key: str) -> None:
        """Takes `key` for that of the asset's depth images, which are being made, where they are stored."""
        if self.key(asset):
            self._keys[asset] = key

    def _baked_once(self, name: str, source: Path, key: str, bake: Callable[[], BakedModel]) -> BakedModel:
        """The model of `key` from beside its source or from the cache; else `bake` makes it and the cache keeps it."""
        baked = self._unkept.get(key) or find_baked(source, key)
        if baked is None:
            start = time.perf_counter()
            baked = bake()
            log.info("baked %s in %.1f s", name, time.perf_counter() - start)
            try:
                keep_baked(baked)
            except OSError as error:  # a full or read-only disk costs the next start time, not this one
                log.warning("cannot keep the depth images of %s: %s", name, error)
                self._unkept[baked.key] = baked
        return baked

    def _make_levels(self, spec: MeshAsset, mesh: Mesh, source: str) -> tuple[MeshLevel, ...]:
        key = levels_key(spec, source)
        levels = find_levels(mesh, key)
        if levels is None:
            self.report(spec.name, "simplifying")
            levels = mesh_levels(mesh)
            try:
                keep_levels(levels, key)
            except OSError as error:
                log.warning("cannot keep the simplified meshes of %s: %s", spec.name, error)
        return levels

    def _bake_image(self, asset: int, spec: DepthImageAsset) -> BakedModel:
        if spec.intrinsics is None:
            return BakedModel(parts=(bake_planar(read_relief(spec), key=""),))
        key = self.key(asset)
        return self._baked_once(spec.name, spec.depth, key, lambda: self._bake_range(asset, spec))

    def _bake_range(self, asset: int, spec: DepthImageAsset) -> BakedModel:
        self.report(spec.name, "reading")
        image, key = _read_keyed(spec)
        self._note_key(asset, key)
        self.report(spec.name, "resampling")
        with complaints_about(spec.depth):
            return BakedModel(parts=(bake_range(image, key),))


def read_meso(meso: MesoParams) -> Meso:
    """The relief that is laid over depth images. Raises InputError."""
    return load_meso(meso.depth, height=meso.height, tile=meso.tile, normal=meso.normal)


def read_relief(spec: DepthImageAsset) -> PlanarImage:
    """The planar depth image of an asset with a size. Raises InputError."""
    assert spec.size is not None  # the scene file has exactly one of size and intrinsics
    files = {"colour": spec.colour, "normal": spec.normal}
    return load_depth_image(spec.depth, size=spec.size, depth_range=spec.range, unit=spec.unit, **files)


def read_range_image(spec: DepthImageAsset) -> RangeImage:
    """The range image of an asset with intrinsics. Raises InputError."""
    assert spec.intrinsics is not None
    lens = Intrinsics(**spec.intrinsics.model_dump())
    return load_range_image(spec.depth, lens=lens, unit=spec.unit, colour=spec.colour, normal=spec.normal)


@contextmanager
def complaints_about(file: Path) -> Iterator[None]:
    """Puts the file's name before the complaint of whoever saw its contents only."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


def _read_keyed(spec: DepthImageAsset) -> tuple[RangeImage, str]:
    """The range image of an asset with intrinsics, and the key of its depth image.

    NPY and OpenEXR files are read by their names, not from bytes that could be hashed as well. So the files are hashed
    before and after, and read again where these differ. Raises InputError, also where they always do.
    """
    for _ in range(_READINGS):
        key, image = _range_key(spec), read_range_image(spec)
        if _range_key(spec) == key:
            return image, key
    raise InputError(f"{spec.depth}: it, or a picture that belongs to it, changes while it is read")


def _range_key(spec: DepthImageAsset) -> str:
    """The key of a range image's depth image."""
    assert spec.intrinsics is not None
    normal = None if spec.normal is None else source_hash(spec.normal)
    return bake_key(
        source_hash(spec.depth, spec.colour), normal=normal, unit=spec.unit, intrinsics=spec.intrinsics.model_dump()
    )
