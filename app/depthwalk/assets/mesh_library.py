"""Provide the meshes of a scene's assets, and what is derived from them: levels, clusters, captured views."""

from collections.abc import Callable
from functools import partial

from depthwalk.assets import derived_data
from depthwalk.assets.asset_files import is_large, read_hashed, read_preview, read_translucent
from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.scene.scene import Asset, BakedAsset, MeshAsset

Report = Callable[[str, str], None]
"""Called with the name of an asset, and the stage that begins."""


class MeshLibrary:
    """Read the meshes of a scene's assets, by their numbers, when they are first requested.

    Meshes, their levels and clusters are kept in memory until `forget_mesh`. Every method raises InputError for files
    that cannot be used.

    Attributes
    ----------
    report
        Called with the name of an asset and the stage that begins; may be replaced.
    """

    def __init__(self, assets: tuple[Asset, ...], report: Report) -> None:
        """Create a library of the meshes of `assets`, by number; nothing is read yet. `report`: see the class."""
        self._assets = assets
        self.report = report
        self._meshes: dict[int, tuple[Mesh, str]] = {}  # with the hash of the bytes that they were read from
        self._levels: dict[int, tuple[MeshLevel, ...]] = {}
        self._clusters: dict[int, MeshClusters | None] = {}
        self._previews: dict[int, Mesh] = {}

    def has_mesh(self, asset: int) -> bool:
        """Return whether the asset numbered `asset` has a mesh, without reading it."""
        return _mesh_spec(self._assets[asset]) is not None

    def mesh(self, asset: int) -> Mesh | None:
        """Return the mesh of the asset numbered `asset`, asset frame, metres; None if it has none."""
        spec = _mesh_spec(self._assets[asset])
        if spec is None:
            return None
        if asset not in self._meshes:
            self._meshes[asset] = self._read_mesh(spec)
        return self._meshes[asset][0]

    def has_preview(self, asset: int) -> bool:
        """Return whether a coarse mesh of the asset numbered `asset` is read first, because its file is large."""
        spec = _mesh_spec(self._assets[asset])
        return spec is not None and is_large(spec)

    def preview(self, asset: int) -> Mesh | None:
        """Return a coarse mesh of the asset numbered `asset`, if its file is large and has not been read yet.

        From then on `drawn_mesh` returns it, until `forget_preview`.
        """
        spec = _mesh_spec(self._assets[asset])
        if spec is None or asset in self._meshes:
            return None
        if asset not in self._previews and (preview := read_preview(spec)) is not None:
            self._previews[asset] = preview
        return self._previews.get(asset)

    def forget_preview(self, asset: int) -> None:
        """Drop the coarse mesh of the asset numbered `asset`, so that `drawn_mesh` returns the whole one."""
        self._previews.pop(asset, None)

    def drawn_mesh(self, asset: int) -> Mesh | None:
        """Return the mesh of the asset numbered `asset` as it is drawn now: its preview, or else all of it."""
        preview = self._previews.get(asset)
        return self.mesh(asset) if preview is None else preview

    def mesh_levels(self, asset: int) -> tuple[MeshLevel, ...]:
        """Return the mesh of the asset numbered `asset` and its simplified levels, the finest first.

        The result is empty if the asset has no mesh.
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
        """Return the clusters of the mesh of the asset numbered `asset`; None if it has no mesh."""
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
        """Return views of the mesh of the asset numbered `asset`, captured with `params`; None if it has no mesh.

        They are not kept in memory.
        """
        spec, mesh = _mesh_spec(self._assets[asset]), self.mesh(asset)
        if spec is None or mesh is None:
            return None
        return derived_data.captured_views(spec, *self._meshes[asset], params, partial(self.report, spec.name))

    def translucent_mesh(self, asset: int) -> Mesh | None:
        """Return the mesh of the asset numbered `asset` if any of it is translucent or glows, otherwise None.

        The mesh is not kept in memory.
        """
        spec = _mesh_spec(self._assets[asset])
        if spec is None:
            return None
        known = self._meshes.get(asset)  # looked up once, since other threads forget meshes
        if known is not None:
            return known[0] if known[0].is_translucent else None
        return read_translucent(spec)

    def take_mesh(self, asset: int, mesh: Mesh, source: str) -> None:
        """Store `mesh` as that of the asset numbered `asset`; `source` is the hash of the bytes it was read from."""
        self._meshes[asset] = mesh, source

    def forget_mesh(self, asset: int) -> None:
        """Free the memory of the mesh and levels of the asset numbered `asset`, until they are requested again."""
        self._meshes.pop(asset, None)
        self._levels.pop(asset, None)
        self._clusters.pop(asset, None)
        self._previews.pop(asset, None)

    def _read_mesh(self, spec: MeshAsset) -> tuple[Mesh, str]:
        """Read the mesh of an asset, and report it."""
        self.report(spec.name, "reading")
        return read_hashed(spec)


def _mesh_spec(spec: Asset) -> MeshAsset | None:
    """Return how the mesh of an asset is read; None if it has none."""
    if isinstance(spec, BakedAsset):
        return spec.source
    return spec if isinstance(spec, MeshAsset) else None
