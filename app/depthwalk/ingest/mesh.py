"""Define the mesh that ingest hands to the baker and the renderer: arrays only, no files."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MOST_LEVELS = 6  # of detail of a mesh, itself included


@dataclass(frozen=True)
class Material:
    """Describe how a run of faces looks, in the terms of Phong's model.

    Attributes
    ----------
    base_colour : (3,) float
        Linear RGB; multiplies texture and vertex colour.
    texture : (H, W, 4) uint8 or None
        sRGB with alpha, row 0 at the top (v = 1).
    specular : float
        Strength of the highlight, 0 to 1.
    shininess : float
        Exponent of the highlight, 1 to 1024.
    cutoff : float or None
        Alpha of the texture, 0 to 1, below which there is no surface, as between the leaves on a card; None: the
        surface is everywhere, and alpha means nothing.
    """

    base_colour: tuple[float, float, float] = (0.8, 0.8, 0.8)
    texture: NDArray[np.uint8] | None = None
    specular: float = 0.15
    shininess: float = 32.0
    cutoff: float | None = None


@dataclass(frozen=True)
class Part:
    """Assign a run of faces of a mesh one material.

    Attributes
    ----------
    first_face
        Number of the run's first face.
    face_count
        Number of faces in the run.
    material
        Index into `Mesh.materials`.
    """

    first_face: int
    face_count: int
    material: int


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Hold a triangle mesh in its asset frame: metres, Y up, the bounding box's base centred on the origin.

    Attributes
    ----------
    positions : (V, 3) float32
        Metres.
    normals : (V, 3) float32
        Unit length.
    colours : (V, 3) uint8
        sRGB; white where the file has none.
    uv : (V, 2) float32
        Texture coordinates, v upward; zeros where the file has none.
    faces : (F, 3) int32
        Indices of vertices, counter-clockwise seen from outside, ordered by part.
    parts : tuple of Part
        The runs of faces that share a material, in order; together they are all faces.
    materials : tuple of Material
        The materials that the parts refer to.
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
        """Return the lowest and the highest corner, (3,) float32 each, metres, of the axis-aligned bounding box."""
        return self.positions.min(axis=0), self.positions.max(axis=0)

    @property
    def nbytes(self) -> int:
        """Return how many bytes its arrays and textures take."""
        bytes_of = [part.nbytes for part in (self.positions, self.normals, self.colours, self.uv, self.faces)]
        return sum(bytes_of) + sum(each.texture.nbytes for each in self.materials if each.texture is not None)


@dataclass(frozen=True)
class MeshLevel:
    """Hold a simplified mesh, and how far it is from the original.

    Attributes
    ----------
    mesh
        The mesh, asset frame, metres.
    error
        Largest distance from the surface of the original, metres; more where its normals are so far off that it looks
        as wrong as a surface at that distance (`bake.levels`).
    """

    mesh: Mesh
    error: float
