"""Draw whole grids in occlusion-compatible order, a baseline of the papers (`warp.order: epipole`).

Every asset has an index buffer, which is sorted again whenever the epipole enters another cell, and each object is a
draw call.
"""

from dataclasses import dataclass, field

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject
from depthwalk.cook.cases import ALL_PIECES
from depthwalk.cook.lod_geometry import GRID_LAYOUT, LodGeometry
from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import InstanceStream
from depthwalk.gpu.state import ALWAYS
from depthwalk.render.draw.draw_lists import DrawBatch
from depthwalk.render.paper.occlusion_compatible_order import GridCells, draw_order, epipole, image_cells
from depthwalk.render.resources.asset_store import AssetStore

Kind = tuple[int, int]
"""What is drawn of an asset: level of detail, and bit mask of the pieces."""


@dataclass(kw_only=True)
class _Asset:
    """Hold an asset's grids on the GPU.

    cells: by kind, of those drawn so far. written: the kind and epipole that the index buffer was sorted for.
    """

    baked: BakedObject
    grids: LodGeometry
    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    array: moderngl.VertexArray
    cells: dict[Kind, GridCells] = field(default_factory=dict)
    written: tuple[Kind, tuple[int, int]] | None = None


class OrderedIndices:
    """Draw objects in occlusion-compatible order, and keep the grids and index buffers of their assets.

    Parameters
    ----------
    scope : creates and owns the GL objects.
    program : the program of pass 1.
    """

    def __init__(self, scope: Scope, program: moderngl.Program) -> None:
        self._scope, self._program = scope, program
        self._assets: dict[int, _Asset] = {}

    def draw(self, assets: AssetStore, batch: DrawBatch, records: NDArray[np.void], instances: InstanceStream) -> None:
        """Draw each object of a batch: first the ordered triangles, which overwrite each other, then the rest by depth.

        Parameters
        ----------
        assets : the store of the assets on the GPU.
        batch : the instances of one asset.
        records : (n,) WARP_RECORD of these instances.
        instances : takes the records to the GPU.
        """
        for number, record in enumerate(records):
            array, ordered, others = self._sorted(assets, batch, record)
            instances.upload(records[number : number + 1])
            instances.bind(array)
            with self._scope.state(depth_test=ALWAYS):  # λ is written
                array.render(vertices=ordered, instances=1)
            array.render(vertices=others, first=ordered, instances=1)

    def _sorted(self, assets: AssetStore, batch: DrawBatch, record: np.void) -> tuple[moderngl.VertexArray, int, int]:
        """Return the asset's vertex array, with indices sorted for the viewer of one object of the batch.

        Returns
        -------
        The array, how many of its first indices are in order, and how many follow that are not.
        """
        if batch.asset not in self._assets:
            self._assets[batch.asset] = self._load(assets.parts.baked(batch.asset), assets.parts.options.paper_cases)
        # Unless cooked for the paper's cases, the pieces of the plan are not those of these grids.
        pieces = batch.pieces if assets.parts.options.paper_cases else ALL_PIECES
        asset, kind = self._assets[batch.asset], (batch.level, pieces)
        if kind not in asset.cells:
            asset.cells[kind] = image_cells(asset.grids, asset.baked, *kind)
        cells = asset.cells[kind]
        at = epipole(asset.baked, viewer_of(record), cells)
        if asset.written != (kind, at):
            indices = np.concatenate([cells.ordered[draw_order(cells, at)], cells.unordered])
            self._scope.refill(asset.indices, indices)
            asset.written = kind, at
        return asset.array, cells.ordered.size, cells.unordered.size

    def _load(self, baked: BakedObject, paper_cases: bool) -> _Asset:
        """Upload whole grids of a depth object. paper_cases: see `CookOptions`."""
        from depthwalk.cook.grid_lods import build_grid_lods  # here: drawing with the depth test needs no grids

        grids = build_grid_lods(baked, paper_cases, tolerance=-np.inf)
        vertices = self._scope.buffer(grids.vertices)
        indices = self._scope.buffer(reserve=max(int(grids.count.sum(-1).max()), 1) * 4, dynamic=True)
        array = self._scope.vertex_array(self._program, [(vertices, *GRID_LAYOUT)], index_buffer=indices)
        return _Asset(baked=baked, grids=grids, vertices=vertices, indices=indices, array=array)

    def forget(self) -> None:
        """Release the grids of all assets."""
        for asset in self._assets.values():
            self._scope.free(asset.array, asset.vertices, asset.indices)
        self._assets.clear()


def viewer_of(record: np.void) -> NDArray[np.floating]:
    """Return the viewer for whom a tile is warped.

    Parameters
    ----------
    record : a single WARP_RECORD, of shape ().

    Returns
    -------
    (3,) metres, object frame.
    """
    right, up, normal = record["right"], record["up"], record["normal"]
    above = normal[3] + record["depths"][0]
    return np.asarray(right[:3] * right[3] + up[:3] * up[3] + normal[:3] * above)
