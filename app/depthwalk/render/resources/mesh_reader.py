"""Read meshes beside the frames, one at a time, or at once where frames wait."""

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
    """Hold a fallback mesh as it was read, with what takes too long to find out while a frame waits.

    Attributes
    ----------
    levels
        The levels of detail, the finest first.
    meshlets
        The meshlets of each level; None for a level that is drawn whole.
    solid
        Whether nobody sees a back face, see `is_solid`.
    is_simplified
        Whether `levels` holds the simplified levels, too; otherwise it holds the mesh alone.
    is_clustered
        Whether the clusters have been read, too.
    """

    levels: tuple[MeshLevel, ...]
    meshlets: tuple[Meshlets | None, ...]
    solid: bool
    is_simplified: bool
    is_clustered: bool

    @property
    def is_better_simplified(self) -> bool:
        """Return whether it needs the simplified levels where it replaces depth images."""
        return is_simplified(len(self.levels[0].mesh.faces))


class MeshReader:
    """Read the meshes of assets, with what takes too long to find out while a frame waits.

    Parameters
    ----------
    library
        Where meshes come from.

    Attributes
    ----------
    meshes
        What has been read and not been forgotten, by the number of the asset.
    failures
        Complaints about meshes that could not be read beside the frames, oldest first; the caller may clear the list.
    """

    def __init__(self, library: Library) -> None:
        self.meshes: dict[int, FallbackMesh] = {}
        self.failures: list[str] = []
        self._library = library
        self._failed: set[int] = set()
        self._thread: ThreadPoolExecutor | None = None
        self._reading: tuple[int, Future[FallbackMesh]] | None = None
        # Assets to be read beside the frames, and whether with simplified levels, and with clusters.
        self._awaited: dict[int, tuple[bool, bool]] = {}

    def read(self, asset: int, wait: bool) -> bool:
        """Have the mesh of an asset read, unless it was, with its simplified levels where it is light or heavy.

        One that was read to stand in for depth images lacks these levels, and is read once more.

        Parameters
        ----------
        asset
            The number of the asset.
        wait
            Whether to wait until it is read.

        Returns
        -------
        bool
            Whether reading it has ended, well or not. If not, it is being read, or another one.

        Raises
        ------
        InputError
            For files that cannot be used, if `wait`; otherwise `failures` tells it.
        """
        known = self.meshes.get(asset)
        if asset in self._failed or (known is not None and known.is_simplified >= known.is_better_simplified):
            return True
        clustered = known is not None and known.is_clustered
        if wait:
            self.meshes[asset] = self._read(asset, None, clustered)
            return True
        if self._reading is None:
            self._begin_reading(asset, None, clustered)
        return self._take_read() == asset

    def is_read(self, asset: int, simplified: bool = False, clustered: bool = False) -> bool:
        """Return whether a mesh has been read; if not, a thread reads it when its turn comes.

        Parameters
        ----------
        asset
            The number of the asset.
        simplified
            Whether its simplified levels are needed, too, however few triangles it has.
        clustered
            Whether its clusters are needed, too.

        Returns
        -------
        bool
            Whether `levels` returns what is asked for.
        """
        known = self.meshes.get(asset)
        if known is not None and known.is_simplified >= simplified and known.is_clustered >= clustered:
            return True
        if asset not in self._failed:
            before = self._awaited.get(asset, (False, False))
            self._awaited[asset] = before[0] or simplified, before[1] or clustered
        return False

    @property
    def is_reading(self) -> bool:
        """Return whether meshes that `is_read` was asked about are still to be read."""
        return bool(self._awaited)

    @property
    def is_busy(self) -> bool:
        """Return whether any mesh is still to be read beside the frames."""
        return bool(self._awaited) or self._reading is not None

    def levels(self, asset: int) -> tuple[MeshLevel, ...] | None:
        """Return the levels of a mesh as far as a thread has read them.

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
        """Go on with reading meshes beside the frames; return whether one has come that `is_read` was asked for."""
        read = self._take_read()
        if self._reading is None and self._awaited:
            asset, needs = next(iter(self._awaited.items()))
            self._begin_reading(asset, *needs)
        return read is not None and self._awaited.pop(read, None) is not None

    def forget(self, asset: int) -> None:
        """Forget the mesh of an asset, in the library too, until it is asked for again."""
        del self.meshes[asset]
        self._library.forget_mesh(asset)

    def end(self) -> None:
        """Stop reading, and forget all meshes."""
        if self._thread is not None:
            self._thread.shutdown(wait=False, cancel_futures=True)
        self._thread = self._reading = None
        for known in self._awaited, self.meshes, self._failed:
            known.clear()

    def _begin_reading(self, asset: int, simplified: bool | None, clustered: bool) -> None:
        if self._thread is None:
            self._thread = ThreadPoolExecutor(1, "meshes")
        self._reading = asset, self._thread.submit(self._read, asset, simplified, clustered)

    def _take_read(self) -> int | None:
        """Return the number of the asset whose mesh a thread has finished reading, well or not; None where it reads."""
        if self._reading is None or not self._reading[1].done():
            return None
        (asset, future), self._reading = self._reading, None
        try:
            self.meshes[asset] = future.result()
        except InputError as error:
            self._failed.add(asset)
            self.failures.append(str(error))
            log.warning("a mesh cannot be shown: %s", error)
        return asset

    def _read(self, asset: int, simplified: bool | None, clustered: bool) -> FallbackMesh:
        """Read the mesh of `asset`, and find out what takes too long for a frame.

        simplified: whether its simplified levels are needed, however few triangles it has; None: where it is light.
        """
        mesh = self._library.mesh(asset)
        assert mesh is not None  # an asset that has one, says the library
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
