"""Keep the translucent and glowing triangles of meshes on the GPU, by the number of the asset."""

import logging
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.gpu.device import Scope
from depthwalk.ingest.mesh import Mesh
from depthwalk.render.resources.mesh_object import WHITE, upload_map
from depthwalk.render.resources.translucent_mesh import Texels, TextureRun, TranslucentMesh, gather_translucent

log = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class TranslucentObject:
    """Hold the translucent and glowing triangles of an asset on the GPU, whose GL objects belong to the asset store.

    Attributes
    ----------
    mesh
        The triangles.
    vertices
        The buffer of `mesh.vertices`.
    indices
        The buffer of `mesh.faces`, three uint32 per triangle.
    textures
        The textures of colour and of emission, by the identity of their texels; a white texel where there is none.
    normal_maps
        The normal maps of translucent triangles, by the identity of their texels.
    """

    mesh: TranslucentMesh
    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    textures: dict[int, moderngl.Texture]
    normal_maps: dict[int, moderngl.Texture]

    def use(self, run: TextureRun) -> None:
        """Bind the textures of a run of triangles: of colour to unit 0, of emission to unit 1."""
        self.textures[id(run.colour)].use(0)
        self.textures[id(run.emission)].use(1)

    def use_normal_map(self, run: TextureRun, unit: int) -> None:
        """Bind the normal map of a run of triangles, which has one, to a texture unit."""
        self.normal_maps[id(run.normal_map)].use(unit)

    @property
    def bytes(self) -> int:
        """Return how many bytes of GPU memory buffers and textures take."""
        textures = (*self.textures.values(), *self.normal_maps.values())
        texels = sum(texture.width * texture.height for texture in textures)
        return int(self.vertices.size + self.indices.size + 4 * texels * 4 / 3)


class TranslucentStore:
    """Read and upload the translucent and glowing triangles of an asset when it is first in sight.

    Parameters
    ----------
    gl
        The scope of the asset store, which owns the GL objects.
    read
        Returns the mesh of an asset; None where nothing of it is translucent or glows. May be called from a thread.
    count
        The number of assets.

    Attributes
    ----------
    objects
        The triangles, by the number of the asset.
    is_unknown
        (count,) bool, which assets `ask` was not called for yet.
    """

    def __init__(self, gl: Scope, read: Callable[[int], Mesh | None], count: int) -> None:
        self._gl, self._read = gl, read
        self.objects: dict[int, TranslucentObject] = {}
        self.is_unknown: NDArray[np.bool_] = np.ones(count, bool)
        self._reading: dict[int, Future[TranslucentMesh | None]] = {}
        self._thread: ThreadPoolExecutor | None = None  # created on first use

    @property
    def is_busy(self) -> bool:
        """Return whether anything is still being read in the background."""
        return bool(self._reading)

    @property
    def bytes(self) -> int:
        """Return how many bytes of GPU memory all objects take."""
        return sum(translucent.bytes for translucent in self.objects.values())

    def ask(self, assets: Iterable[int], wait: bool) -> None:
        """Read those of `assets` that are still unknown.

        Parameters
        ----------
        assets
            The numbers of the assets.
        wait
            Whether to wait until they are read; otherwise a thread reads them, and `poll` takes them over.

        Raises
        ------
        InputError
            For files that cannot be used, if `wait`.
        """
        for asset in assets:
            if not self.is_unknown[asset]:
                continue
            self.is_unknown[asset] = False
            if wait:
                self._show(asset, self._gathered(asset))
                continue
            self._thread = self._thread or ThreadPoolExecutor(1, "translucency")
            self._reading[asset] = self._thread.submit(self._gathered, asset)

    def poll(self) -> None:
        """Take over what was read in the background; files that cannot be used are logged as warnings."""
        for asset in [asset for asset, future in self._reading.items() if future.done()]:
            try:
                self._show(asset, self._reading.pop(asset).result())
            except InputError as error:  # drawing the asset's other surfaces reports it in these words, too
                log.warning("%s", error)

    def _gathered(self, asset: int) -> TranslucentMesh | None:
        mesh = self._read(asset)
        return None if mesh is None else gather_translucent(mesh)

    def _show(self, asset: int, mesh: TranslucentMesh | None) -> None:
        """Upload the triangles of an asset, if it has any."""
        if mesh is not None:
            self.objects[asset] = TranslucentObject(
                mesh=mesh,
                vertices=self._gl.buffer(mesh.vertices.view(np.uint8)),
                indices=self._gl.buffer(np.ascontiguousarray(mesh.faces)),
                textures=self._textures(mesh),
                normal_maps=self._normal_maps(mesh),
            )

    def _textures(self, mesh: TranslucentMesh) -> dict[int, moderngl.Texture]:
        runs = (*mesh.runs, *mesh.glowing)
        by_id: dict[int, Texels | None] = {id(texels): texels for run in runs for texels in (run.colour, run.emission)}
        return {number: self._texture(WHITE if texels is None else texels) for number, texels in by_id.items()}

    def _normal_maps(self, mesh: TranslucentMesh) -> dict[int, moderngl.Texture]:
        by_id = {id(run.normal_map): run.normal_map for run in mesh.runs}
        return {number: upload_map(self._gl, map_) for number, map_ in by_id.items() if map_ is not None}

    def _texture(self, texels: Texels) -> moderngl.Texture:
        return self._gl.srgb_texture(texels[::-1])

    def forget(self) -> None:
        """Drop all objects, because the scope has been released, and those being read; they may be asked for again."""
        if self._thread is not None:
            self._thread.shutdown(wait=False, cancel_futures=True)
        self._thread = None
        self.objects.clear()
        self._reading.clear()
        self.is_unknown[:] = True
