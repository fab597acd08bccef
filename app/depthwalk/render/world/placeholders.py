"""Decide what is drawn of an asset whose depth images are not ready: its mesh, or nothing while that is read, too."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.assets.demand import asked_for, nearest_first
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.resources.library import Library
from depthwalk.scene.arrays import OF_MESH, SIMPLIFIED, Objects, Representation
from depthwalk.types import Array, Mask

# Triangles of all objects of an asset whose mesh stands in for its depth images. More would take seconds a frame, for
# which a visitor would rather wait than walk.
_MAX_TRIANGLES = 3_000_000


@dataclass(frozen=True, kw_only=True)
class Placeholders:
    """Hold what can be drawn of each of a scene's a assets while depth images are made ready.

    Attributes
    ----------
    ready : (a,) whether its depth images can be drawn.
    has_mesh : (a,) whether its mesh can be drawn.
    representation : (a,) uint8, the `Representation` in which its mesh stands in for depth images that are not ready.
    too_many : (a,) whether the meshes that would have to stand in have too many triangles, so that nothing is drawn.
    """

    ready: Mask
    has_mesh: Mask
    representation: NDArray[np.uint8]
    too_many: Mask

    @classmethod
    def none(cls, assets: int) -> "Placeholders":
        """Return the table of a scene of `assets` assets that are all ready, because frames wait for them."""
        return cls(
            ready=np.ones(assets, bool),
            has_mesh=np.ones(assets, bool),
            representation=np.full(assets, Representation.MESH, np.uint8),
            too_many=np.zeros(assets, bool),
        )


def find_placeholders(
    objects: Objects, library: Library, store: AssetStore, forced: Representation | None, viewer: Array | None
) -> Placeholders:
    """Ask for all assets that a scene shows, and find out what can be drawn meanwhile.

    Where `store.background` is None, frames wait for everything, and everything is ready.

    Parameters
    ----------
    objects : the scene's objects.
    library : tells which assets have meshes and depth images.
    store : knows what is ready, and has the rest made so, the assets nearest to the viewer first.
    forced : the representation of all objects whose asset has it; None: each object's own.
    viewer : (3,) where the viewer stands, metres, world; None: not known.

    Returns
    -------
    What can be drawn of each asset now.
    """
    found = Placeholders.none(len(library))
    if store.background is None:
        return found
    found.ready[:] = found.has_mesh[:] = False
    representation = asked_for(objects, library, forced)
    imaged, simplified = ~np.isin(representation, OF_MESH), np.isin(representation, SIMPLIFIED)
    clustered = representation == Representation.MESH_CLUSTERS
    masks = imaged, ~imaged, simplified, clustered
    counts = (np.bincount(objects.asset[mask], minlength=len(library)) for mask in masks)
    images, meshes, simplified_meshes, clustered_meshes = counts
    standing: set[int] = set()
    for asset in nearest_first(objects, viewer):
        found.ready[asset] = images[asset] > 0 and store.is_ready(asset)
        if (found.ready[asset] and not meshes[asset]) or not library.has_mesh(asset):
            continue
        if not store.meshes.reader.is_read(asset, bool(simplified_meshes[asset]), bool(clustered_meshes[asset])):
            continue
        levels = store.meshes.reader.levels(asset)
        assert levels is not None  # it is read
        standing.add(asset)
        found.has_mesh[asset] = True
        found.representation[asset] = Representation.MESH if len(levels) == 1 else Representation.MESH_LOD
        found.too_many[asset] = images[asset] * len(levels[-1].mesh.faces) > _MAX_TRIANGLES
    store.meshes.show(standing)
    return found
