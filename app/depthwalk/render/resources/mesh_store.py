"""Keep meshes on the GPU, by the number of their asset.

The meshes of objects that the scene shows as meshes are uploaded when they are first drawn, and stay. Fallback meshes,
which are drawn instead of depth images that would only be magnified, are read when they are first needed. Where
frames may not wait, a thread reads them meanwhile. They go when others need their memory.
"""

import logging
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple, Protocol

from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.errors import InputError
from depthwalk.gpu.device import Scope
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.ingest.solid import is_solid
from depthwalk.render.resources.cluster_object import ClusterObject, upload_clusters
from depthwalk.render.resources.mesh_object import MeshLook, MeshObject, upload_look, upload_mesh
from depthwalk.render.resources.meshlets import Meshlets, build_meshlets

log = logging.getLogger(__name__)

# Triangles of a fallback mesh that is used without simplified levels: two cores draw so many in 30 ms, and simplifying
# them takes 4 s.
_MAX_UNSIMPLIFIED = 200_000


class MeshLibrary(Protocol):
    """Describe where meshes come from, by the number of their asset."""

    def mesh(self, asset: int) -> Mesh | None:
        """Return the mesh of an asset.

        Parameters
        ----------
        asset
            The number of the asset.

        Returns
        -------
        Mesh | None
            The mesh; None for an asset without a mesh.

        Raises
        ------
        InputError
            Where the file cannot be used.
        """
        ...

    def mesh_levels(self, asset: int) -> tuple[MeshLevel, ...]:
        """Return the mesh of an asset and its simplified levels.

        Parameters
        ----------
        asset
            The number of the asset.

        Returns
        -------
        tuple of MeshLevel
            The levels, the finest first; empty for an asset without a mesh.
        """
        ...

    def mesh_clusters(self, asset: int) -> MeshClusters | None:
        """Return the clusters of the mesh of the asset numbered `asset`; None where it has no mesh."""
        ...

    def forget_mesh(self, asset: int) -> None:
        """Free the memory of the mesh of the asset numbered `asset` and of its levels, until they are asked for."""
        ...


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
    is_clustered: bool = False


class MeshStore:
    """Upload meshes, each level when it is first drawn, and own their GL objects.

    Parameters
    ----------
    gl
        The scope of the asset store, which owns the GL objects.
    library
        Where meshes come from.

    Attributes
    ----------
    failures
        Complaints about meshes that could not be read beside the frames, oldest first; the caller may clear the list.
    """

    def __init__(self, gl: Scope, library: MeshLibrary) -> None:
        self._gl = gl
        self._library = library
        self._drawn: dict[int, dict[int, MeshObject]] = {}  # by asset and level
        self._looks: dict[int, MeshLook] = {}
        self._clusters: dict[int, ClusterObject] = {}
        self._fallbacks: dict[int, FallbackMesh] = {}
        self._requested: set[int] = set()  # in this frame
        self._requested_before: set[int] = set()  # in the frame before
        self._failed: set[int] = set()
        self._reader: ThreadPoolExecutor | None = None
        self._reading: tuple[int, Future[FallbackMesh]] | None = None
        # Assets to be read beside the frames, and whether with simplified levels, and with clusters.
        self._awaited: dict[int, tuple[bool, bool]] = {}
        self._shown: set[int] = set()  # of those that were awaited, what the scene shows as meshes
        self.failures: list[str] = []

    def object(self, asset: int, level: int = 0) -> MeshObject:
        """Return a level of the mesh of an asset, uploaded if it was not.

        Parameters
        ----------
        asset
            The number of the asset.
        level
            0 for the mesh itself; larger numbers for the simplified levels of `MeshLibrary.mesh_levels`.

        Returns
        -------
        MeshObject
            The level on the GPU.

        Raises
        ------
        LookupError
            Where the asset has no mesh.
        """
        self._requested.add(asset)
        levels = self._drawn.setdefault(asset, {})
        if level not in levels:
            mesh = self._library.mesh(asset)
            if mesh is None:
                raise LookupError(f"asset {asset} has no mesh")
            known = self._fallbacks.get(asset)
            self._look(asset, mesh)
            simplified = self._library.mesh_levels(asset)[level].mesh if level else mesh
            # The representation `mesh-lod` may ask for levels that the fallback mesh does not have.
            ready = known.meshlets[level : level + 1] if known else ()
            meshlets = ready[0] if ready else build_meshlets(simplified)
            levels[level] = upload_mesh(self._gl, simplified, self._looks[asset], meshlets)
        return levels[level]

    def clusters(self, asset: int) -> ClusterObject:
        """Return the clusters of the mesh of the asset numbered `asset`, uploaded if they were not.

        Raises LookupError where it has no mesh.
        """
        self._requested.add(asset)
        if asset not in self._clusters:
            mesh, clusters = self._library.mesh(asset), self._library.mesh_clusters(asset)
            if mesh is None or clusters is None:
                raise LookupError(f"asset {asset} has no mesh")
            self._clusters[asset] = upload_clusters(
                self._gl, clusters, self._look(asset, mesh), tuple(part.material for part in mesh.parts)
            )
        return self._clusters[asset]

    def _look(self, asset: int, mesh: Mesh) -> MeshLook:
        """Return the materials of the mesh of an asset, uploaded if they were not."""
        if asset not in self._looks:
            known = self._fallbacks.get(asset)
            self._looks[asset] = upload_look(self._gl, mesh, known.solid if known else is_solid(mesh))
        return self._looks[asset]

    def begin_frame(self) -> None:
        """Begin a frame: fallback meshes that neither it nor the frame before asks for may be released."""
        self._requested_before, self._requested = self._requested, set()

    def mesh_fallbacks(self, assets: Sequence[int], wait: bool) -> dict[int, tuple[MeshLevel, ...]]:
        """Return the levels of the fallback meshes that have been read, by asset.

        Parameters
        ----------
        assets
            The numbers of the assets whose meshes are to be read, the most urgent first.
        wait
            Whether to wait until all are read; otherwise they are read meanwhile, one by one.

        Returns
        -------
        dict[int, tuple[MeshLevel, ...]]
            The levels of each mesh, the finest first, by the number of its asset.

        Raises
        ------
        InputError
            For files that cannot be used, if `wait`; otherwise a warning names them, and depth images are shown.
        """
        self._requested.update(assets)
        for asset in assets:
            if asset in self._fallbacks or asset in self._failed:
                continue
            if wait:
                self._fallbacks[asset] = self._read(asset)
            elif not self._was_read(asset):
                break
        return {asset: self._fallbacks[asset].levels for asset in assets if asset in self._fallbacks}

    @property
    def fallback_bytes(self) -> int:
        """Return how many bytes of GPU memory the buffers of fallback meshes take."""
        levels = (level for asset in self._fallbacks for level in self._drawn.get(asset, {}).values())
        return sum(level.vertices.size + level.indices.size for level in levels)

    @property
    def unwanted_fallbacks(self) -> set[int]:
        """Return the numbers of the assets whose fallback meshes may be released.

        No recent frame has asked for these, and the scene does not show them in place of depth images.
        """
        return self._fallbacks.keys() - self._requested - self._requested_before - self._shown

    def release_fallbacks(self, assets: set[int]) -> None:
        """Release fallback meshes and the memory of their levels. No pass may still hold vertex arrays over them.

        Parameters
        ----------
        assets
            The numbers of the assets whose fallback meshes are released.
        """
        for asset in assets:
            for level in self._drawn.pop(asset, {}).values():
                self._gl.free(level.vertices, level.indices)
            if asset in self._clusters:
                self._clusters.pop(asset).free(self._gl)
            if asset in self._looks:
                self._gl.free(*(material.texture for material in self._looks.pop(asset).materials))
            del self._fallbacks[asset]
            self._library.forget_mesh(asset)

    def forget(self) -> None:
        """Forget all meshes and stop reading; call this when the scope has released its GL objects."""
        if self._reader is not None:
            self._reader.shutdown(wait=False, cancel_futures=True)
        self._reader = self._reading = None
        self._awaited.clear()
        for known in (
            self._shown,
            self._drawn,
            self._clusters,
            self._looks,
            self._fallbacks,
            self._requested,
            self._requested_before,
            self._failed,
        ):
            known.clear()

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
        known = self._fallbacks.get(asset)
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
        return self._fallbacks[asset].levels if asset in self._fallbacks else None

    def show(self, assets: set[int]) -> None:
        """Keep the meshes of the assets with the numbers `assets`, which the scene shows in place of depth images."""
        self._shown = assets

    def poll(self) -> bool:
        """Go on with reading meshes beside the frames; return whether one has come that `is_read` was asked for."""
        read = self._take_read()
        if self._reading is None and self._awaited:
            asset, needs = next(iter(self._awaited.items()))
            self._begin_reading(asset, *needs)
        return read is not None and self._awaited.pop(read, None) is not None

    def _was_read(self, asset: int) -> bool:
        """Return whether reading the mesh of `asset` has ended, well or not; begin it when no other is being read."""
        if self._reading is None:
            self._begin_reading(asset)
        return self._take_read() == asset

    def _begin_reading(self, asset: int, simplified: bool = False, clustered: bool = False) -> None:
        if self._reader is None:
            self._reader = ThreadPoolExecutor(1, "meshes")
        self._reading = asset, self._reader.submit(self._read, asset, simplified, clustered)

    def _take_read(self) -> int | None:
        """Return the number of the asset whose mesh a thread has finished reading, well or not; None where it reads."""
        if self._reading is None or not self._reading[1].done():
            return None
        (asset, future), self._reading = self._reading, None
        try:
            self._fallbacks[asset] = future.result()
        except InputError as error:
            self._failed.add(asset)
            self.failures.append(str(error))
            log.warning("a mesh cannot be shown: %s", error)
        return asset

    def _read(self, asset: int, simplified: bool = False, clustered: bool = False) -> FallbackMesh:
        """Read the mesh of `asset`, and find out what takes too long for a frame."""
        mesh = self._library.mesh(asset)
        assert mesh is not None  # an asset that has one, says the library
        simplified = simplified or len(mesh.faces) > _MAX_UNSIMPLIFIED
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
