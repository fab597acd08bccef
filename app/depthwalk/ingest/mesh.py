"""The data-only mesh that ingest hands to the baker and the renderer."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MOST_LEVELS = 6  # of detail of a mesh, itself included


@dataclass(frozen=True)
class Material:
    """How a run of faces looks.

    base_colour: (3,) float, linear RGB, multiplies texture and vertex colour.
    texture: (H, W, 4) uint8, sRGB with alpha, row 0 at the top (v = 1), or None.
    specular: 0–1, strength of the Phong highlight; shininess: its exponent, 1–1024.
    """

    base_colour: tuple[float, float, float] = (0.8, 0.8, 0.8)
    texture: NDArray[np.uint8] | None = None
    specular: float = 0.15
    shininess: float = 32.0


@dataclass(frozen=True)
class Part:
    """Faces `first_face` to `first_face + face_count − 1` share one material (an index into Mesh.materials)."""

    first_face: int
    face_count: int
    material: int


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh in its asset frame: metres, Y up, the bounding box's base centred on the origin.

    positions: (V, 3) float32.
    normals:   (V, 3) float32, unit length.
    colours:   (V, 3) uint8, sRGB; white where the file has none.
    uv:        (V, 2) float32, v upward; zeros where the file has none.
    faces:     (F, 3) int32, counter-clockwise seen from outside, ordered by part.
    parts:     the runs of faces, in order, covering all of them.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    colours: NDArray[np.uint8]
    uv: NDArray[np.float32]
    faces: NDArray[np.int32]
    parts: tuple[Part, ...]
    materials: tuple[Material, ...]

    @property
    def bounds(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Corners (3,), (3,) of the axis-aligned bounding box."""
        return self.positions.min(axis=0), self.positions.max(axis=0)


@dataclass(frozen=True)
class MeshLevel:
    """A mesh that stands for a finer one. error: how far that one's surface is off at most, metres."""

    mesh: Mesh
    error: float
