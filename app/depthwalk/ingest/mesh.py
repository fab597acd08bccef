"""Define the mesh that ingest hands to the baker and the renderer: arrays only, no files."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

MOST_LEVELS = 6  # of detail of a mesh, itself included

OPAQUE = 0.99
"""Alpha from which a surface counts as opaque: what is behind it is not missed."""

DIELECTRIC_HIGHLIGHT = 0.3
"""Strength of the highlight of smooth glTF materials that are not metal; with metalness it rises to 1."""

MATT = 0.75
"""Roughness from which on only metal reflects its surroundings noticeably."""


class Reflection(NamedTuple):
    """Describe how a surface reflects what is around it.

    Attributes
    ----------
    roughness : float
        From 0, a mirror, to 1, as glTF defines it: the square root of the α of GGX.
    metalness : float
        From 0, plastic or glazed, to 1, metal: reflections have the surface's colour, and nothing is scattered.
    """

    roughness: float
    metalness: float


@dataclass(frozen=True)
class Material:
    """Describe the appearance of a run of faces, in the terms of Phong's model.

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
        Alpha of the texture, 0 to 1, below which there is no surface, as between the leaves on a card; None: there is
        surface everywhere.
    opacity : float or None
        Part of the light from behind that the surface hides, 0 to 1, multiplied by the texture's alpha; None: the
        surface is opaque, and alpha matters only for `cutoff`.
    emission : (3,) float
        Linear RGB emitted in all directions; 1 is what a white surface that faces the sun reflects.
    emission_texture : (H, W, 4) uint8 or None
        sRGB, row 0 at the top; multiplies `emission`.
    normal_map : (H, W, 4) uint8 or None
        Normals in tangent space, row 0 at the top: x towards u, y towards v, z outward, as (component + 1) / 2 · 255;
        alpha is not used. None: the surface has the normals of its vertices.
    normal_scale : float
        Factor on x and y of the normals in `normal_map`, −100 to 100.
    unlit : bool
        Whether the surface shows its colour as it is, whatever light there is, as scans whose texture holds the light.
        Then it has no highlight, emission and normal map.
    reflection : Reflection or None
        How the surface reflects a sky that lights the scene; None: too little to show. Under other light, only the
        highlight shows.
    reflection_map : (H, W, 2) uint8 or None
        Roughness and metalness, 255 for 1, texel by texel, row 0 at the top; `specular`, `shininess` and `reflection`
        are then their means. None: they are the same everywhere. Only with a `reflection`.
    """

    base_colour: tuple[float, float, float] = (0.8, 0.8, 0.8)
    texture: NDArray[np.uint8] | None = None
    specular: float = 0.15
    shininess: float = 32.0
    cutoff: float | None = None
    opacity: float | None = None
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    emission_texture: NDArray[np.uint8] | None = None
    normal_map: NDArray[np.uint8] | None = None
    normal_scale: float = 1.0
    unlit: bool = False
    reflection: Reflection | None = None
    reflection_map: NDArray[np.uint8] | None = None

    @property
    def glows(self) -> bool:
        """Return whether the surface emits light."""
        return any(self.emission)


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
        sRGB; white if the file has none.
    uv : (V, 2) float32
        Texture coordinates, v upward; zeros if the file has none.
    faces : (F, 3) int32
        Vertex indices of the opaque faces, counter-clockwise seen from outside, ordered by part. Only these faces are
        baked, are simplified and cast shadows.
    parts : tuple of Part
        The runs of faces that share a material, in order; together they are all opaque faces.
    materials : tuple of Material
        The materials that the parts refer to.
    translucent_faces : (T, 3) int32
        The translucent faces, likewise; `positions`, and so the bounds, include their vertices.
    translucent_parts : tuple of Part
        The runs of `translucent_faces` that share a material.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    colours: NDArray[np.uint8]
    uv: NDArray[np.float32]
    faces: NDArray[np.int32]
    parts: tuple[Part, ...]
    materials: tuple[Material, ...]
    translucent_faces: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    translucent_parts: tuple[Part, ...] = ()

    @property
    def bounds(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the lowest and the highest corner, (3,) float32 each, metres, of the axis-aligned bounding box."""
        return self.positions.min(axis=0), self.positions.max(axis=0)

    @property
    def is_translucent(self) -> bool:
        """Return whether any of it is translucent or glows, so that more than its opaque faces is drawn."""
        return bool(self.translucent_parts) or any(self.materials[part.material].glows for part in self.parts)

    @property
    def is_unlit(self) -> bool:
        """Return whether all of it shows its colour without light."""
        return bool(self.materials) and all(material.unlit for material in self.materials)

    @property
    def has_normal_maps(self) -> bool:
        """Return whether any of its opaque faces has a normal map."""
        return any(self.materials[part.material].normal_map is not None for part in self.parts)

    @property
    def has_reflection_maps(self) -> bool:
        """Return whether any of its opaque faces has a map of roughness and metalness."""
        return any(self.materials[part.material].reflection_map is not None for part in self.parts)

    @property
    def nbytes(self) -> int:
        """Return how many bytes its arrays and textures take."""
        arrays: list[NDArray[Any]] = [self.positions, self.normals, self.colours, self.uv]
        arrays += self.faces, self.translucent_faces
        for each in self.materials:
            textures = each.texture, each.emission_texture, each.normal_map, each.reflection_map
            arrays += [texture for texture in textures if texture is not None]
        return sum(array.nbytes for array in arrays)


def positions_only(positions: NDArray[np.floating], faces: NDArray[np.integer]) -> Mesh:
    """Return a surface of `positions` (V, 3), metres, and `faces` (F, 3) as a mesh without normals, colours and parts.

    Rays can be cast at it, which is what it is for.
    """
    none = np.zeros((0, 3), np.float32)
    return Mesh(
        positions=positions.astype(np.float32),
        normals=none,
        colours=none.astype(np.uint8),
        uv=none,
        faces=faces.astype(np.int32),
        parts=(),
        materials=(),
    )


@dataclass(frozen=True)
class MeshLevel:
    """Hold a simplified mesh, and its distance from the original.

    Attributes
    ----------
    mesh
        The mesh, asset frame, metres.
    error
        Largest distance from the surface of the original, metres; more if its normals or colours are so far off that it
        looks as wrong as a surface at that distance (`bake.levels`).
    """

    mesh: Mesh
    error: float
