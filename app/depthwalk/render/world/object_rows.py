"""Expand the objects of a scene into the rows that are drawn: one for a mesh, or one per part of its depth images."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.assets.demand import requested_representations
from depthwalk.geometry.quaternions import multiply, rotate
from depthwalk.geometry.spatial_order import within_runs
from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.resources.cooked_parts import CookedParts
from depthwalk.render.resources.library import Library
from depthwalk.render.world.placeholders import Placeholders
from depthwalk.scene.arrays import OF_MESH, Objects, Representation
from depthwalk.scene.scene import Scene
from depthwalk.types import Ints, Mask, Rows


@dataclass(frozen=True, kw_only=True)
class ObjectRows:
    """Map the objects of a scene to the rows that are drawn.

    Attributes
    ----------
    scene : the scene.
    library : knows which assets have meshes and depth images.
    store : numbers meshes and parts of depth images.
    forced : draw every object whose asset has this representation by it; None: each object by its own.
    placeholders : what is drawn of assets whose depth images are not ready; None: all are ready.
    """

    scene: Scene
    library: Library
    store: AssetStore
    forced: Representation | None = None
    placeholders: Placeholders | None = None

    def place(self, which: slice | Rows = slice(None)) -> Objects:
        """Return the scene's objects as they are drawn: a row for the mesh, or one for each part of the depth images.

        Parameters
        ----------
        which : the scene's objects to place: a slice of them, or (k,) their rows.

        Returns
        -------
        The rows in the frames of their parts; `asset` holds numbers of `store.parts`.
        """
        objects = self.scene.objects.take(which)
        representation, first, count = self._rows(which)
        row = np.repeat(np.arange(len(objects), dtype=np.int32), count)
        number = first[row] + within_runs(count)
        position, rotation, scale = objects.position[row], objects.rotation[row], objects.scale[row]
        offset, turn = _placements(number, self.store.parts)
        moved = np.flatnonzero(((offset != 0).any(1) | (turn[:, 3] != 1))[number])
        position[moved] += scale[moved, None] * rotate(rotation[moved], offset[number[moved]])
        rotation[moved] = multiply(rotation[moved], turn[number[moved]])
        return Objects(
            asset=number, position=position, rotation=rotation, scale=scale, representation=representation[row]
        )

    def owners(self) -> Ints:
        """Return which of the scene's objects each of the rows (n,) of `place()` shows, or a part of it."""
        return np.repeat(np.arange(len(self.scene.objects)), self._rows(slice(None))[2])

    def chooses(self) -> Mask:
        """Return which rows (n,) of `place()` are drawn as mesh or depth images, whichever is quicker (`auto`)."""
        chooses = requested_representations(self.scene.objects, self.library, self.forced) == Representation.AUTO
        return np.repeat(chooses, self._rows(slice(None))[2])

    def _rows(self, which: slice | Rows) -> tuple[NDArray[np.uint8], NDArray[np.int32], NDArray[np.int32]]:
        """Return how each object of `which` (n,) is drawn, the first number in `CookedParts` for it, and how many."""
        library, store, objects = self.library, self.store, self.scene.objects.take(which)
        representation = requested_representations(objects, library, self.forced)
        placeholders = self.placeholders or Placeholders.none(len(library), len(self.scene.objects))
        representation[representation == Representation.AUTO] = Representation.DPCI  # until `MeshChooser` decides
        imaged = ~np.isin(representation, OF_MESH)
        waiting = imaged & ~placeholders.ready[objects.asset]
        representation[waiting] = placeholders.representation[objects.asset[waiting]]
        imaged &= ~waiting
        first, of_mesh = np.arange(len(library), dtype=np.int32), placeholders.has_mesh.astype(np.int32)
        shown = np.unique(objects.asset[imaged]).tolist()
        if store.background is None:
            library.bake_missing([asset for asset in shown if not store.parts.knows(asset)])
        of_images = np.ones(len(library), np.int32)
        for asset in shown:
            numbers = store.parts.numbers(asset)
            first[asset], of_images[asset] = numbers.start, len(numbers)
        count = np.where(imaged, of_images[objects.asset], of_mesh[objects.asset])
        count[waiting & placeholders.hidden[which]] = 0
        return representation, np.where(imaged, first[objects.asset], objects.asset), count


def rows_of(which: Rows, owners: Ints) -> Rows:
    """Return the rows of `ObjectRows.place()` that belong to the scene's objects `which` (k,), ascending.

    `owners` is what `ObjectRows.owners` returns.
    """
    first, end = np.searchsorted(owners, which), np.searchsorted(owners, which, side="right")
    return np.asarray(np.repeat(first, end - first) + within_runs(end - first))


def _placements(used: Ints, parts: CookedParts) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the position (a, 3) and rotation (a, 4), in their assets' frames, of the numbers `used` of `parts`."""
    offset, turn = np.zeros((len(parts), 3), np.float32), np.zeros((len(parts), 4), np.float32)
    turn[:, 3] = 1
    for number in np.unique(used[used >= parts.first]).tolist():
        baked = parts.cooked(number).outline
        offset[number], turn[number] = baked.position, baked.rotation
    return offset, turn
