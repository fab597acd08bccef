"""Whole grids with index buffers in occlusion-compatible order, one per asset, written anew when the epipole enters
another cell."""

from dataclasses import dataclass, field

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject
from depthwalk.cook.cases import ALL_PIECES
from depthwalk.cook.grid_lods import build_grid_lods
from depthwalk.cook.lod_geometry import GRID_LAYOUT, LodGeometry
from depthwalk.gpu.device import Scope
from depthwalk.render.draw.draw_lists import DrawBatch
from depthwalk.render.paper.occlusion_compatible_order import Cells, draw_order, epipole, image_cells
from depthwalk.render.resources.asset_store import AssetStore

Kind = tuple[int, int]  # level and pieces


@dataclass
class _Asset:
    """cells: of the kinds drawn so far; written: what the index buffer was sorted for, kind and epipole."""

    baked: BakedObject
    grids: LodGeometry
    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    array: moderngl.VertexArray
    cells: dict[Kind, Cells] = field(default_factory=dict)
    written: tuple[Kind, tuple[int, int]] | None = None


class OrderedIndices:
    """Makes and keeps them."""

    def __init__(self, scope: Scope, program: moderngl.Program) -> None:
        self._scope, self._program = scope, program
        self._assets: dict[int, _Asset] = {}

    def get(self, assets: AssetStore, group: DrawBatch, record: np.void) -> tuple[moderngl.VertexArray, int, int]:
        """The asset's vertex array, how many of its indices are in order for one object of the group, from the first
        on, and how many more follow. record: the object's WARP_RECORD."""
        if group.asset not in self._assets:
            self._assets[group.asset] = self._load(assets.baked(group.asset), assets.form.paper_cases)
        # These grids are others than those in whose pieces the plan says what is seen.
        pieces = group.pieces if assets.form.paper_cases else ALL_PIECES
        asset, kind = self._assets[group.asset], (group.level, pieces)
        if kind not in asset.cells:
            asset.cells[kind] = image_cells(asset.grids, asset.baked, *kind)
        cells = asset.cells[kind]
        at = epipole(asset.baked, viewer_of(record), cells)
        if asset.written != (kind, at):
            asset.indices.orphan()
            asset.indices.write(np.concatenate([cells.ordered[draw_order(cells, at)], cells.unordered]))
            asset.written = kind, at
        return asset.array, cells.ordered.size, cells.unordered.size

    def _load(self, baked: BakedObject, paper_cases: bool) -> _Asset:
        grids = build_grid_lods(baked, paper_cases, tolerance=-np.inf)
        vertices = self._scope.buffer(grids.vertices)
        indices = self._scope.buffer(reserve=max(int(grids.count.sum(-1).max()), 1) * 4, dynamic=True)
        array = self._scope.vertex_array(self._program, [(vertices, *GRID_LAYOUT)], index_buffer=indices)
        return _Asset(baked, grids, vertices, indices, array)

    def forget(self) -> None:
        """Releases all of them."""
        for asset in self._assets.values():
            self._scope.free(asset.array, asset.vertices, asset.indices)
        self._assets.clear()


def viewer_of(record: np.void) -> NDArray[np.floating]:
    """The viewer (3,), object frame, for whom a WARP_RECORD was made."""
    right, up, normal = record["right"], record["up"], record["normal"]
    above = normal[3] + record["depths"][0]
    return np.asarray(right[:3] * right[3] + up[:3] * up[3] + normal[:3] * above)
