"""Gather what of a mesh lets light through or glows, as polygons for the pass `translucency`.

Depth images hold opaque surfaces alone, without the light that they send out. Both are few triangles of most meshes:
the panes of a window, the lamps of a car.
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
"""A vertex: metres, asset frame; linear light sent out; linear colour and opacity; strength and exponent of Phong."""


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
        (H, W, 4) texture of the light that is sent out, sRGB, top row first; None: none.
    """

    first: int
    count: int
    colour: Texels | None
    emission: Texels | None


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
        How far vertices are from it at most, metres.
    """

    vertices: NDArray[np.void]
    faces: NDArray[np.uint32]
    runs: tuple[TextureRun, ...]
    glowing: tuple[TextureRun, ...]
    centroids: Array
    centre: Array
    radius: float


def gather_translucent(mesh: Mesh) -> TranslucentMesh | None:
    """Gather what of a mesh lets light through or glows.

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
    through = _Gathered(mesh, mesh.translucent_faces, mesh.translucent_parts, lambda each: each.texture)
    shining = _Gathered(mesh, mesh.faces, glowing, lambda each: None, _seen_to_glow)
    if len(shining.faces) > MAX_TRANSLUCENT_TRIANGLES:
        found, most = len(shining.faces), MAX_TRANSLUCENT_TRIANGLES
        log.warning("a mesh has %d triangles that glow, more than %d; it is drawn without its glow", found, most)
        shining = _Gathered(mesh, mesh.faces, (), lambda each: None)
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


class _Gathered:
    """Gather the vertices of parts of a mesh, with what their materials say, and their faces by their textures.

    Parameters
    ----------
    mesh
        The mesh.
    faces
        (F, 3) the faces that `parts` refer to.
    parts
        The parts to gather.
    colour
        Returns the texture of a material that counts.
    seen
        Returns which faces (f,) of a part, given with the mesh and their material, are gathered; None: all are.
    """

    def __init__(
        self,
        mesh: Mesh,
        faces: NDArray[np.int32],
        parts: Iterable[Part],
        colour: Callable[[Material], Texels | None],
        seen: Callable[[Mesh, NDArray[np.int32], Material], Mask] | None = None,
    ) -> None:
        self._colour, self._mesh = colour, mesh
        ordered = sorted(parts, key=lambda part: self._key(mesh.materials[part.material]))
        vertices, corners, self._parts, count = [np.zeros(0, TRANSLUCENT_VERTEX)], [np.zeros((0, 3), np.uint32)], [], 0
        for part in ordered:
            material = mesh.materials[part.material]
            own = faces[part.first_face : part.first_face + part.face_count]
            own = own if seen is None else own[seen(mesh, own, material)]
            rows, numbers = np.unique(own, return_inverse=True)
            vertices.append(_vertices(mesh, rows, material))
            corners.append((numbers.reshape(-1, 3) + count).astype(np.uint32))
            self._parts.append((material, len(own)))
            count += len(rows)
        self.vertices, self.faces = np.concatenate(vertices), np.concatenate(corners)

    def _key(self, material: Material) -> tuple[int, int]:
        return id(self._colour(material)), id(material.emission_texture)

    def runs(self, first: int) -> tuple[TextureRun, ...]:
        """Return the runs of faces that show the same textures; `first` is the number of the first face."""
        runs = []
        for _, alike in groupby(self._parts, lambda each: self._key(each[0])):
            materials, counts = zip(*alike, strict=True)
            if count := sum(counts):
                textures = {"colour": self._colour(materials[0]), "emission": materials[0].emission_texture}
                runs.append(TextureRun(first=first, count=count, **textures))
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


def _seen_to_glow(mesh: Mesh, faces: NDArray[np.int32], material: Material) -> Mask:
    """Return which faces (f, 3) may show a texel that is not black in the texture of what they send out, (f,) bool.

    Counted by a summed-area table (Crow 1984) over the texels about each face's coordinates, so that none is missed.
    Faces across which the texture begins anew are kept.
    """
    texture = material.emission_texture
    if texture is None:
        return np.ones(len(faces), bool)
    height, width = texture.shape[:2]
    table = np.zeros((height + 1, width + 1), np.int64)
    table[1:, 1:] = (texture[..., :3] > 0).any(-1).cumsum(0).cumsum(1)
    corners = mesh.uv[faces].astype(np.float64)
    corners -= np.floor(corners.min(1, keepdims=True))
    across, down = corners[..., 0] * width, (1 - corners[..., 1]) * height
    # Texels that linear filters read; coarser mip-maps read more, of what is then less than a pixel.
    left, right = np.floor(across.min(1) - 1), np.ceil(across.max(1) + 1)
    top, bottom = np.floor(down.min(1) - 1), np.ceil(down.max(1) + 1)
    wraps = (left < 0) | (top < 0) | (right > width) | (bottom > height)
    left, right = (np.clip(each, 0, width).astype(np.int64) for each in (left, right))
    top, bottom = (np.clip(each, 0, height).astype(np.int64) for each in (top, bottom))
    lit = table[bottom, right] - table[top, right] - table[bottom, left] + table[top, left]
    return np.asarray(wraps | (lit > 0))
