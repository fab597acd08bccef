"""Write the nodes of a glTF file: its meshes at their places, its cameras and lights."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import from_matrices
from depthwalk.ingest.gltf import INSTANCING, placed_node
from depthwalk.ingest.usd.glb import GlbBuilder, Header
from depthwalk.limits import MAX_COPIED_TRIANGLES

_MOST_NODES = 20_000  # of copies, 300 bytes of JSON each; more are instances
_SAME = 1e-5  # relative deviation of a matrix from one that turns and stretches along the axes of the mesh

_Matrices = NDArray[np.float64]  # (…, 4, 4), for column vectors


@dataclass(frozen=True, kw_only=True)
class Copies:
    """Hold a mesh of the file by its number, the triangles that it has, its places (n, 4, 4) and n names."""

    mesh: int
    triangles: int
    places: _Matrices
    names: Sequence[str]


class Nodes:
    """Write nodes below one that turns and scales the stage to metres, y upward.

    Attributes
    ----------
    world : (4, 4) float64
        The matrix of that node.
    unit
        Metres per unit of the stage.
    """

    def __init__(self, builder: GlbBuilder, world: _Matrices, unit: float) -> None:
        self._builder, self.world, self.unit = builder, world, unit
        self._children: list[int] = []
        builder.add("nodes", placed_node({"children": self._children}, world))

    def add(self, node: Header, matrix: _Matrices | None = None) -> int:
        """Add a node that stands by a matrix (4, 4), or by what it says itself; return its number."""
        number = self._builder.add("nodes", node if matrix is None else placed_node(node, matrix))
        self._children.append(number)
        return number

    def add_copies(self, listed: Sequence[Copies]) -> None:
        """Add all copies of meshes, as nodes if these are few and have few triangles, otherwise as instances."""
        copied = sum(each.triangles * (len(each.places) - 1) for each in listed)
        as_nodes = copied <= MAX_COPIED_TRIANGLES and sum(len(each.places) for each in listed) <= _MOST_NODES
        for each in listed:
            if as_nodes or len(each.places) == 1:
                self._add_nodes(each)
            else:
                self._add_instances(each)

    def _add_nodes(self, copies: Copies) -> None:
        for place, name in zip(copies.places, copies.names, strict=True):
            self.add({"mesh": copies.mesh} | ({"name": name} if name else {}), place)

    def _add_instances(self, copies: Copies) -> None:
        """Add a node of instances, and nodes for copies that are sheared: instances only turn and stretch."""
        shift, turn, stretch, fits = factors(copies.places)
        rows = np.flatnonzero(fits)
        if len(rows):
            attributes = {
                "TRANSLATION": self._builder.accessor(shift[rows]),
                "ROTATION": self._builder.accessor(turn[rows]),
                "SCALE": self._builder.accessor(stretch[rows]),
            }
            header = self._builder.header
            header["extensionsRequired"] = header["extensionsUsed"] = [INSTANCING]
            self.add({"mesh": copies.mesh, "extensions": {INSTANCING: {"attributes": attributes}}})
        for row in np.flatnonzero(~fits):
            self.add({"mesh": copies.mesh}, copies.places[row])


def factors(
    places: _Matrices,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Divide matrices (n, 4, 4) into shifts (n, 3), quaternions (n, 4), x y z w, and stretches (n, 3), done first.

    A mirror is a negative stretch of x. The last item (n,) tells whether these make the matrix; if not, it shears.
    """
    linear = places[:, :3, :3]
    stretch = np.linalg.norm(linear, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        rotation = linear / stretch[:, None, :]
    mirrored = np.linalg.det(linear) < 0
    stretch[mirrored, 0] *= -1
    rotation[mirrored, :, 0] *= -1
    with np.errstate(invalid="ignore"):
        off = np.abs(np.swapaxes(rotation, 1, 2) @ rotation - np.eye(3)).max(axis=(1, 2))
    return places[:, :3, 3], from_matrices(rotation), stretch, off < _SAME
