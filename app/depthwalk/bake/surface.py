"""What a ray sees where it hits: normal and albedo of the mesh at barycentric positions."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.raycast import Hits
from depthwalk.colour import linear_from_srgb8
from depthwalk.ingest.mesh import Material, Mesh


def surface_at(mesh: Mesh, hits: Hits) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Normal (L, n, 3), unit, and albedo (L, n, 4), linear RGB + specular strength, at each hit; zeros without."""
    normal = np.zeros((*hits.face.shape, 3), np.float32)
    albedo = np.zeros((*hits.face.shape, 4), np.float32)
    rays = hits.face >= 0
    if rays.any():
        corners = mesh.faces[hits.face[rays]]  # (hits, 3)
        u, v = hits.u[rays], hits.v[rays]
        weights = np.stack([1 - u - v, u, v], -1)
        shading = np.einsum("nk,nkc->nc", weights, mesh.normals[corners])
        shading[hits.flipped[rays]] *= -1
        normal[rays] = shading / np.maximum(np.linalg.norm(shading, axis=1, keepdims=True), 1e-12)
        colour = np.einsum("nk,nkc->nc", weights, linear_from_srgb8(mesh.colours)[corners])
        uv = np.einsum("nk,nkc->nc", weights, mesh.uv[corners])
        albedo[rays] = _apply_materials(mesh, hits.face[rays], colour, uv)
    return normal, albedo


def mean_shininess(mesh: Mesh) -> float:
    """Phong exponent of the whole mesh: the mean over its faces."""
    weights = np.array([part.face_count for part in mesh.parts], float)
    exponents = np.array([mesh.materials[part.material].shininess for part in mesh.parts])
    return float(np.average(exponents, weights=weights))


def _apply_materials(
    mesh: Mesh, face: NDArray[np.int32], colour: NDArray[np.float32], uv: NDArray[np.float32]
) -> NDArray[np.float32]:
    albedo = np.empty((len(face), 4), np.float32)
    for part in mesh.parts:
        mine = (face >= part.first_face) & (face < part.first_face + part.face_count)
        material = mesh.materials[part.material]
        albedo[mine, :3] = colour[mine] * _textured(material, uv[mine])
        albedo[mine, 3] = material.specular
    return albedo


def _textured(material: Material, uv: NDArray[np.float32]) -> NDArray[np.float32]:
    base = np.asarray(material.base_colour, np.float32)
    if material.texture is None:
        return np.broadcast_to(base, (len(uv), 3))
    return base * bilinear(linear_from_srgb8(material.texture[..., :3]), uv)


def bilinear(texture: NDArray[np.float32], uv: NDArray[np.float32]) -> NDArray[np.float32]:
    """Samples (n, C) of a repeating texture (H, W, C), row 0 at v = 1, at uv (n, 2)."""
    height, width = texture.shape[:2]
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - i)[:, None].astype(np.float32), (y - j)[:, None].astype(np.float32)
    i0, i1, j0, j1 = i % width, (i + 1) % width, j % height, (j + 1) % height
    low = texture[j0, i0] * (1 - fx) + texture[j0, i1] * fx
    high = texture[j1, i0] * (1 - fx) + texture[j1, i1] * fx
    return low * (1 - fy) + high * fy
