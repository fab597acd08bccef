"""Meshes on the GPU, by the number of their asset. Those that stand in for depth images are read when they are first
wanted, beside the frames where these may not wait, and go when others need their memory."""

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

# Triangles of a mesh that stands in as it is. Two cores draw so many in 30 ms; to simplify them takes 4 s.
_FEW = 200_000


class MeshLibrary(Protocol):
    """Where meshes come from, by the number of their asset."""

    def mesh(self, asset: int) -> Mesh | None: ...
    def mesh_levels(self, asset: int) -> tuple[MeshLevel, ...]: ...
    def forget_mesh(self, asset: int) -> None: ...


class FallbackMesh(NamedTuple):
    """levels: of detail; meshlets: of each level; solid: see `is_solid`. Both take too long for a frame."""

    levels: tuple[MeshLevel, ...]
    meshlets: tuple[Meshlets | None, ...]
    solid: bool


class MeshStore:
    """Uploads meshes, a level when it is first drawn, and owns their GL objects."""

    def __init__(self, gl: Scope, library: MeshLibrary) -> None:
        self._gl = gl
        self._library = library
        self._drawn: dict[int, dict[int, MeshObject]] = {}  # by asset and level
        self._looks: dict[int, MeshLook] = {}
        self._stand_ins: dict[int, FallbackMesh] = {}
        self._wanted: set[int] = set()  # in this frame, and in the one before
        self._wanted_before: set[int] = set()
        self._failed: set[int] = set()
        self._reader: ThreadPoolExecutor | None = None
        self._coming: tuple[int, Future[FallbackMesh]] | None = None

    def object(self, asset: int, level: int = 0) -> MeshObject:
        """Level 0 is the mesh itself, others are those of `Library.mesh_levels`. Raises LookupError where there is no
        mesh."""
        self._wanted.add(asset)
        levels = self._drawn.setdefault(asset, {})
        if level not in levels:
            mesh = self._library.mesh(asset)
            if mesh is None:
                raise LookupError(f"asset {asset} has no mesh")
            known = self._stand_ins.get(asset)
            if asset not in self._looks:
                self._looks[asset] = upload_look(self._gl, mesh, known.solid if known else is_solid(mesh))
            drawn = self._library.mesh_levels(asset)[level].mesh if level else mesh
            # `mesh-lod` may ask for levels coarser than those that stand in.
            ready = known.meshlets[level : level + 1] if known else ()
            meshlets = ready[0] if ready else build_meshlets(drawn)
            levels[level] = upload_mesh(self._gl, drawn, self._looks[asset], meshlets)
        return levels[level]

    def begin_frame(self) -> None:
        """What was wanted before the last frame and not since may go."""
        self._wanted_before, self._wanted = self._wanted, set()

    def mesh_fallbacks(self, assets: Sequence[int], wait: bool) -> dict[int, tuple[MeshLevel, ...]]:
        """The levels of those of `assets` that are there. wait: until all are; else the others are read meanwhile, in
        that order. Raises InputError for files that cannot be used, where somebody waits for them."""
        self._wanted.update(assets)
        for asset in assets:
            if asset in self._stand_ins or asset in self._failed:
                continue
            if wait:
                self._stand_ins[asset] = self._read(asset)
            elif not self._came(asset):
                break
        return {asset: self._stand_ins[asset].levels for asset in assets if asset in self._stand_ins}

    @property
    def stand_in_bytes(self) -> int:
        """What they take on the GPU."""
        levels = (level for asset in self._stand_ins for level in self._drawn.get(asset, {}).values())
        return sum(level.vertices.size + level.indices.size for level in levels)

    @property
    def unwanted(self) -> set[int]:
        """The stand-ins that may go."""
        return self._stand_ins.keys() - self._wanted - self._wanted_before

    def let_go(self, assets: set[int]) -> None:
        """Releases these stand-ins. No pass may still hold anything of them."""
        for asset in assets:
            for level in self._drawn.pop(asset, {}).values():
                self._gl.free(level.vertices, level.indices)
            if asset in self._looks:
                self._gl.free(*(material.texture for material in self._looks.pop(asset).materials))
            del self._stand_ins[asset]
            self._library.forget_mesh(asset)

    def forget(self) -> None:
        """To be called when the scope has released what it made."""
        if self._reader is not None:
            self._reader.shutdown(wait=False, cancel_futures=True)
        self._reader = self._coming = None
        for kept in (self._drawn, self._looks, self._stand_ins, self._wanted, self._wanted_before, self._failed):
            kept.clear()

    def _came(self, asset: int) -> bool:
        """Whether `asset` has been read, or never will be; its reading begins when no other's is under way."""
        if self._coming is None:
            if self._reader is None:
                self._reader = ThreadPoolExecutor(1, "meshes")
            self._coming = asset, self._reader.submit(self._read, asset)
        came, future = self._coming
        if not future.done():
            return False
        self._coming = None
        try:
            self._stand_ins[came] = future.result()
        except InputError as error:
            self._failed.add(came)
            log.warning("no mesh stands in for depth images near by: %s", error)
        return came == asset

    def _read(self, asset: int) -> FallbackMesh:
        mesh = self._library.mesh(asset)
        assert mesh is not None  # an asset that has one, says the library
        few = len(mesh.faces) <= _FEW
        levels = (MeshLevel(mesh, 0.0),) if few else self._library.mesh_levels(asset)
        return FallbackMesh(levels, tuple(build_meshlets(level.mesh) for level in levels), is_solid(mesh))
