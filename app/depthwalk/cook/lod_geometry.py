"""Define the geometry of an object as shaders read it: vertex and index arrays, in levels of detail.

A vertex takes 8 bytes: a position with 16 bits per axis within the object's box, and the depth image that its triangle
looks into, with flags.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.cases import ALL_PIECES, piece_runs
from depthwalk.cook.index_chunks import Chunks, vertex_numbers

GRID_LAYOUT = ("4u2", "in_sample")  # of LodGeometry.vertices, for GL
VERTEX_BYTES = 8
# A vertex's image: face · 8 + layer, with flags.
FACE_SHIFT = 3
EDGE = 128  # set in the last, provoking vertex of a triangle beside which texels show another surface
PAST_AXIS = 256  # the depth exceeds the radius, so θ is off by half a turn
BORDER = 512  # gives way to others: vertices of boundary strips, which only extrapolate the surface, and of other faces
POSITION_STEPS = 65535  # of the box around a grid, along each axis: positions take 16 bits
IMAGE_BITS = 10  # of an image number with its flags, for a vertex and in the visibility buffer
EASE_SHIFT = IMAGE_BITS  # the bits above hold how much of the meso-structure's depth a vertex takes, of EASE
EASE = 63


@dataclass(frozen=True, kw_only=True)
class LodGeometry:
    """Hold the triangles of an object's levels of detail, finest first.

    Attributes
    ----------
    vertices
        (V, 4) uint16: x, y, z over the box `box_low` + [0, 1] · `box_size`, and the number of the image that the vertex
        looks into, face · 8 + layer, with flags.
    texels
        (V, 2) int16, column and row of the sample of each vertex; −1 where it is not a sample.
    indices
        (I,) uint16 or uint32, three for each triangle; they count from the first vertex of their chunk.
    chunks
        (c, 2) int64, ascending: first index of each chunk, and the vertex from which its indices count.
    first, count
        (levels, RANGES) int64, first index and number of indices of each piece and of each further range of
        `cook.cases`.
    horizon
        (levels, PIECES, 4) metres, the viewpoints from which each piece may be seen, see `piece_horizons`.
    box_low, box_size
        (3,) float32, the box around the object, metres, object frame.
    error
        (levels,) metres, ascending: how far samples are off a level's triangles.
    """

    vertices: NDArray[np.uint16]
    texels: NDArray[np.int16]
    indices: NDArray[np.unsignedinteger]
    chunks: Chunks
    first: NDArray[np.int64]
    count: NDArray[np.int64]
    horizon: NDArray[np.float64]
    box_low: NDArray[np.float32]
    box_size: NDArray[np.float32]
    error: NDArray[np.floating]

    @property
    def positions(self) -> NDArray[np.float64]:
        """Return the positions (V, 3) float64 of the vertices, object frame, metres."""
        return vertex_positions(self.vertices, self.box_low, self.box_size)

    def triangles(self, first: int, count: int) -> NDArray[np.int64]:
        """Return the triangles in the run of `count` indices from index `first`: (count / 3, 3) rows of vertices."""
        return vertex_numbers(self.indices, self.chunks, first, count).reshape(-1, 3)

    def drawn(self, level: int, pieces: int = ALL_PIECES) -> NDArray[np.int64]:
        """Return the triangles (t, 3), rows of vertices, of level `level` that are in pieces of the mask `pieces`.

        Bit k of the mask stands for piece k.
        """
        runs = piece_runs(self.first[level], self.count[level], pieces)
        return np.concatenate([np.zeros((0, 3), np.int64), *(self.triangles(*run) for run in runs)])


def vertex_positions(
    vertices: NDArray[np.uint16], box_low: NDArray[np.float32], box_size: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Decode the positions of vertices.

    Shaders do the same in `sample_position`, shaders/common/samples.glsl.

    Parameters
    ----------
    vertices
        (n, 4) uint16, as in `LodGeometry`, whose first three numbers are positions from 0 to POSITION_STEPS.
    box_low, box_size
        (3,) float32, lowest corner and size of the box that those positions divide, metres, object frame.

    Returns
    -------
    numpy.ndarray
        (n, 3) float64, metres, object frame.
    """
    return box_low.astype(np.float64) + vertices[:, :3] * (box_size / np.float32(POSITION_STEPS))
