"""Meshes with normal maps whose normals are known everywhere."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.mesh import Material, Mesh
from depthwalk.types import Array
from shapes import globe, mesh_of

TILT = np.array([0.36, 0.48, 0.8])  # of `tilted`: x towards u, y towards v, z outward
_DOME = 0.9  # radius of a dome over half the side of its cell


def coded(normal: Array) -> NDArray[np.uint8]:
    """Unit vectors (h, w, 3), the top row first, as a normal map (h, w, 4)."""
    texels = np.full((*normal.shape[:2], 4), 255, np.uint8)
    texels[..., :3] = np.round((normal + 1) * 127.5)
    return texels


def tilted(mesh: Mesh, **changes: object) -> Mesh:
    """A mesh of a normal map that turns each normal by `TILT`."""
    material = replace(mesh.materials[0], normal_map=coded(np.broadcast_to(TILT, (4, 4, 3))), **changes)  # type: ignore[arg-type]
    return replace(mesh, materials=(material,))


def mirrored_globe() -> Mesh:
    """A globe whose texture runs eastward on the half x > 0 and westward on the other, mirrored."""
    mesh = globe(np.full((1, 1, 4), 255, np.uint8), 64, 32)
    u = mesh.uv[:, 0]
    mesh.uv[:, 0] = np.where(u <= 0.5, 2 * u, 2 - 2 * u)
    return replace(mesh, materials=(replace(mesh.materials[0], texture=None),))


def tilted_globe_normals(normal: Array) -> Array:
    """The unit normals (n, 3) of `tilted(mirrored_globe())` where those of the globe itself are `normal`."""
    east = np.cross([0.0, 1, 0], normal)
    east /= np.linalg.norm(east, axis=-1, keepdims=True)
    along_u = np.where(normal[..., :1] > 0, east, -east)
    return np.asarray(TILT[0] * along_u + TILT[1] * np.cross(normal, east) + TILT[2] * normal)


def dome_normals(u: Array, v: Array, cells: int) -> tuple[Array, NDArray[np.bool_]]:
    """Normals (…, 3) in tangent space of a plane with `cells`² domes, and where they are far from a dome's rim."""
    x, y = (2 * (cells * at % 1) - 1 for at in (u, v))
    square = (x**2 + y**2) / _DOME**2
    inside = square < 0.95
    height = np.sqrt(np.maximum(1 - square, 0))
    domes = np.stack([x / _DOME, y / _DOME, height], -1)
    return np.where(inside[..., None], domes, [0.0, 0, 1]), (square < 0.8) | (square > 1.1)


def dome_map(size: int, cells: int) -> NDArray[np.uint8]:
    """The normal map (size, size, 4) of `dome_normals`."""
    at = (np.arange(size) + 0.5) / size
    u, v = np.meshgrid(at, at[::-1])
    return coded(dome_normals(u, v, cells)[0])


def domed_square(size: int, cells: int) -> Mesh:
    """A square of 2 m that stands on the origin in the plane z = 0, faces +z, and has domes."""
    positions = [(-1, 0, 0), (1, 0, 0), (1, 2, 0), (-1, 2, 0)]
    mesh = mesh_of(positions, [(0, 1, 2), (0, 2, 3)], [(0.0, 0, 1)] * 4, colour=(255, 255, 255))
    uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
    return replace(mesh, uv=uv, materials=(Material((0.8, 0.8, 0.8), normal_map=dome_map(size, cells)),))
