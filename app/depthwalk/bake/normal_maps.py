"""Look up the normal maps of a mesh where rays hit it, filtered over the surface that each ray stands for."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.raycast import Hits
from depthwalk.bake.texel_filter import bilinear
from depthwalk.bake.texture_coordinates import averaged
from depthwalk.geometry.tangent_frames import tangents, turned_normals
from depthwalk.geometry.vectors import lengths
from depthwalk.ingest.mesh import Material, Mesh
from depthwalk.parallel import Map, batches
from depthwalk.types import Array

_BATCH = 1 << 15  # hits at a time
_STEEPEST = 0.1  # cosine between a ray and the surface, below which footprints are not stretched further

Levels = list[NDArray[np.uint8] | NDArray[np.float32]]


class NormalMaps:
    """Turn the normals of a mesh as the normal maps of its materials say.

    Tangent frames are derived from the triangle that was hit, so they need no tangents of vertices.
    """

    def __init__(self, mesh: Mesh) -> None:
        """Prepare the mip-maps of the normal maps of `mesh`."""
        self._mesh = mesh
        maps = {id(m.normal_map): m.normal_map for m in mesh.materials if m.normal_map is not None}
        self._levels = {number: mip_levels(texels) for number, texels in maps.items()}

    @classmethod
    def of(cls, mesh: Mesh) -> "NormalMaps | None":
        """Return the normal maps of a mesh; None if no opaque face has one."""
        return cls(mesh) if mesh.has_normal_maps else None

    def turned(
        self, hits: Hits, normal: NDArray[np.float32], area: NDArray[np.floating], parallel_map: Map = map
    ) -> NDArray[np.float32]:
        """Return the normals at hits, turned by the normal maps.

        Parameters
        ----------
        hits
            L hits along each of n rays.
        normal
            (L, n, 3) float32, the normals as `surface_at` returns them.
        area
            (L, n) m², the surface that each hit stands for, over which the maps are averaged, see `footprint_area`.
        parallel_map
            `map`, or what `thread_map` yields to work in several threads.

        Returns
        -------
        numpy.ndarray
            (L, n, 3) float32, unit length; unchanged where the surface has no normal map, or no texture coordinates.
        """
        found = normal.copy()
        layer, ray = (hits.face >= 0).nonzero()

        def turn(batch: slice) -> None:
            at = layer[batch], ray[batch]
            face, weights = hits.face[at], np.stack([1 - hits.u[at] - hits.v[at], hits.u[at], hits.v[at]], -1)
            outward = np.where(hits.flipped[at], np.float32(-1), np.float32(1))[:, None]
            found[at] = outward * self._at(face, weights, outward * normal[at], area[at])

        list(parallel_map(turn, batches(len(ray), _BATCH)))
        return found

    def _at(
        self, face: NDArray[np.int32], weights: NDArray[np.float32], normal: NDArray[np.float32], area: Array
    ) -> NDArray[np.float32]:
        """Return the turned normals (n, 3) at points of faces (n,), by their barycentric weights (n, 3).

        normal: (n, 3), on the front of the faces; area: (n,) m².
        """
        turned = normal.copy()
        for part in self._mesh.parts:
            material = self._mesh.materials[part.material]
            if material.normal_map is None:
                continue
            mine = np.flatnonzero((face >= part.first_face) & (face < part.first_face + part.face_count))
            corners = self._mesh.faces.take(face[mine], 0)
            uv = self._mesh.uv.take(corners, 0)
            points = self._mesh.positions.take(corners, 0).astype(np.float64)
            steps, uv_steps = points[:, 1:] - points[:, :1], (uv[:, 1:] - uv[:, :1]).astype(np.float64)
            directions = tangents(steps[:, 0], steps[:, 1], uv_steps[:, 0], uv_steps[:, 1])
            stretch = np.abs(uv_steps[:, 0, 0] * uv_steps[:, 1, 1] - uv_steps[:, 0, 1] * uv_steps[:, 1, 0])
            covered = area[mine] * stretch / np.maximum(lengths(directions.across), 1e-300)
            mapped = self._looked_up(material, np.einsum("nk,nkc->nc", weights[mine], uv), covered)
            turned[mine] = turned_normals(normal[mine].astype(np.float64), directions, mapped)
        return turned

    def _looked_up(self, material: Material, uv: NDArray[np.float32], covered: Array) -> NDArray[np.float64]:
        """Return what the normal map of a material holds (n, 3) at uv (n, 2), averaged.

        covered: (n,) the part of the texture, 0 to 1, to average over.
        """
        levels = self._levels[id(material.normal_map)]
        height, width = levels[0].shape[:2]
        level = np.clip(0.5 * np.log2(np.maximum(covered * (height * width), 1.0)), 0, len(levels) - 1)
        mean = np.zeros((len(uv), 3))
        for number, texels in enumerate(levels):  # trilinear, as the GPU filters
            weight = 1 - np.abs(level - number)
            near = np.flatnonzero(weight > 0)
            if len(near):
                mean[near] += weight[near, None] * _decoded(texels, uv[near])
        return mean * [material.normal_scale, material.normal_scale, 1]


def mip_levels(normal_map: NDArray[np.uint8]) -> Levels:
    """Return the mip-maps of a normal map, the finest first, down to a single texel.

    They hold means, whose lengths tell how much normals differ; a mean of unit vectors has the right direction.

    Parameters
    ----------
    normal_map
        (H, W, 4) uint8, see `Material.normal_map`.

    Returns
    -------
    list
        (H, W, 3) uint8, then (H / 2, W / 2, 3) float32, and so on, in steps of 8 bits, 0 to 255.
    """
    levels: Levels = [normal_map[..., :3]]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(_halved(_halved(levels[-1], 0), 1))
    return levels


def footprint_area(texel: Array | float, normal: NDArray[np.floating], direction: NDArray[np.floating]) -> Array:
    """Return the surface that each ray stands for, m².

    Parameters
    ----------
    texel
        m², area of a texel across the ray: one number, or (L, n).
    normal
        (L, n, 3) unit normals of the triangles hit.
    direction
        (n, 3) or (3,) unit vectors along the rays.

    Returns
    -------
    Array
        (L, n) m².
    """
    return np.asarray(texel / np.maximum(np.abs((normal * direction).sum(-1)), _STEEPEST))


def _halved(values: NDArray[np.uint8] | NDArray[np.float32], axis: int) -> NDArray[np.float32]:
    """Return the means of `values` (H, W, 3) over pairs along an axis; over equal stretches if there are odd ones."""
    count = values.shape[axis]
    if count == 1:
        return values.astype(np.float32)
    if count % 2:
        return averaged(values.astype(np.float32), axis, count // 2)
    first, second = ((values[k::2] if axis == 0 else values[:, k::2]) for k in (0, 1))
    return np.add(first, second, dtype=np.float32) * np.float32(0.5)


def _decoded(texels: NDArray[np.uint8] | NDArray[np.float32], uv: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the vectors (n, 3) that texels (H, W, 3), 0 to 255, hold at uv (n, 2)."""
    size = texels.shape[0], texels.shape[1]
    return bilinear(lambda row, column: texels[row, column].astype(np.float32), size, uv) / np.float32(127.5) - 1
