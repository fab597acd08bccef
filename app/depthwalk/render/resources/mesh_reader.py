"""Read meshes in a background thread, one at a time, or at once where frames wait for them."""

import logging
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple

from depthwalk.errors import InputError
from depthwalk.ingest.mesh import MeshLevel
from depthwalk.ingest.solid import is_solid
from depthwalk.render.lod.mesh_lod import MOST_UNSIMPLIFIED, is_simplified
from depthwalk.render.resources.library import Library
from depthwalk.render.resources.meshlets import Meshlets, build_meshlets

log = logging.getLogger(__name__)


class FallbackMesh(NamedTuple):
    """Hold a fallback mesh as it was read, with what takes too long to compute during a frame.

    Attributes
    ----------
    levels
        The levels of detail, the finest first.
    meshlets
        The meshlets of each level; None for a level that is drawn whole.
    solid
        Whether back faces are never visible, see `is_solid`.
    is_simplified
        Whether `levels` includes the simplified levels; otherwise it holds only the mesh.
    is_clustered
        Whether the clusters have been read, too.
    is_preview
        Whether it is only a coarse mesh of a large file, see `Library.preview`.
    """

    levels: tuple[MeshLevel, ...]
    meshlets: tuple[Meshlets | None, ...]
    solid: bool
    is_simplified: bool
    is_clustered: bool
    is_preview: bool = False

    @property
    def is_better_simplified(self) -> bool:
        """Return whether it needs its simplified levels when it replaces depth images."""
        return is_simplified(len(self.levels[0].mesh.faces))


class MeshReader:
    """Read the meshes of assets, with what takes too long to compute during a frame.

    Parameters
    ----------
    library
        Provides the meshes.

    Attributes
    ----------
    meshes
        The meshes that have been read and not been dropped since, by the number of the asset.
    failures
        Messages about meshes that could not be read in the background, oldest first; the caller may clear the list.
    """

    def __init__(self, library: Library) -> None:
        self.meshes: dict[int, FallbackMesh] = {}
        self.failures: list[str] = []
        self._library = library
        self._failed: set[int] = set()
        self._thread: ThreadPoolExecutor | None = None
        self._reading: tuple[int, Future[FallbackMesh]] | None = None
        # Assets to be read in the background, and whether with simplified levels, with clusters, and not as a preview.
        self._awaited: dict[int, tuple[bool, bool, bool]] = {}
        self._replaced: set[int] = set()  # assets of which a preview was read before

    def read(self, asset: int, wait: bool) -> bool:
        """Read the mesh of an asset unless it has been read, with simplified levels if `is_simplified` asks for them.

        A mesh that was read as a placeholder may lack these levels, and is read again then.

        Parameters
        ----------
        asset
            The number of the asset.
        wait
            Whether to wait until it is read.

        Returns
        -------
        bool
            Whether it has been read or has failed. If not, it, or another mesh before it, is being read.

        Raises
        ------
        InputError
            For files that cannot be used, if `wait`; otherwise a message is added to `failures`.
        """
        known = self.meshes.get(asset)
        is_whole = known is not None and not known.is_preview and known.is_simplified >= known.is_better_simplified
        if asset in self._failed or is_whole:
            return True
        clustered = known is not None and known.is_clustered
        if wait:
            self._take(asset, self._read(asset, None, clustered))
            return True
        if self._reading is None:
            self._begin_reading(asset, None, clustered, True)
        return self._finish_reading() == asset

    def is_read(self, asset: int, simplified: bool = False, clustered: bool = False, whole: bool = False) -> bool:
        """Return whether a mesh has been read; if not, queue it for the background thread.

        Parameters
        ----------
        asset
            The number of the asset.
        simplified
            Whether its simplified levels are needed, too, regardless of its size.
        clustered
            Whether its clusters are needed, too.
        whole
            Whether a coarse preview of a large file will not do.

        Returns
        -------
        bool
            Whether `levels` returns what is asked for.
        """
        known = self.meshes.get(asset)
        needs = simplified, clustered, whole or simplified or clustered
        if known is not None and all(
            has >= need
            for has, need in zip((known.is_simplified, known.is_clustered, not known.is_preview), needs, strict=True)
        ):
            return True
        if asset not in self._failed:
            before = self._awaited.get(asset, (False, False, False))
            self._awaited[asset] = before[0] or needs[0], before[1] or needs[1], before[2] or needs[2]
        return False

    def take_replaced(self) -> set[int]:
        """Return the assets whose meshes have replaced a preview since the last call."""
        replaced, self._replaced = self._replaced, set()
        return replaced

    @property
    def is_reading(self) -> bool:
        """Return whether meshes that `is_read` was asked about are still to be read."""
        return bool(self._awaited)

    @property
    def is_busy(self) -> bool:
        """Return whether any mesh is still to be read in the background."""
        return bool(self._awaited) or self._reading is not None

    def levels(self, asset: int) -> tuple[MeshLevel, ...] | None:
        """Return the levels of a mesh that have been read.

        Parameters
        ----------
        asset
            The number of the asset.

        Returns
        -------
        tuple of MeshLevel | None
            The levels, the finest first; None where the mesh has not been read.
        """
        return self.meshes[asset].levels if asset in self.meshes else None

    def poll(self) -> bool:
        """Take over meshes from the thread and start the next; return whether one that `is_read` queued has arrived."""
        read = self._finish_reading()
        if self._reading is None and self._awaited:
            asset, needs = next(iter(self._awaited.items()))
            self._begin_reading(asset, *needs)
        return read is not None and self._awaited.pop(read, None) is not None

    def forget(self, asset: int) -> None:
        """Drop the mesh of an asset, in the library too, until it is asked for again."""
        del self.meshes[asset]
        self._library.forget_mesh(asset)

    def end(self) -> None:
        """Stop reading, and drop all meshes."""
        if self._thread is not None:
            self._thread.shutdown(wait=False, cancel_futures=True)
        self._thread = self._reading = None
        for known in self._awaited, self.meshes, self._failed, self._replaced:
            known.clear()

    def _begin_reading(self, asset: int, simplified: bool | None, clustered: bool, whole: bool) -> None:
        if self._thread is None:
            self._thread = ThreadPoolExecutor(1, "meshes")
        read = self._read if whole else self._preview
        self._reading = asset, self._thread.submit(read, asset, simplified, clustered)

    def _finish_reading(self) -> int | None:
        """Return the asset whose mesh the thread has just read, or failed to read; None while it is busy or idle."""
        if self._reading is None or not self._reading[1].done():
            return None
        (asset, future), self._reading = self._reading, None
        try:
            self._take(asset, future.result())
        except InputError as error:
            self._failed.add(asset)
            self.failures.append(str(error))
            log.warning("%s", error)  # bare: whoever takes `failures` may report it in these words, too
        return asset

    def _take(self, asset: int, read: FallbackMesh) -> None:
        """Keep the mesh of an asset that has just been read; note whether it replaces a preview."""
        before, self.meshes[asset] = self.meshes.get(asset), read
        if read.is_preview:
            return
        self._library.forget_preview(asset)  # which the library may have read ahead, even if nobody asked for it here
        if before is not None and before.is_preview:
            self._replaced.add(asset)

    def _preview(self, asset: int, simplified: bool | None, clustered: bool) -> FallbackMesh:
        """Read a coarse mesh of `asset` if its file is large, and otherwise all as `_read` does."""
        preview = self._library.preview(asset)
        if preview is None:
            return self._read(asset, simplified, clustered)
        return FallbackMesh(
            levels=(MeshLevel(preview, 0.0),),
            meshlets=(build_meshlets(preview),),
            solid=False,
            is_simplified=False,
            is_clustered=False,
            is_preview=True,
        )

    def _read(self, asset: int, simplified: bool | None, clustered: bool) -> FallbackMesh:
        """Read the mesh of `asset`, and compute what takes too long for a frame.

        simplified: whether its simplified levels are needed, regardless of its size; None: if `is_simplified` says so.
        """
        mesh = self._library.mesh(asset)
        assert mesh is not None  # the callers ask only for assets with a mesh
        if simplified is None:
            simplified = is_simplified(len(mesh.faces))
        simplified = simplified or len(mesh.faces) > MOST_UNSIMPLIFIED
        levels = self._library.mesh_levels(asset) if simplified else (MeshLevel(mesh, 0.0),)
        meshlets = tuple(build_meshlets(level.mesh) for level in levels)
        if clustered:
            self._library.mesh_clusters(asset)  # which the library keeps
        return FallbackMesh(
            levels=levels,
            meshlets=meshlets,
            solid=is_solid(mesh),
            is_simplified=simplified,
            is_clustered=clustered,
        )
