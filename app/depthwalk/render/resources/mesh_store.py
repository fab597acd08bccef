"""Keep meshes on the GPU, by the number of their asset.

The meshes of objects that the scene shows as meshes are uploaded when they are first drawn, and stay. Fallback meshes,
which are drawn instead of depth images that would only be magnified, are read when they are first needed. Where
frames may not wait, a thread reads them meanwhile. They go when others need their memory.
"""

import logging
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple, Protocol

from depthwalk.errors import InputError
from depthwalk.gpu.device import Scope
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.render.resources.mesh_object import MeshLook, MeshObject, is_solid, upload_look, upload_mesh
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
        """Return the mesh of `asset`, its number, and its simplified levels, the finest first; none without a mesh."""
        ...

    def forget_mesh(self, asset: int) -> None:
        """Free the memory of the mesh of `asset`, its number, and of its levels, until they are asked for again."""
        ...


class FallbackMesh(NamedTuple):
    """Hold a fallback mesh as it was read, with what takes too long to find out while a frame waits.

    Attributes
    ----------
    levels
        The levels of detail, the finest first.
    meshlets
        The meshlets of each level.
    solid
        Whether nobody sees a back face, see `is_solid`.
    """

    levels: tuple[MeshLevel, ...]
    meshlets: tuple[Meshlets | None, ...]
    solid: bool


class MeshStore:
    """Upload meshes, each level when it is first drawn, and own their GL objects."""

    def __init__(self, gl: Scope, library: MeshLibrary) -> None:
        """Make an empty store: `gl` is the asset store's scope, `library` says where meshes come from."""
        self._gl = gl
        self._library = library
        self._drawn: dict[int, dict[int, MeshObject]] = {}  # by asset and level
        self._looks: dict[int, MeshLook] = {}
        self._fallbacks: dict[int, FallbackMesh] = {}
        self._requested: set[int] = set()  # in this frame
        self._requested_before: set[int] = set()  # in the frame before
        self._failed: set[int] = set()
        self._reader: ThreadPoolExecutor | None = None
        self._reading: tuple[int, Future[FallbackMesh]] | None = None

    def object(self, asset: int, level: int = 0) -> MeshObject:
        """Return a level of the mesh of an asset, uploaded if it was not.

        Parameters
        ----------
        asset
            The number of the asset.
        level
            0 for the mesh itself, others by `MeshLibrary.mesh_levels`.

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
            if asset not in self._looks:
                self._looks[asset] = upload_look(self._gl, mesh, known.solid if known else is_solid(mesh))
            simplified = self._library.mesh_levels(asset)[level].mesh if level else mesh
            # The representation `mesh-lod` may ask for levels that the fallback mesh does not have.
            ready = known.meshlets[level : level + 1] if known else ()
            meshlets = ready[0] if ready else build_meshlets(simplified)
            levels[level] = upload_mesh(self._gl, simplified, self._looks[asset], meshlets)
        return levels[level]

    def begin_frame(self) -> None:
        """Begin a frame: fallback meshes may be released that neither it nor the frame before has asked for."""
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
        """Bytes of GPU memory that the buffers of fallback meshes take."""
        levels = (level for asset in self._fallbacks for level in self._drawn.get(asset, {}).values())
        return sum(level.vertices.size + level.indices.size for level in levels)

    @property
    def unwanted_fallbacks(self) -> set[int]:
        """Numbers of the assets whose fallback meshes may be released, because no recent frame has asked for them."""
        return self._fallbacks.keys() - self._requested - self._requested_before

    def release_fallbacks(self, assets: set[int]) -> None:
        """Release the fallback meshes of `assets`, their numbers. No pass may still hold vertex arrays over them."""
        for asset in assets:
            for level in self._drawn.pop(asset, {}).values():
                self._gl.free(level.vertices, level.indices)
            if asset in self._looks:
                self._gl.free(*(material.texture for material in self._looks.pop(asset).materials))
            del self._fallbacks[asset]
            self._library.forget_mesh(asset)

    def forget(self) -> None:
        """Forget all meshes and stop reading; call this when the scope has released its GL objects."""
        if self._reader is not None:
            self._reader.shutdown(wait=False, cancel_futures=True)
        self._reader = self._reading = None
        for known in (self._drawn, self._looks, self._fallbacks, self._requested, self._requested_before, self._failed):
            known.clear()

    def _was_read(self, asset: int) -> bool:
        """Return whether reading the mesh of `asset` has ended, well or not; begin it when no other is being read."""
        if self._reading is None:
            if self._reader is None:
                self._reader = ThreadPoolExecutor(1, "meshes")
            self._reading = asset, self._reader.submit(self._read, asset)
        reading, future = self._reading
        if not future.done():
            return False
        self._reading = None
        try:
            self._fallbacks[reading] = future.result()
        except InputError as error:
            self._failed.add(reading)
            log.warning("no mesh stands in for depth images near by: %s", error)
        return reading == asset

    def _read(self, asset: int) -> FallbackMesh:
        """Read the mesh of `asset`, and find out what takes too long for a frame."""
        mesh = self._library.mesh(asset)
        assert mesh is not None  # an asset that has one, says the library
        is_small = len(mesh.faces) <= _MAX_UNSIMPLIFIED
        levels = (MeshLevel(mesh, 0.0),) if is_small else self._library.mesh_levels(asset)
        return FallbackMesh(levels, tuple(build_meshlets(level.mesh) for level in levels), is_solid(mesh))
