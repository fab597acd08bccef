"""Determine what a scene needs of its assets: how objects are drawn, which assets come first, how images are cooked."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cook import CookOptions
from depthwalk.scene.arrays import HEIGHT_FIELDS, OF_MESH, Objects, Representation
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.types import Array


class AssetCapabilities(Protocol):
    """Describe an object that knows what each asset has, by its number."""

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


def requested_representations(
    objects: Objects, assets: AssetCapabilities, forced: Representation | None
) -> NDArray[np.uint8]:
    """Return how each object is to be drawn.

    Parameters
    ----------
    objects
        The scene's n objects.
    assets
        Knows what each asset has.
    forced
        The representation of all objects whose asset has it; None: each object's own.

    Returns
    -------
    NDArray[np.uint8]
        (n,) a `Representation` each.
    """
    representation = objects.representation.copy()
    if forced is not None:
        has = assets.has_mesh if forced in OF_MESH else assets.has_baked
        has = assets.has_height_field if forced in HEIGHT_FIELDS else has
        able = np.array([has(asset) for asset in range(len(assets))], bool)
        if forced is Representation.AUTO:  # needs both to choose from
            able &= np.array([assets.has_mesh(asset) for asset in range(len(assets))], bool)
        representation[able[objects.asset]] = forced
    return representation


def nearest_first(objects: Objects, viewer: Array | None) -> list[int]:
    """Return the assets that objects use, ordered by the distance of their nearest object to the viewer.

    Parameters
    ----------
    objects
        The objects.
    viewer
        (3,) position of the viewer, metres, world; None if unknown: assets are then ordered by number.

    Returns
    -------
    list[int]
        Numbers of assets.
    """
    assets, member = np.unique(objects.asset, return_inverse=True)
    if viewer is None:
        return list(assets.tolist())
    nearest = np.full(len(assets), np.inf)
    np.minimum.at(nearest, member, np.linalg.norm(objects.position - viewer, axis=1))
    return list(assets[np.argsort(nearest, kind="stable")].tolist())


def cook_options(settings: RenderSettings) -> CookOptions:
    """Return the cook options for `settings`: the papers' mechanisms need grids by step, not by error."""
    lod, in_order = settings.lod, settings.warp.order == "epipole"
    by_paper = lod.cases != "complete"
    return CookOptions(lod.mode == "paper" or by_paper or in_order, by_paper)
