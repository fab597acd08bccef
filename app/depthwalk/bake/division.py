"""Which parts a mesh is split into: planes cut it until every part's own images sample it well.

What is wrong with one cylinder around a tree or a coil are surfaces that no ray reaches within so many layers, or only
edge on. The cut is looked for that leaves the least of them, part by part, the worst first.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthwalk.bake.axis import NAMED
from depthwalk.bake.baker import BakeParams
from depthwalk.bake.placement import cylinder_around, extent, place_along
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.sampling import Probes, probe, sampled_footprints, squared_texels
from depthwalk.ingest.mesh import Mesh
from depthwalk.limits import MAX_DPCI_PARTS
from depthwalk.types import Array

_PROBES = 1000
_FEWEST = 30  # probes that make a part
_CUTS = 3  # planes tried along each direction
_WELL = 3.0  # texels²: what the six sides of a box have at worst on a ball
_LEAST_GAIN = 0.4  # texels², of the mean over the surface, for another part


@dataclass(frozen=True)
class Cell:
    """A convex piece of space. planes: (k, 4), rows of a unit normal n and an offset d: n · point ≤ d inside."""

    planes: Array = field(default_factory=lambda: np.zeros((0, 4)))

    def beyond(self, points: Array) -> Array:
        """How far (n, k) points (n, 3) are outside of each plane, metres."""
        return points @ self.planes[:, :3].T - self.planes[:, 3]

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Which points (n, 3) lie inside."""
        return np.all(self.beyond(points) <= 0, axis=1)

    def cut(self, plane: Array) -> tuple["Cell", "Cell"]:
        """The pieces on either side of `plane` (4,)."""
        return Cell(np.vstack([self.planes, plane])), Cell(np.vstack([self.planes, -plane]))


@dataclass(frozen=True)
class _Surface:
    """What cuts are judged by. texel: metres, of every part's images."""

    caster: RayCaster
    mesh: Mesh
    probes: Probes
    params: BakeParams
    texel: float


@dataclass(frozen=True, eq=False)
class _Piece:
    """error: what its probes are undersampled by, a weighted sum; gain: by how much less its two halves are."""

    cell: Cell
    error: float
    gain: float = 0.0
    halves: tuple["_Piece", "_Piece"] | None = None


def part_faces(mesh: Mesh, cell: Cell, margin: float) -> NDArray[np.bool_]:
    """Which faces (F,) of a mesh reach into `cell`, or within `margin` metres of it."""
    return np.all(cell.beyond(mesh.positions)[mesh.faces].min(1) <= margin, axis=1)


def divide(mesh: Mesh, caster: RayCaster, params: BakeParams, texel: float, most: int | None) -> list[Cell]:
    """The cells of the parts of `mesh`: `most`, where so many are of use, or as many as are worth it (None).

    texel: metres, of all parts' images.
    """
    probes = probe(mesh, caster, _PROBES)
    probes = probes.take(probes.weight > 0)
    surface = _Surface(caster, mesh, probes, params, texel)
    pieces = [_with_best_cut(surface, _piece(surface, Cell()))]
    least = _LEAST_GAIN * float(probes.weight.sum()) if most is None else 0.0
    while len(pieces) < (MAX_DPCI_PARTS if most is None else most):
        best = max(pieces, key=lambda piece: piece.gain)
        if best.halves is None or best.gain <= least:
            break
        pieces.remove(best)
        pieces += [_with_best_cut(surface, half) for half in best.halves]
    return [piece.cell for piece in pieces]


def _with_best_cut(surface: _Surface, piece: _Piece) -> _Piece:
    """`piece` with the cut that leaves the least error."""
    members = surface.probes.take(piece.cell.holds(surface.probes.point))
    if len(members) < 2 * _FEWEST or piece.error == 0:
        return piece
    best = piece
    for normal in np.concatenate([np.eye(3), members.principal_axes()]):
        along = members.point @ normal
        for offset in np.quantile(along, (np.arange(_CUTS) + 1) / (_CUTS + 1)):
            halves = tuple(_piece(surface, cell) for cell in piece.cell.cut(np.append(normal, offset)))
            gain = piece.error - sum(half.error for half in halves)
            if gain > best.gain:
                best = _Piece(piece.cell, piece.error, gain, (halves[0], halves[1]))
    return best


def _piece(surface: _Surface, cell: Cell) -> _Piece:
    """The piece of `surface` in `cell`, about the better of the axes y and its longest."""
    members = surface.probes.take(cell.holds(surface.probes.point))
    if len(members) < _FEWEST:
        return _Piece(cell, np.inf)
    part = part_faces(surface.mesh, cell, 0.0)
    return _Piece(cell, min(_error(surface, members, axis, part) for axis in (NAMED["y"], members.principal_axes()[2])))


def _error(surface: _Surface, members: Probes, axis: ArrayLike, part: NDArray[np.bool_]) -> float:
    placement = place_along(axis, members.point)
    cylinder = cylinder_around(placement, members.point)
    params = replace(surface.params, resolution=max(1, round(extent(cylinder) / surface.texel)))
    footprint = sampled_footprints(surface.caster, members, placement, cylinder, params, part)
    lacking = np.maximum(squared_texels(footprint, surface.texel) - _WELL, 0)
    return float((members.weight * lacking).sum())
