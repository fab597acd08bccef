"""Look up normal and albedo of the mesh where rays hit it, at barycentric positions."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.raycast import Hits
from depthwalk.bake.reflection_code import reflection_codes
from depthwalk.bake.texel_filter import bilinear
from depthwalk.colour import linear_from_srgb8
from depthwalk.geometry.vectors import lengths
from depthwalk.ingest.mesh import MATT, Material, Mesh, Reflection
from depthwalk.parallel import Map, batches
from depthwalk.types import Array

_BATCH = 1 << 15  # hits at a time


def surface_at(mesh: Mesh, hits: Hits, parallel_map: Map = map) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Look up the appearance of the mesh at each hit.

    Parameters
    ----------
    mesh
        The mesh that was hit.
    hits
        L hits along each of n rays.
    parallel_map
        `map`, or what `thread_map` yields to work in several threads.

    Returns
    -------
    normal
        (L, n, 3) float32, the mesh's interpolated unit normals in its frame, turned around where the surface was hit
        from behind; zero without a hit.
    albedo
        (L, n, 4) float32, linear RGB and specular strength; zero without a hit. If the mesh has maps of roughness and
        metalness, the last is one of the `reflection_codes`.
    """
    normal = np.zeros((*hits.face.shape, 3), np.float32)
    albedo = np.zeros((*hits.face.shape, 4), np.float32)
    layer, ray = (hits.face >= 0).nonzero()

    def look(batch: slice) -> None:
        at = layer[batch], ray[batch]
        face, u, v = hits.face[at], hits.u[at], hits.v[at]
        corners = mesh.faces.take(face, 0)  # (hits, 3)
        weights = np.stack([1 - u - v, u, v], -1)
        shading = np.einsum("nk,nkc->nc", weights, mesh.normals.take(corners, 0))
        shading[hits.flipped[at]] *= -1
        normal[at] = shading / np.maximum(lengths(shading), np.float32(1e-12))[:, None]
        colour = np.einsum("nk,nkc->nc", weights, linear_from_srgb8(mesh.colours.take(corners, 0)))
        uv = np.einsum("nk,nkc->nc", weights, mesh.uv.take(corners, 0))
        albedo[at] = _apply_materials(mesh, face, colour, uv)

    list(parallel_map(look, batches(len(ray), _BATCH)))
    return normal, albedo


def mean_shininess(mesh: Mesh) -> float:
    """Return the Phong exponent of the materials of `mesh`, averaged over its faces; 0 if it is unlit."""
    if mesh.is_unlit:
        return 0.0
    weights = np.array([part.face_count for part in mesh.parts], float)
    exponents = np.array([mesh.materials[part.material].shininess for part in mesh.parts])
    return float(np.average(exponents, weights=weights))


def mean_reflection(mesh: Mesh) -> Reflection | None:
    """Return how the materials of `mesh` that reflect do so on average over its faces; None if none does.

    Roughness is that of the parts that reflect, the more the stronger their highlight. Metalness is averaged over all.
    """
    shares = {number: 0.0 for number, material in enumerate(mesh.materials) if material.reflection is not None}
    for part in mesh.parts:
        if part.material in shares:
            shares[part.material] += part.face_count
    total = sum(part.face_count for part in mesh.parts)
    roughness, metalness, weight = 0.0, 0.0, 0.0
    for number, faces in shares.items():
        reflection, strength = mesh.materials[number].reflection, faces * (mesh.materials[number].specular + 1e-3)
        assert reflection is not None  # as chosen above
        roughness, weight = roughness + strength * reflection.roughness, weight + strength
        metalness += faces / total * reflection.metalness
    return Reflection(roughness / weight, metalness) if weight else None


def _apply_materials(
    mesh: Mesh, face: NDArray[np.int32], colour: NDArray[np.float32], uv: NDArray[np.float32]
) -> NDArray[np.float32]:
    albedo = np.empty((len(face), 4), np.float32)
    for part in mesh.parts:
        mine = (face >= part.first_face) & (face < part.first_face + part.face_count)
        material = mesh.materials[part.material]
        albedo[mine, :3] = colour[mine] * _textured(material, uv[mine])
        albedo[mine, 3] = _codes(material, uv[mine]) if mesh.has_reflection_maps else material.specular
    return albedo


def _codes(material: Material, uv: NDArray[np.float32]) -> Array:
    """Return the codes (n,) of a material at texture coordinates (n, 2)."""
    if (texels := material.reflection_map) is not None:
        size = texels.shape[0], texels.shape[1]
        told = bilinear(lambda row, column: texels[row, column].astype(np.float32), size, uv) / 255
        return reflection_codes(told[:, 0], told[:, 1])
    if material.reflection is not None:
        roughness, metalness = material.reflection
    else:  # matt, as its exponent tells
        roughness, metalness = max((2 / (material.shininess + 2)) ** 0.25, MATT), 0.0
    return reflection_codes(*(np.full(len(uv), number, np.float32) for number in (roughness, metalness)))


def _textured(material: Material, uv: NDArray[np.float32]) -> NDArray[np.float32]:
    base = np.asarray(material.base_colour, np.float32)
    if material.texture is None:
        return np.broadcast_to(base, (len(uv), 3))
    texels = material.texture
    size = texels.shape[0], texels.shape[1]
    return base * bilinear(lambda row, column: linear_from_srgb8(texels[row, column, :3]), size, uv)
