"""Gather the translucent and glowing triangles of a mesh for the pass `translucency`.

Depth images hold only opaque surfaces, without the light that they emit. In most meshes both are few triangles: the
panes of a window, the lamps of a car.
"""

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from depthwalk.colour import linear_from_srgb
from depthwalk.ingest.mesh import Material, Mesh, Part
from depthwalk.limits import MAX_TRANSLUCENT_TRIANGLES
from depthwalk.types import Array, Mask

log = logging.getLogger(__name__)

Texels = NDArray[np.uint8]

_MOST_CELLS = 1024  # along a texture; for each cell it is stored whether it is black

TRANSLUCENT_VERTEX = np.dtype(
    [
        ("position", "3f4"),
        ("uv", "2f4"),
        ("emission", "3f4"),
        ("normal", "3f4"),
        ("colour", "4f4"),
        ("highlight", "2f4"),
    ]
)
"""A vertex: metres, asset frame; emission, linear; linear colour and opacity; Phong strength and exponent."""


@dataclass(frozen=True, kw_only=True)
class TextureRun:
    """Describe a run of triangles that show the same textures.

    Attributes
    ----------
    first
        Number of the run's first triangle.
    count
        Number of triangles in the run.
    colour
        (H, W, 4) texture of the colours, sRGB with alpha, top row first; None: none.
    emission
        (H, W, 4) texture of the emission, sRGB, top row first; None: none.
    cutoff
        Alpha of the texture of colours, 0 to 1, below which nothing glows; None: everything glows.
    normal_map
        (H, W, 4) normal map, see `Material.normal_map`; None: none. Glow does not depend on it.
    normal_scale
        Factor on x and y of its normals.
    unlit
        Whether the triangles are shown without light.
    """

    first: int
    count: int
    colour: Texels | None
    emission: Texels | None
    cutoff: float | None
    normal_map: Texels | None
    normal_scale: float
    unlit: bool


@dataclass(frozen=True, kw_only=True)
class TranslucentMesh:
    """Hold the translucent and the glowing triangles of a mesh.

    Attributes
    ----------
    vertices
        (v,) TRANSLUCENT_VERTEX.
    faces
        (t, 3) uint32 rows of `vertices`: the translucent triangles, then those that are opaque and glow.
    runs
        The runs of translucent triangles.
    glowing
        The runs of triangles that are opaque and glow.
    centroids
        (k, 3) middles of the translucent triangles, metres, asset frame.
    centre
        (3,) middle of all vertices' bounding box, metres, asset frame.
    radius
        Greatest distance of a vertex from `centre`, metres.
    """

    vertices: NDArray[np.void]
    faces: NDArray[np.uint32]
    runs: tuple[TextureRun, ...]
    glowing: tuple[TextureRun, ...]
    centroids: Array
    centre: Array
    radius: float


def gather_translucent(mesh: Mesh) -> TranslucentMesh | None:
    """Gather the translucent and glowing triangles of a mesh.

    Parameters
    ----------
    mesh
        The mesh, asset frame, metres.

    Returns
    -------
    TranslucentMesh | None
        Its triangles; None where there are none.
    """
    glowing = [part for part in mesh.parts if mesh.materials[part.material].glows]
    through = _Gathered(mesh, mesh.translucent_faces, mesh.translucent_parts, lambda material: material.texture)
    shining = _Gathered(mesh, mesh.faces, glowing, _stencil, _GlowingFaces(mesh).of)
    if len(shining.faces) > MAX_TRANSLUCENT_TRIANGLES:
        found, most = len(shining.faces), MAX_TRANSLUCENT_TRIANGLES
        log.warning("a mesh has %d glowing triangles, the limit is %d; it is drawn without its glow", found, most)
        shining = _Gathered(mesh, mesh.faces, (), _stencil)
    vertices = np.concatenate([through.vertices, shining.vertices])
    if not len(vertices):
        return None
    low, high = vertices["position"].min(0), vertices["position"].max(0)
    centre = ((low + high) / 2).astype(np.float64)
    return TranslucentMesh(
        vertices=vertices,
        faces=np.concatenate([through.faces, shining.faces + np.uint32(len(through.vertices))]),
        runs=through.runs(0),
        glowing=shining.runs(len(through.faces)),
        centroids=through.vertices["position"][through.faces].mean(1, dtype=np.float64),
        centre=centre,
        radius=float(np.linalg.norm(vertices["position"] - centre, axis=1).max()),
    )


def _stencil(material: Material) -> Texels | None:
    """Return the texture whose alpha cuts holes into the surface; None: there are none."""
    return None if material.cutoff is None else material.texture


class _Gathered:
    """Gather the vertices of parts of a mesh, with their materials' values, and their faces, sorted by textures.

    Parameters
    ----------
    mesh
        The mesh.
    faces
        (F, 3) the faces that `parts` refer to.
    parts
        The parts to gather.
    colour
        Returns the colour texture to use of a material.
    seen
        Returns which faces (f,) of a part to gather, given their corners (f, 3) and their material; None: all.
    """

    def __init__(
        self,
        mesh: Mesh,
        faces: NDArray[np.int32],
        parts: Iterable[Part],
        colour: Callable[[Material], Texels | None],
        seen: Callable[[NDArray[np.int32], Material], Mask] | None = None,
    ) -> None:
        self._colour, self._mesh = colour, mesh
        ordered = sorted(parts, key=lambda part: self._key(mesh.materials[part.material]))
        vertices, corners, self._parts, count = [np.zeros(0, TRANSLUCENT_VERTEX)], [np.zeros((0, 3), np.uint32)], [], 0
        for part in ordered:
            material = mesh.materials[part.material]
            own = faces[part.first_face : part.first_face + part.face_count]
            own = own if seen is None else own[seen(own, material)]
            rows, numbers = np.unique(own, return_inverse=True)
            vertices.append(_vertices(mesh, rows, material))
            corners.append((numbers.reshape(-1, 3) + count).astype(np.uint32))
            self._parts.append((material, len(own)))
            count += len(rows)
        self.vertices, self.faces = np.concatenate(vertices), np.concatenate(corners)

    def _key(self, material: Material) -> tuple[int, int, float, int, float, bool]:
        own = id(self._colour(material)), id(material.emission_texture), material.cutoff or 0.0
        return *own, id(material.normal_map), material.normal_scale, material.unlit

    def runs(self, first: int) -> tuple[TextureRun, ...]:
        """Return the runs of faces that show the same textures; `first` is the number of the first face."""
        runs = []
        for _, alike in groupby(self._parts, lambda part: self._key(part[0])):
            materials, counts = zip(*alike, strict=True)
            if count := sum(counts):
                runs.append(
                    TextureRun(
                        first=first,
                        count=count,
                        colour=self._colour(materials[0]),
                        emission=materials[0].emission_texture,
                        cutoff=materials[0].cutoff,
                        normal_map=materials[0].normal_map,
                        normal_scale=materials[0].normal_scale,
                        unlit=materials[0].unlit,
                    )
                )
            first += count
        return tuple(runs)


def _vertices(mesh: Mesh, rows: NDArray[np.integer], material: Material) -> NDArray[np.void]:
    """Return the vertices `rows` (n,) of a mesh as its material shows them."""
    vertices = np.zeros(len(rows), TRANSLUCENT_VERTEX)
    vertices["position"], vertices["normal"], vertices["uv"] = mesh.positions[rows], mesh.normals[rows], mesh.uv[rows]
    vertices["colour"][:, :3] = linear_from_srgb(mesh.colours[rows] / 255) * material.base_colour
    vertices["colour"][:, 3] = 1.0 if material.opacity is None else material.opacity
    vertices["emission"], vertices["highlight"] = material.emission, (material.specular, material.shininess)
    return vertices


class _GlowingFaces:
    """Find which faces of a mesh may glow, by summed-area tables of their emission textures (Crow 1984).

    Parameters
    ----------
    mesh
        The mesh.
    """

    def __init__(self, mesh: Mesh) -> None:
        self._uv = mesh.uv
        self._tables: dict[int, _NonBlackCells] = {}  # by the identity of the texture, which many parts may share

    def of(self, faces: NDArray[np.int32], material: Material) -> Mask:
        """Return which faces (f, 3) of a material may show a texel that is not black, (f,) bool.

        The test is conservative; faces across which the texture repeats are always kept.
        """
        texture = material.emission_texture
        if texture is None:
            return np.ones(len(faces), bool)
        if id(texture) not in self._tables:
            self._tables[id(texture)] = _NonBlackCells.of(texture)
        height, width = texture.shape[:2]
        corners = self._uv[faces].astype(np.float64)
        corners -= np.floor(corners.min(1, keepdims=True))
        across, down = corners[..., 0] * width, (1 - corners[..., 1]) * height
        # The texels that linear filtering reads. Coarser mip-maps read more, but then the face is smaller than a pixel.
        left, right, top, bottom = across.min(1) - 1, across.max(1) + 1, down.min(1) - 1, down.max(1) + 1
        wraps = (left < 0) | (top < 0) | (right > width) | (bottom > height)
        return np.asarray(wraps | self._tables[id(texture)].any_in(left, right, top, bottom))


@dataclass(frozen=True, kw_only=True)
class _NonBlackCells:
    """Count the cells of a texture that are not black.

    Attributes
    ----------
    edge
        Texels along a cell; more than 1 for a large texture, whose table would otherwise take more memory than itself.
    counts
        (rows + 1, columns + 1) how many such cells are above and to the left of each corner of the grid.
    """

    edge: int
    counts: NDArray[np.int32]

    @classmethod
    def of(cls, texture: Texels) -> "_NonBlackCells":
        """Return the cells of a texture (H, W, 4)."""
        height, width = texture.shape[:2]
        edge = -(-max(height, width) // _MOST_CELLS)
        rows = np.maximum.reduceat(texture[..., :3], np.arange(0, height, edge), axis=0)
        lit = np.maximum.reduceat(rows, np.arange(0, width, edge), axis=1).any(-1)
        counts = np.zeros((lit.shape[0] + 1, lit.shape[1] + 1), np.int32)
        counts[1:, 1:] = lit.cumsum(0, dtype=np.int32).cumsum(1, dtype=np.int32)
        return cls(edge=edge, counts=counts)

    def any_in(self, left: Array, right: Array, top: Array, bottom: Array) -> Mask:
        """Return whether any cell that each of n rectangles touches is not black, (n,); edges in texels."""
        rows, columns = (side - 1 for side in self.counts.shape)
        first = (np.clip(np.floor(low / self.edge), 0, most) for low, most in ((top, rows), (left, columns)))
        end = (np.clip(np.ceil(high / self.edge), 0, most) for high, most in ((bottom, rows), (right, columns)))
        (above, before), (below, beyond) = ((side.astype(np.int64) for side in sides) for sides in (first, end))
        table = self.counts
        return np.asarray(table[below, beyond] + table[above, before] > table[above, beyond] + table[below, before])
