"""Describe who gives assets to the renderer: a library, and who makes them ready beside the frames."""

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.bake.model import BakedModel
from depthwalk.cook.cook import CookedObject, CookOptions
from depthwalk.cook.mesh_clusters import MeshClusters
from depthwalk.ingest.mesh import Mesh, MeshLevel


class Library(Protocol):
    """Describe where the renderer gets assets from, by number; the renderer itself reads no files.

    Every method that reads raises InputError for files that cannot be used.
    """

    def __len__(self) -> int:
        """Return the number of assets."""
        ...

    def has_baked(self, asset: int) -> bool:
        """Return whether the asset numbered `asset` has depth images, without making them."""
        ...

    def has_height_field(self, asset: int) -> bool:
        """Return whether the asset numbered `asset` is one planar depth image, without making it."""
        ...

    def has_mesh(self, asset: int) -> bool:
        """Return whether the asset numbered `asset` has a mesh, without reading it."""
        ...

    def mesh(self, asset: int) -> Mesh | None:
        """Return the mesh of the asset numbered `asset`; None where it has none."""
        ...

    def mesh_levels(self, asset: int) -> tuple[MeshLevel, ...]:
        """Return the mesh of the asset numbered `asset` and its levels, the finest first; empty where it has none."""
        ...

    def mesh_clusters(self, asset: int) -> MeshClusters | None:
        """Return the clusters of the mesh of the asset numbered `asset`; None where it has no mesh."""
        ...

    def forget_mesh(self, asset: int) -> None:
        """Free the memory of the mesh of the asset numbered `asset` and of its levels, until they are asked for."""
        ...

    def is_shipped_cooked(self, asset: int) -> bool:
        """Return whether the asset numbered `asset` is there cooked only, so that `baked` would raise InputError."""
        ...

    def bake_missing(self, assets: Sequence[int]) -> None:
        """Bake the depth images that assets with the numbers `assets` lack, several at a time if possible."""
        ...

    def cooked(self, asset: int, options: CookOptions, *, again: bool = False) -> tuple[CookedObject, ...]:
        """Return the cooked depth images of an asset, baked and cooked first if need be.

        Parameters
        ----------
        asset
            The number of the asset.
        options
            What is built of it.
        again
            Whether to cook even what the cache keeps, because that cannot be loaded; the arrays then stay in memory.

        Returns
        -------
        tuple of CookedObject
            One object for each part of the asset.
        """
        ...

    def baked(self, asset: int) -> BakedModel | None:
        """Return the depth images of the asset numbered `asset`, baked first if need be; None where it has none."""
        ...

    def captured_views(self, asset: int, params: CaptureParams) -> CapturedViews | None:
        """Return views of the mesh of the asset numbered `asset`, captured first if need be; None without a mesh."""
        ...

    def translucent_mesh(self, asset: int) -> Mesh | None:
        """Return the mesh of the asset numbered `asset` if any of it lets light through or glows, else None."""
        ...

    def texture(self, path: Path) -> NDArray[np.uint8]:
        """Return the texels (H, W, 4) uint8, sRGB and alpha, top row first, of the image file `path`."""
        ...


class Background(Protocol):
    """Describe who makes depth images ready beside the frames, so that no frame waits for them."""

    def is_cooked(self, asset: int, options: CookOptions) -> bool:
        """Return whether the depth images of an asset can be had at once; if not, have them made ready.

        Parameters
        ----------
        asset
            The number of the asset.
        options
            What is built of it.

        Returns
        -------
        bool
            Whether `Library.cooked` would return at once.
        """
        ...

    def poll(self) -> bool:
        """Take over what was made ready since the last call, and return whether there was anything."""
        ...

    @property
    def is_busy(self) -> bool:
        """Return whether something that was asked for is still being made ready."""
        ...
