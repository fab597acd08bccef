"""Upload the assets that one frame needs, as far as time and memory allow."""

import numpy as np

from depthwalk.render.resources.asset_store import AssetStore
from depthwalk.render.world.render_world import RenderWorld
from depthwalk.types import Array, Mask, Rows


class FrameResidency:
    """Upload the assets that the objects of one frame need, in the order in which they are asked for.

    Parameters
    ----------
    world : the world whose objects are drawn.
    assets : the store that uploads assets.
    seconds : time after which no further upload begins, see `AssetStore.stream`; None: the frame waits for all.
    releases : whether assets that other frames need may be evicted, see `AssetStore.stream`.
    """

    def __init__(self, world: RenderWorld, assets: AssetStore, seconds: float | None, *, releases: bool = True) -> None:
        self._asset, table = world.objects().asset, world.table()
        self._meshes, self._triangles = table.meshes, table.mesh_fallbacks.triangles
        self._assets, self._seconds, self._releases = assets, seconds, releases
        self._needed: list[int] = []
        self._is_needed = np.zeros(len(assets.parts), bool)
        self._is_needed[: assets.parts.first] = True  # meshes, which are always there
        self._on_gpu: Mask | None = None  # for all numbers, when `resident` was called last
        self._asked = np.zeros(len(assets.parts), bool)  # meshes that `is_mesh_resident` was called for
        self._has_mesh = np.zeros(len(assets.parts), bool)
        if releases:
            assets.meshes.begin_frame()

    def resident(self, rows: Rows, distance: Array | None = None) -> Mask:
        """Return which objects have their assets on the GPU, after uploading what fits the time and the budget.

        Parameters
        ----------
        rows : (m,) rows of the objects.
        distance : (m,) how far away they are, metres; None: `rows` are sorted, nearest first.

        Returns
        -------
        (m,) whether the assets of each object are on the GPU.
        """
        return self.are_resident(self._asset[rows], distance)

    def are_resident(self, asset: Rows, urgency: Array | None = None) -> Mask:
        """Return which assets are on the GPU, as `resident` does for objects.

        Parameters
        ----------
        asset : (m,) numbers of the assets in `CookedParts`.
        urgency : (m,) the least is uploaded first; None: they are sorted by it.

        Returns
        -------
        (m,) whether each is on the GPU.
        """
        is_new = ~self._is_needed[asset]
        new = asset[is_new]
        if len(new):
            self._needed += _in_order(new, None if urgency is None else urgency[is_new])
            self._is_needed[new] = True
        if len(new) or self._on_gpu is None or not self._on_gpu[self._needed].all():
            self._on_gpu = self._assets.stream(self._needed, self._seconds, releases=self._releases)
        return self._on_gpu[asset]

    def is_mesh_resident(self, meshes: Rows) -> Mask:
        """Return which meshes may replace depth images in this frame; an `IsResident`.

        The others begin to be read. A mesh that is not resident at the first query counts as absent for the whole
        frame, so that all views of the frame agree.

        Parameters
        ----------
        meshes : (n,) numbers of the meshes in `CookedParts`, nearest first.

        Returns
        -------
        (n,) whether each mesh may replace depth images.
        """
        new = meshes[~self._asked[meshes]]
        if len(new):
            self._asked[new] = True
            within = self._assets.within_budget(_in_order(new), self._triangles, self._needed)
            resident = self._assets.meshes.mesh_fallbacks(within, wait=self._seconds is None)
            for number, levels in resident.items():
                self._meshes.add(number, levels)
            self._has_mesh[list(resident)] = True
        return self._has_mesh[meshes]


def _in_order(numbers: Rows, urgency: Array | None = None) -> list[int]:
    """Return the distinct `numbers` (n,), sorted by their least `urgency` (n,); None: in order of first occurrence."""
    distinct = np.bincount(numbers).nonzero()[0]
    if len(distinct) > 1:
        least = np.full(distinct[-1] + 1, np.inf)
        np.minimum.at(least, numbers, np.arange(len(numbers)) if urgency is None else urgency)
        distinct = distinct[np.argsort(least[distinct], kind="stable")]
    in_order: list[int] = distinct.tolist()
    return in_order
