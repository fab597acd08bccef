"""Build right-triangulated irregular networks (RTIN): fewer, larger triangles where a depth image is smooth.

Evans, Kirkpatrick and Townsend 2001, "Right-Triangulated Irregular Networks". Geometry and shading need not share a
resolution: colour and normal are looked up per pixel, so a grid may be drawn with larger triangles where no sample is
off them by more than a tolerance. These are the halves of square blocks, split again and again from the right angle to
the midpoint of the hypotenuse, at the finest into halves of cells. The two triangles on one hypotenuse, here a
*diamond*, are split together, and so is every diamond that contains a split one. So there are no cracks, and the nodes
at the centres of split diamonds describe the whole network.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.grid import cell_triangles, grid_nodes, whole_cells
from depthwalk.bake.images import DepthImage, Face

_BLOCK = 32  # cells: side of the squares that are split; larger ones save less than one triangle in a thousand
_MARGIN = _BLOCK // 2  # nodes around an array of nodes, so that all corners of diamonds across its edge are inside


@dataclass(frozen=True)
class Surface:
    """Hold the samples of one layer, flattened.

    Attributes
    ----------
    point
        (n, 3) float32, metres, object frame.
    normal
        (n, 3) float32, unit.
    label
        (n,) int; cells whose corners differ in it are never replaced by larger triangles.
    """

    point: NDArray[np.float32]
    normal: NDArray[np.float32]
    label: NDArray[np.integer]


@dataclass(frozen=True)
class _Diamonds:
    """Describe all diamonds of one size and direction, in half cells.

    first: row and column of the centre of the first; half: the way from its centre to an end of its hypotenuse; step:
    from one to the next along both axes.
    """

    first: tuple[int, int]
    half: tuple[int, int]
    step: int

    def at(self, nodes: NDArray[Any], along: float = 0, across: float = 0) -> NDArray[Any]:
        """Return a view of `nodes` (rows, columns, with margin): one node of each diamond.

        It is `along` halves from the centre toward an end of the hypotenuse, and `across` toward a right angle; the
        corners are at ±1.
        """
        return nodes[_slices(nodes.shape, self, along, across)]

    def within(self, nodes: NDArray[Any]) -> list[NDArray[Any]]:
        """Return views of the centres of the four diamonds that each contains; none if it contains half cells."""
        if self.half in ((0, 2), (2, 0)):
            return []
        return [self.at(nodes, along, across) for along in (0.5, -0.5) for across in (0.5, -0.5)]


@lru_cache(maxsize=4096)  # some hundred for each shape, and the faces of an object have few shapes
def _slices(shape: tuple[int, ...], diamonds: _Diamonds, along: float, across: float) -> tuple[slice, slice]:
    """Return the slices of `_Diamonds.at` in nodes of a shape (rows, columns), with margin."""
    (row, column), (up, right) = diamonds.first, diamonds.half
    offsets = row + along * up - across * right, column + along * right + across * up
    slices = []
    for count, first, offset in zip(shape, diamonds.first, offsets, strict=True):
        start = _MARGIN + int(offset) // 2
        length = count - 2 * _MARGIN - (first + 1) // 2  # nodes from the first centre on
        slices.append(slice(start, start + length, diamonds.step // 2))
    return slices[0], slices[1]


def rtin_triangles(
    image: DepthImage, surface: Surface, level: int, tolerance: float
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Replace cells of a grid by larger triangles where that makes no visible difference.

    Replaces only cells whose two triangles lie on the surface, with all corners on this layer and of one label.

    Parameters
    ----------
    image, surface
        One layer of a face, and its samples.
    level
        The grid has step 2^level.
    tolerance
        How far samples may be off the triangles, along the samples' normals, metres; −inf replaces nothing.

    Returns
    -------
    tuple
        Triangles (t, 3) int64 of texel numbers, with the winding of `cell_triangles`; and (cells,) bool in the order of
        `grid_cells`, True for cells that they replace.
    """
    height, width = image.depth.shape
    wraps = image.face is Face.SIDE
    columns, rows = grid_nodes(width, 1 << level, wraps), grid_nodes(height, 1 << level, wraps=False)
    texels = rows[:, None] * width + (np.append(columns, 0) if wraps else columns)
    down, across = texels.shape[0] - 1, texels.shape[1] - 1
    plain, label = whole_cells(image, level).reshape(down, across), surface.label[texels]
    for other in label[1:, :-1], label[:-1, 1:], label[1:, 1:]:
        plain &= other == label[:-1, :-1]
    if not plain.any():
        return np.zeros((0, 3), np.int64), plain.ravel()
    block = min(_BLOCK, 1 << min(down, across).bit_length() - 1)
    rest = -down % block, -across % block
    texels = np.pad(texels, [(_MARGIN, _MARGIN + cells) for cells in rest], mode="edge")
    plain = np.pad(plain, [(0, cells) for cells in rest])
    split, block = _split_nodes(surface, texels, plain, (0, across) if wraps else (0,), block, tolerance)
    triangles, replaced = _leaves(texels, split, block)
    return triangles if _clockwise(image.face) else triangles[:, ::-1], replaced[:down, :across].ravel()


def _split_nodes(
    surface: Surface,
    texels: NDArray[np.int64],
    plain: NDArray[np.bool_],
    seam: tuple[int, ...],
    block: int,
    tolerance: float,
) -> tuple[NDArray[np.bool_], int]:
    """Return which nodes are vertices of the network, and the side of the squares that it begins with, cells.

    A node, in the shape of `texels`, is a vertex if it is the centre of a split diamond or a corner of such a square.
    Corners of cells that are not plain (rows, columns) are vertices, too. seam: the columns that are the same nodes;
    block: largest side of the squares, cells; tolerance: metres.
    """
    bound = np.zeros(texels.shape, np.float32)  # how far samples may be off a diamond; +inf where it is split
    nodes = bound[_MARGIN:-_MARGIN, _MARGIN:-_MARGIN]
    for corners in nodes[1:, 1:], nodes[1:, :-1], nodes[:-1, 1:], nodes[:-1, :-1]:
        corners[~plain] = np.inf
    size, whole = 1, True
    while whole and size < block:
        size *= 2
        whole = False
        for diamonds in _diamonds(size):
            nodes[:, seam] = nodes[:, seam].max(1, keepdims=True)
            own = diamonds.at(bound)
            inner = np.max([own, *diamonds.within(bound)], axis=0)
            held = np.isfinite(inner)
            if not held.any():
                own[...] = np.inf
                continue
            middle, start, end = (diamonds.at(texels, along)[held] for along in (0, -1, 1))
            off = surface.point[middle] - (surface.point[start] + surface.point[end]) / 2
            # Linear interpolations over a triangle and over its halves differ most at that midpoint.
            total = np.abs(np.einsum("ni,ni->n", off, surface.normal[middle])) + inner[held]
            own[...] = np.inf
            own[held] = np.where(total <= tolerance, total, np.inf)
            whole |= bool((total <= tolerance).any())
    nodes[::size, ::size] = np.inf
    return np.isinf(bound), size


def _leaves(
    texels: NDArray[np.int64], split: NDArray[np.bool_], block: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the network's triangles (t, 3), clockwise in columns and rows, and the cells (rows, columns) they cover.

    Cells with both halves in the network are left unchanged, so that they keep their own diagonal.
    """
    triangles = [np.zeros((0, 3), np.int64)]
    covered = np.zeros([count - 2 * _MARGIN - 1 for count in split.shape], bool)
    for size in (1 << k for k in range(block.bit_length())):
        for diamonds in _diamonds(size):
            # A triangle exists if its right angle is the centre of a split one; of these, take the unsplit ones.
            exists = {side: diamonds.at(split, across=side) for side in (1, -1)}
            if size == 1:
                finer = exists[1] & exists[-1]
                covered[tuple(slice(first // 2, None, 2) for first in diamonds.first)] = ~finer
            else:
                finer = diamonds.at(split)
            for side in exists:
                leaf = exists[side] & ~finer
                if not leaf.any():
                    continue
                corners = (0, side), (-side, 0), (side, 0)
                triangles.append(np.stack([diamonds.at(texels, *corner)[leaf] for corner in corners], -1))
    return np.concatenate(triangles), covered


def _diamonds(size: int) -> Iterator[_Diamonds]:
    """Yield the diamonds of squares of `size` cells: those on their sides, then those on their diagonals.

    The latter contain the former. Cells have only diagonals, without a node in the middle.
    """
    if size > 1:
        yield _Diamonds((0, size), (0, size), 2 * size)
        yield _Diamonds((size, 0), (size, 0), 2 * size)
    for row, column in np.ndindex(2, 2):  # the diagonals of four squares meet at the centre
        first = (1 + 2 * row) * size, (1 + 2 * column) * size
        yield _Diamonds(first, (size if row == column else -size, size), 4 * size)


def _clockwise(face: Face) -> bool:
    """Return whether triangles of `face` run clockwise in columns and rows."""
    columns, rows = cell_triangles(face, *np.array([[0], [0], [1], [1]]))
    return bool(np.linalg.det([columns[0, 0], rows[0, 0], np.ones(3)]) < 0)
