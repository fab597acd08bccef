"""Split a mesh into parts: planes cut it until each part's own images sample it well.

One cylinder around a tree or a coil leaves surfaces that no ray reaches within the layers of a file, or only edge-on.
The worst part is cut first, by the plane that leaves the least of such surface.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthwalk.bake.params import NAMED, BakeParams
from depthwalk.bake.placement import cylinder_around, extent, place_along
from depthwalk.bake.raycast import RayCaster
from depthwalk.bake.sampling import Probes, probe, sampled_footprints, squared_texels
from depthwalk.ingest.mesh import Mesh
from depthwalk.limits import MAX_DPCI_PARTS
from depthwalk.types import Array

_PROBES = 1000
_FEWEST = 30  # least number of probes in a part
_CUTS = 3  # planes tried along each direction
_WELL = 3.0  # texels²: the worst footprint that the six sides of a box have on a ball
_LEAST_GAIN = 0.4  # texels², mean over the surface, that another part must gain


@dataclass(frozen=True, kw_only=True)
class Cell:
    """Describe a convex region of space by the planes that bound it.

    Attributes
    ----------
    planes
        (k, 4), rows of a unit normal n and an offset d, metres, asset frame: n · point ≤ d inside. Without planes, the
        region is all of space.
    """

    planes: Array = field(default_factory=lambda: np.zeros((0, 4)))

    def beyond(self, points: Array) -> Array:
        """Return how far (n, k), metres, `points` (n, 3), asset frame, lie outside each plane; negative inside."""
        return points @ self.planes[:, :3].T - self.planes[:, 3]

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Return which `points` (n, 3), metres, asset frame, lie inside the cell: (n,) bool."""
        return np.asarray(np.all(self.beyond(points) <= 0, axis=1))

    def cut(self, plane: Array) -> tuple["Cell", "Cell"]:
        """Cut the cell in two.

        Parameters
        ----------
        plane
            (4,) a unit normal n and an offset d, metres, asset frame, like a row of `planes`.

        Returns
        -------
        tuple
            The region where n · point ≤ d, and the one on the other side.
        """
        return Cell(planes=np.vstack([self.planes, plane])), Cell(planes=np.vstack([self.planes, -plane]))


@dataclass(frozen=True, kw_only=True)
class _Surface:
    """Hold the data by which cuts are judged. texel: metres, the same for the images of every part."""

    caster: RayCaster
    mesh: Mesh
    probes: Probes
    params: BakeParams
    texel: float


@dataclass(frozen=True, eq=False, kw_only=True)
class _Piece:
    """Hold a piece of the surface and the best way to cut it.

    error: undersampling of its probes, a weighted sum. gain: by how much its two halves together reduce this. halves:
    the two, if cutting gains anything.
    """

    cell: Cell
    error: float
    gain: float = 0.0
    halves: tuple["_Piece", "_Piece"] | None = None


def part_faces(mesh: Mesh, cell: Cell, margin: float) -> NDArray[np.bool_]:
    """Return which faces of a mesh reach into a cell or come near it.

    Parameters
    ----------
    mesh
        The mesh, asset frame.
    cell
        The region of space, asset frame.
    margin
        Distance from the cell up to which faces count, metres.

    Returns
    -------
    numpy.ndarray
        (F,) bool, True for such faces.
    """
    return np.asarray(np.all(cell.beyond(mesh.positions)[mesh.faces].min(1) <= margin, axis=1))


def divide(mesh: Mesh, caster: RayCaster, params: BakeParams, texel: float, most: int | None) -> list[Cell]:
    """Split a mesh into parts that sample it well, each in a cylinder of its own.

    Parameters
    ----------
    mesh, caster
        The mesh, asset frame, and the same mesh ready for ray casting.
    params
        How the parts would be baked.
    texel
        Side of a texel of all parts' images, metres.
    most
        Largest number of parts; None: as many as pay off.

    Returns
    -------
    list
        The cell of each part; at least one.
    """
    probes = probe(mesh, caster, _PROBES)
    probes = probes.take(probes.weight > 0)
    surface = _Surface(caster=caster, mesh=mesh, probes=probes, params=params, texel=texel)
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
    """Return `piece` with the cut that leaves the least error, if one gains anything."""
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
                best = replace(piece, gain=gain, halves=(halves[0], halves[1]))
    return best


def _piece(surface: _Surface, cell: Cell) -> _Piece:
    """Return the piece of `surface` in `cell`, judged with the better axis of y and its longest one."""
    members = surface.probes.take(cell.holds(surface.probes.point))
    if len(members) < _FEWEST:
        return _Piece(cell=cell, error=np.inf)
    part = part_faces(surface.mesh, cell, 0.0)
    axes = NAMED["y"], members.principal_axes()[2]
    return _Piece(cell=cell, error=min(_error(surface, members, axis, part) for axis in axes))


def _error(surface: _Surface, members: Probes, axis: ArrayLike, part: NDArray[np.bool_]) -> float:
    """Return by how much images about `axis` would undersample `members`, texels², summed by their weights."""
    placement = place_along(axis, members.point)
    cylinder = cylinder_around(placement, members.point)
    params = replace(surface.params, resolution=max(1, round(extent(cylinder) / surface.texel)))
    footprint = sampled_footprints(surface.caster, members, placement, cylinder, params, part)
    lacking = np.maximum(squared_texels(footprint, surface.texel) - _WELL, 0)
    return float((members.weight * lacking).sum())
