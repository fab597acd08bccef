"""Keep meshes on the GPU, by the number of their asset.

Meshes of objects that the scene shows as meshes are uploaded when they are first drawn, and stay. Fallback meshes,
which replace depth images near by or where they are quicker, are read when they are first needed; where frames may not
wait, by a thread (`mesh_reader`). They are evicted when other assets need their memory.
"""

from collections.abc import Sequence

from depthwalk.gpu.device import Scope
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.ingest.solid import is_solid
from depthwalk.render.resources.cluster_object import ClusterObject, upload_clusters
from depthwalk.render.resources.library import Library
from depthwalk.render.resources.mesh_object import MeshLook, MeshObject, upload_look, upload_mesh
from depthwalk.render.resources.mesh_reader import MeshReader
from depthwalk.render.resources.meshlets import build_meshlets


class MeshStore:
    """Upload meshes, each level when it is first drawn, and own their GL objects.

    Parameters
    ----------
    gl
        The scope of the asset store, which owns the GL objects.
    library
        Provides the meshes.

    Attributes
    ----------
    reader
        Reads fallback meshes and placeholders.
    """

    def __init__(self, gl: Scope, library: Library) -> None:
        self._gl = gl
        self._library = library
        self._drawn: dict[int, dict[int, MeshObject]] = {}  # by asset and level
        self._looks: dict[int, MeshLook] = {}
        self._unlit: set[int] = set()  # of these, those with materials that are shown without light
        self._reflecting: set[int] = set()  # and those with materials that reflect the sky
        self._clusters: dict[int, ClusterObject] = {}
        self._requested: set[int] = set()  # in this frame
        self._requested_before: set[int] = set()  # in the frame before
        self._shown: set[int] = set()  # of the reader's meshes, those that the scene shows as placeholders or meshes
        self.reader = MeshReader(library)

    def object(self, asset: int, level: int = 0) -> MeshObject:
        """Return a level of the mesh of an asset, uploading it if necessary.

        Parameters
        ----------
        asset
            The number of the asset.
        level
            0 for the mesh itself; larger numbers for the simplified levels of `Library.mesh_levels`.

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
            mesh = self._library.drawn_mesh(asset)
            if mesh is None:
                raise LookupError(f"asset {asset} has no mesh")
            known = self.reader.meshes.get(asset)
            self._look(asset, mesh)
            simplified = self._library.mesh_levels(asset)[level].mesh if level else mesh
            # The representation `mesh-lod` may ask for levels that the fallback mesh was read without.
            ready = known.meshlets[level : level + 1] if known else ()
            meshlets = ready[0] if ready else build_meshlets(simplified)
            levels[level] = upload_mesh(self._gl, simplified, self._looks[asset], meshlets)
        return levels[level]

    def clusters(self, asset: int) -> ClusterObject:
        """Return the clusters of the mesh of the asset numbered `asset`, uploading them if necessary.

        Raises LookupError where it has no mesh.
        """
        self._requested.add(asset)
        if asset not in self._clusters:
            mesh, clusters = self._library.mesh(asset), self._library.mesh_clusters(asset)
            if mesh is None or clusters is None:
                raise LookupError(f"asset {asset} has no mesh")
            self._clusters[asset] = upload_clusters(
                self._gl, clusters, self._look(asset, mesh, clusters.solid), tuple(part.material for part in mesh.parts)
            )
        return self._clusters[asset]

    def _look(self, asset: int, mesh: Mesh, solid: bool | None = None) -> MeshLook:
        """Return the materials of the mesh of an asset, uploading them if necessary. solid: `is_solid`, if known."""
        if asset not in self._looks:
            if solid is None:
                known = self.reader.meshes.get(asset)
                solid = known.solid if known else is_solid(mesh)
            self._looks[asset] = upload_look(self._gl, mesh, solid)
            if self._looks[asset].has_unlit:
                self._unlit.add(asset)
            if self._looks[asset].reflects:
                self._reflecting.add(asset)
        return self._looks[asset]

    @property
    def has_unlit(self) -> bool:
        """Return whether any of the meshes has a material that is shown without light."""
        return bool(self._unlit)

    @property
    def reflects(self) -> bool:
        """Return whether any of the meshes has a material that reflects the sky."""
        return bool(self._reflecting)

    def begin_frame(self) -> None:
        """Begin a frame: fallback meshes that neither it nor the last frame asks for may be released."""
        self._requested_before, self._requested = self._requested, set()

    def mesh_fallbacks(self, assets: Sequence[int], wait: bool) -> dict[int, tuple[MeshLevel, ...]]:
        """Return the levels of the fallback meshes that have been read, by asset.

        Parameters
        ----------
        assets
            The numbers of the assets whose meshes are to be read, the most urgent first.
        wait
            Whether to wait until all are read; otherwise they are read in the background, one by one.

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
            if not self.reader.read(asset, wait):
                break
        read = self.reader.meshes
        return {asset: read[asset].levels for asset in assets if asset in read and not read[asset].is_preview}

    @property
    def fallback_bytes(self) -> int:
        """Return how many bytes of GPU memory the buffers of fallback meshes take."""
        return self._bytes(set(self.reader.meshes))

    @property
    def wanted_bytes(self) -> int:
        """Return `fallback_bytes` without those of `unwanted_fallbacks`."""
        return self._bytes(self.reader.meshes.keys() - self.unwanted_fallbacks)

    def _bytes(self, assets: set[int]) -> int:
        """Return how many bytes of GPU memory the mesh buffers of `assets` take."""
        levels = (level for asset in assets for level in self._drawn.get(asset, {}).values())
        return sum(level.vertices.size + level.indices.size for level in levels)

    @property
    def unwanted_fallbacks(self) -> set[int]:
        """Return the numbers of the assets whose fallback meshes may be released.

        Neither of the last two frames has asked for them, and the scene does not show them as placeholders.
        """
        return self.reader.meshes.keys() - self._requested - self._requested_before - self._shown

    def release_fallbacks(self, assets: set[int]) -> None:
        """Release fallback meshes and the memory of their levels. No pass may still hold vertex arrays over them.

        Parameters
        ----------
        assets
            The numbers of the assets whose fallback meshes are released.
        """
        self.free(assets)
        for asset in assets:
            self.reader.forget(asset)

    def free(self, assets: set[int]) -> None:
        """Free what the GPU holds of the meshes of `assets`. No pass may still hold vertex arrays over them."""
        for asset in assets:
            for level in self._drawn.pop(asset, {}).values():
                self._gl.free(level.vertices, level.indices)
            if asset in self._clusters:
                self._clusters.pop(asset).free(self._gl)
            if asset in self._looks:
                self._gl.free(*(texture for look in self._looks.pop(asset).materials for texture in look.textures))
            self._unlit.discard(asset)
            self._reflecting.discard(asset)

    def forget(self) -> None:
        """Drop all meshes and stop reading; call this when the scope has released its GL objects."""
        self.reader.end()
        for known in (
            self._shown,
            self._drawn,
            self._clusters,
            self._looks,
            self._unlit,
            self._reflecting,
            self._requested,
            self._requested_before,
        ):
            known.clear()

    def show(self, assets: set[int]) -> None:
        """Keep the meshes of the assets with the numbers `assets`, which the scene shows as placeholders or meshes."""
        self._shown = assets
