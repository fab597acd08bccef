"""Choose placeholders for assets whose depth images are still loading or baking: their meshes, once these are read."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.assets.demand import nearest_first, requested_representations
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.resources.library import Library
from depthwalk.scene.arrays import OF_MESH, SIMPLIFIED, Objects, Representation
from depthwalk.types import Array, Mask, Rows

# Most triangles of all objects of an asset whose mesh stands in for depth images. More would take seconds per frame,
# which is worse than waiting, so of a crowd only the nearest objects are drawn.
_MAX_TRIANGLES = 3_000_000


@dataclass(frozen=True, kw_only=True)
class Placeholders:
    """Hold, for each of a scene's a assets and n objects, what can be drawn until its depth images are ready.

    Attributes
    ----------
    ready : (a,) whether its depth images can be drawn.
    has_mesh : (a,) whether its mesh can be drawn.
    representation : (a,) uint8, the `Representation` by which its mesh is drawn in place of depth images.
    hidden : (n,) whether so many objects of the same asset are nearer that the mesh is not drawn for this one.
    """

    ready: Mask
    has_mesh: Mask
    representation: NDArray[np.uint8]
    hidden: Mask

    @classmethod
    def none(cls, assets: int, objects: int) -> "Placeholders":
        """Return the table for so many `assets` and `objects`, all ready, because frames wait for them."""
        return cls(
            ready=np.ones(assets, bool),
            has_mesh=np.ones(assets, bool),
            representation=np.full(assets, Representation.MESH, np.uint8),
            hidden=np.zeros(objects, bool),
        )


def find_placeholders(
    objects: Objects, library: Library, store: AssetStore, forced: Representation | None, viewer: Array | None
) -> Placeholders:
    """Request all assets that a scene shows, and find out what can be drawn until they are ready.

    Where `store.background` is None, frames wait for all assets, and all are ready.

    Parameters
    ----------
    objects : the scene's objects.
    library : knows which assets have meshes and depth images.
    store : knows what is ready, and loads or bakes the rest, the assets nearest to the viewer first.
    forced : the representation of all objects whose asset has it; None: each object's own.
    viewer : (3,) where the viewer stands, metres, world; None: not known.

    Returns
    -------
    What can be drawn of each asset and object now.
    """
    found = Placeholders.none(len(library), len(objects))
    if store.background is None:
        return found
    found.ready[:] = found.has_mesh[:] = False
    representation = requested_representations(objects, library, forced)
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
        needs = (bool(count[asset]) for count in (simplified_meshes, clustered_meshes, meshes))
        if not store.meshes.reader.is_read(asset, *needs):
            continue
        levels = store.meshes.reader.levels(asset)
        assert levels is not None  # it is read
        standing.add(asset)
        found.has_mesh[asset] = True
        found.representation[asset] = Representation.MESH if len(levels) == 1 else Representation.MESH_LOD
        most = _MAX_TRIANGLES // max(len(levels[-1].mesh.faces), 1)
        if images[asset] > most:
            if not store.meshes.reader.meshes[asset].is_preview:
                store.meshes.reader.is_read(asset, simplified=True)  # of simplified levels, more can be drawn
            found.hidden[_beyond(objects, np.flatnonzero(imaged & (objects.asset == asset)), viewer, most)] = True
    store.meshes.show(standing)
    return found


def _beyond(objects: Objects, rows: Rows, viewer: Array | None, most: int) -> Rows:
    """Return those of the objects `rows` (k,) that have `most` others of them, fewer than k, nearer to the viewer.

    Where the viewer (3,) is not known, those in the middle count as the nearest.
    """
    position = objects.position[rows].astype(np.float64)
    distance = np.linalg.norm(position - (position.mean(0) if viewer is None else viewer), axis=1)
    return np.asarray(rows[np.argpartition(distance, most)[most:]])
