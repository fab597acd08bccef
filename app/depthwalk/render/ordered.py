"""Index buffers in occlusion-compatible order, one per asset, written anew when the epipole enters another cell."""

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import AssetArrays
from depthwalk.render.assets import AssetStore
from depthwalk.render.epipole import Cells, Runs, draw_order, epipole, image_cells
from depthwalk.render.grids import GRID_LAYOUT
from depthwalk.render.plan import Group


class OrderedIndices:
    """Makes and keeps them."""

    def __init__(self, scope: Scope, program: moderngl.Program) -> None:
        self._scope = scope
        self._arrays = AssetArrays(scope, program, *GRID_LAYOUT)
        self._buffers: dict[int, moderngl.Buffer] = {}
        self._cells: dict[tuple[int, Runs], Cells] = {}
        self._written: dict[int, tuple[Runs, tuple[int, int]]] = {}  # asset → what its buffer was sorted for

    def get(self, assets: AssetStore, group: Group, record: np.void) -> tuple[moderngl.VertexArray, int, int]:
        """The asset's vertex array, how many of its indices are in order for one object of the group, from the first
        on, and how many more follow. record: the object's WARP_RECORD."""
        asset = assets.depth_object(group.asset)
        key = group.asset, group.indices
        if key not in self._cells:
            self._cells[key] = image_cells(assets.grids(group.asset), asset.baked, group.indices)
        cells = self._cells[key]
        if group.asset not in self._buffers:
            self._buffers[group.asset] = self._scope.buffer(reserve=asset.indices.size, dynamic=True)
        buffer = self._buffers[group.asset]
        at = epipole(asset.baked, viewer_of(record), cells)
        if self._written.get(group.asset) != (group.indices, at):
            buffer.orphan()
            buffer.write(np.concatenate([cells.ordered[draw_order(cells, at)], cells.unordered]))
            self._written[group.asset] = group.indices, at
        return self._arrays.get(group.asset, asset.vertices, buffer), cells.ordered.size, cells.unordered.size

    def forget(self) -> None:
        """To be called before the assets' buffers go."""
        self._arrays.forget()
        self._scope.free(*self._buffers.values())
        for kept in (self._buffers, self._cells, self._written):
            kept.clear()


def viewer_of(record: np.void) -> NDArray[np.floating]:
    """The viewer (3,), object frame, for whom a WARP_RECORD was made."""
    right, up, normal = record["right"], record["up"], record["normal"]
    above = normal[3] + record["depths"][0]
    return np.asarray(right[:3] * right[3] + up[:3] * up[3] + normal[:3] * above)
