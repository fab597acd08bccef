"""Define the protocols of what provides assets to the renderer: a library, and a background that prepares them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from depthwalk.assets.demand import AssetCapabilities
from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.bake.model import BakedModel
from depthwalk.cook.cook import CookedObject, CookOptions
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.ingest.mesh import Mesh, MeshLevel


class Library(AssetCapabilities, Protocol):
    """Provide assets to the renderer, by number; the renderer itself reads no files.

    Every method that reads files raises InputError for those that cannot be used.
    """

    def mesh(self, asset: int) -> Mesh | None:
        """Return the mesh of the asset numbered `asset`; None where it has none."""
        ...

    def preview(self, asset: int) -> Mesh | None:
        """Return a coarse mesh of the asset numbered `asset` if its own takes long to read; None where it does not."""
        ...

    def forget_preview(self, asset: int) -> None:
        """Drop the coarse mesh of the asset numbered `asset`."""
        ...

    def drawn_mesh(self, asset: int) -> Mesh | None:
        """Return the coarse mesh of the asset numbered `asset` until that is dropped, or else `mesh`."""
        ...

    def mesh_levels(self, asset: int) -> tuple[MeshLevel, ...]:
        """Return the mesh of the asset numbered `asset` and its levels, the finest first; empty where it has none."""
        ...

    def mesh_clusters(self, asset: int) -> MeshClusters | None:
        """Return the clusters of the mesh of the asset numbered `asset`; None where it has no mesh."""
        ...

    def forget_mesh(self, asset: int) -> None:
        """Free the memory of the mesh and levels of the asset numbered `asset`, until they are asked for again."""
        ...

    def is_shipped_cooked(self, asset: int) -> bool:
        """Return whether the asset numbered `asset` exists only cooked, so that `baked` would raise InputError."""
        ...

    def bake_missing(self, assets: Sequence[int]) -> None:
        """Bake the missing depth images of assets with the numbers `assets`, several at a time if possible."""
        ...

    def cooked(self, asset: int, options: CookOptions, *, again: bool = False) -> tuple[CookedObject, ...]:
        """Return the cooked depth images of an asset, baking and cooking them if necessary.

        Parameters
        ----------
        asset
            The number of the asset.
        options
            How it is cooked.
        again
            Whether to ignore the cache, because its file cannot be loaded; the arrays then stay in memory.

        Returns
        -------
        tuple of CookedObject
            One object for each part of the asset.
        """
        ...

    def baked(self, asset: int) -> BakedModel | None:
        """Return the depth images of the asset numbered `asset`, baking them if necessary; None where it has none."""
        ...

    def captured_views(self, asset: int, params: CaptureParams) -> CapturedViews | None:
        """Return views of the mesh of the asset numbered `asset`, capturing them if necessary; None without a mesh."""
        ...

    def translucent_mesh(self, asset: int) -> Mesh | None:
        """Return the mesh of the asset numbered `asset` if any part of it is translucent or glows, else None."""
        ...

    def texture(self, path: Path) -> NDArray[np.uint8]:
        """Return the texels (H, W, 4) uint8, sRGB and alpha, top row first, of the image file `path`."""
        ...

    def sky_image(self, path: Path) -> NDArray[np.float32]:
        """Return the texels (H, W, 3) float32, linear, row 0 at the zenith, of the sky in the image file `path`."""
        ...


class Background(Protocol):
    """Load, bake and cook depth images in the background, so that no frame waits for them."""

    def is_cooked(self, asset: int, options: CookOptions) -> bool:
        """Return whether the depth images of an asset are available at once; if not, start preparing them.

        Parameters
        ----------
        asset
            The number of the asset.
        options
            How it is cooked.

        Returns
        -------
        bool
            Whether `Library.cooked` would return at once.
        """
        ...

    def poll(self) -> bool:
        """Take over what was finished since the last call; return whether there was anything."""
        ...

    @property
    def is_busy(self) -> bool:
        """Return whether anything that was asked for is still in preparation."""
        ...
