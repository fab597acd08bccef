"""Keep the position of each texel of a depth image in the mesh's texture, so that colours are as sharp as the texture.

A depth image holds one colour per texel, which blurs a finer texture. The texture itself may be stored beside it, with
texture coordinates for each texel, which a shader interpolates before it looks the colour up. It may do so between
four texels only if they show one surface and one *chart*, a connected piece in the unfolding of the surface: at the
seams between charts, coordinates jump.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.grid import grid_cells, whole_cells
from depthwalk.bake.images import COORDINATE_STEPS, HAS_COORDINATES, ONE_CHART, DepthImage, Face
from depthwalk.bake.raycast import Hits
from depthwalk.colour import linear_from_srgb8, srgb8_from_linear
from depthwalk.geometry.triangles import face_normals
from depthwalk.ingest.mesh import Material, Mesh
from depthwalk.limits import MAX_DPCI_RESOLUTION
from depthwalk.types import Ints, Mask

T = TypeVar("T", bound=np.generic)

_SIDES = 2  # largest side of the texture over that of a depth image
_WORTH = 1.0  # mean texels of the texture per texel of the images, from which coordinates pay off
_WIDEST = 0.25  # of the texture, that four neighbouring texels may span
_BAND = 256  # rows of a texture at a time, since it is four times as large decoded to floats
_NONE = -1  # chart of faces without coordinates


@dataclass(frozen=True, kw_only=True)
class TexturedFaces:
    """Hold the faces of a mesh that are coloured by a single texture.

    Attributes
    ----------
    chart
        (F,) int32, the chart of each face; −1 for those with another texture, none, or vertex colours.
    texture
        (h, w, 3) uint8, sRGB, row 0 at v = 0; the base colour of the material is multiplied in.
    """

    chart: NDArray[np.int32]
    texture: NDArray[np.uint8]


@dataclass(frozen=True, kw_only=True)
class TexturePlaces:
    """Hold the positions in the texture of L layers of (H, W) texels of a face.

    Attributes
    ----------
    coordinates
        (L, H, W, 2) float32, u to the right and v upward, 0 to 1 across the texture, which repeats.
    chart
        (L, H, W) int32, the chart; −1 where there are no coordinates.
    """

    coordinates: NDArray[np.float32]
    chart: NDArray[np.int32]


def textured_faces(mesh: Mesh, resolution: int) -> TexturedFaces | None:
    """Find the texture that covers most of a mesh.

    Parameters
    ----------
    mesh
        The mesh, metres.
    resolution
        Side of the depth images, texels. The texture gets at most four times as many texels as one of them.

    Returns
    -------
    TexturedFaces | None
        The texture and the faces that show it unchanged; None if no face does.
    """
    textured = [number for number, material in enumerate(mesh.materials) if material.texture is not None]
    if not textured:
        return None
    white = (mesh.colours == 255).all(1)[mesh.faces].all(1)
    _, areas = face_normals(mesh.positions[mesh.faces].astype(np.float64))
    of_face = np.repeat([part.material for part in mesh.parts], [part.face_count for part in mesh.parts])
    alike = [np.isin(of_face, _like(mesh.materials, number)) & white for number in textured]
    best = max(range(len(textured)), key=lambda which: float(areas[alike[which]].sum()))
    shown = alike[best]
    if not areas[shown].sum() > 0:
        return None
    material = mesh.materials[textured[best]]
    return TexturedFaces(chart=_charts(mesh, shown), texture=_bounded(_tinted(material), resolution))


def texture_places(mesh: Mesh, textured: TexturedFaces, hits: Hits, shape: tuple[int, int]) -> TexturePlaces:
    """Look up the positions of hits in the texture.

    Parameters
    ----------
    mesh
        The mesh that was hit.
    textured
        Its texture.
    hits
        (L, H · W) hits of each texel's ray, row by row.
    shape
        Height H and width W of the face's images, texels.

    Returns
    -------
    TexturePlaces
        Coordinates and charts of the texels.
    """
    chart = np.where(hits.face >= 0, textured.chart[hits.face], _NONE)
    coordinates = np.zeros((*chart.shape, 2), np.float32)
    at = (chart >= 0).nonzero()
    u, v = hits.u[at], hits.v[at]
    weights = np.stack([1 - u - v, u, v], -1)
    coordinates[at] = np.einsum("nk,nkc->nc", weights, mesh.uv.take(mesh.faces.take(hits.face[at], 0), 0))
    layers = (len(chart), *shape)
    return TexturePlaces(coordinates=coordinates.reshape(*layers, 2), chart=chart.reshape(layers))


def with_coordinates(image: DepthImage, places: TexturePlaces) -> DepthImage:
    """Return `image`, whose finest cells are known, with the coordinates in `places` for its layer.

    See `DepthImage.coordinates` for how they are stored.
    """
    uv, chart = places.coordinates[image.layer], places.chart[image.layer]
    stored = np.round((uv - np.floor(uv)) * COORDINATE_STEPS).astype(np.int64) & COORDINATE_STEPS - 1
    corners = grid_cells((chart.shape[0], chart.shape[1]), image.face, 1)
    charts, around = _at_corners(chart, corners), _at_corners(stored, corners)
    apart = np.abs(_shortest(around - around[:1])).max((0, 2)) / COORDINATE_STEPS
    one = whole_cells(image, 0) & (charts == charts[:1]).all(0) & (charts[0] >= 0) & (apart < _WIDEST)
    codes = (stored & ~1).astype(np.uint16)
    codes[..., 0] |= (chart >= 0).astype(np.uint16) * HAS_COORDINATES
    codes[chart < 0] = 0
    i, j, _, _ = corners
    codes[j, i, 1] |= one.astype(np.uint16) * ONE_CHART
    return replace(image, coordinates=codes)


def kept_coordinates(codes: NDArray[np.uint16], used: Mask, face: Face) -> NDArray[np.uint16]:
    """Return coordinates without those of dropped texels.

    Parameters
    ----------
    codes
        (H, W, 2) uint16, see `DepthImage.coordinates`.
    used
        (H, W) bool, the texels that are kept.
    face
        The face that the image lies on.

    Returns
    -------
    numpy.ndarray
        (H, W, 2) uint16, zero where a texel is dropped. No cell with such a corner is marked as lying in one chart.
    """
    kept = np.where(used[..., None], codes, np.uint16(0))
    corners = grid_cells((used.shape[0], used.shape[1]), face, 1)
    broken = ~_at_corners(used, corners).all(0)
    kept[corners[1][broken], corners[0][broken], 1] &= np.uint16(~ONE_CHART & 0xFFFF)
    return kept


def are_worth_keeping(images: Sequence[DepthImage], texture: NDArray[np.uint8]) -> bool:
    """Return whether a texture shows more detail than the colours that depth images hold.

    Parameters
    ----------
    images
        The depth images, with their owners and coordinates.
    texture
        (h, w, 3) the texture.

    Returns
    -------
    bool
        Whether a texel of the images covers at least one texel of the texture, averaged over all texels between which
        coordinates may be interpolated.
    """
    height, width = texture.shape[:2]
    covered: list[NDArray[np.float64]] = []
    for image in images:
        if image.coordinates is None:
            continue
        corners = grid_cells((image.depth.shape[0], image.depth.shape[1]), image.face, 1)
        i, j, _, _ = corners
        shown = (image.coordinates[j, i, 1] & ONE_CHART > 0) & (image.owner[j, i] == image.face)
        lower_left, right, up = _at_corners(image.coordinates.astype(np.int64), corners)[:3, shown]
        across, upward = (_shortest(end - lower_left) / COORDINATE_STEPS * (width, height) for end in (right, up))
        covered.append(np.abs(across[:, 0] * upward[:, 1] - across[:, 1] * upward[:, 0]))
    texels = np.concatenate(covered) if covered else np.zeros(0)
    return len(texels) > 0 and bool(texels.mean() >= _WORTH)


def _shortest(difference: Ints) -> Ints:
    """Wrap a `difference` of stored coordinates to −1/2 … 1/2 of the texture, which repeats."""
    return (difference + COORDINATE_STEPS // 2) % COORDINATE_STEPS - COORDINATE_STEPS // 2


def _at_corners(values: NDArray[T], corners: tuple[NDArray[np.int64], ...]) -> NDArray[T]:
    """Return values (H, W, …) at the corners of cells, (4, cells, …): lower left, lower right, upper left and right."""
    i0, j0, i1, j1 = corners
    return np.stack([values[j0, i0], values[j0, i1], values[j1, i0], values[j1, i1]])


def _like(materials: Sequence[Material], number: int) -> list[int]:
    """Return the numbers of the materials that colour a surface the same as material `number`."""
    model = materials[number]
    assert model.texture is not None
    return [
        other
        for other, material in enumerate(materials)
        if material.base_colour == model.base_colour
        and (
            material.texture is model.texture
            or (material.texture is not None and np.array_equal(material.texture, model.texture))
        )
    ]


def _charts(mesh: Mesh, shown: Mask) -> NDArray[np.int32]:
    """Return `TexturedFaces.chart`: faces `shown` (F,) of one chart share vertices, positions and coordinates.

    A vertex may be in the mesh several times, with other normals, or with coordinates that differ by whole numbers.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    used, corners = np.unique(mesh.faces[shown], return_inverse=True)
    uv = mesh.uv[used]
    place = np.column_stack([mesh.positions[used], uv - np.floor(uv)]) + np.float32(0)  # −0 is 0
    _, welded = np.unique(place, axis=0, return_inverse=True)
    a, b, c = welded.reshape(-1)[corners.reshape(-1, 3)].T
    ends = np.concatenate([a, a]), np.concatenate([b, c])
    size = int(welded.max()) + 1
    _, chart = connected_components(coo_array((np.ones(len(ends[0]), np.float32), ends), (size, size)))
    charts = np.full(len(mesh.faces), _NONE, np.int32)
    charts[shown] = chart[a]
    return charts


def _tinted(material: Material) -> NDArray[np.uint8]:
    """Return the texture of `material` (h, w, 3), sRGB, row 0 at v = 0, multiplied by its base colour."""
    assert material.texture is not None
    texture = np.ascontiguousarray(material.texture[::-1, :, :3])
    if material.base_colour == (1.0, 1.0, 1.0):
        return texture
    return srgb8_from_linear(linear_from_srgb8(texture) * np.asarray(material.base_colour, np.float32))


def _bounded(texture: NDArray[np.uint8], resolution: int) -> NDArray[np.uint8]:
    """Return `texture` (h, w, 3) averaged down to the size allowed for images of `resolution` texels a side."""
    height, width = texture.shape[:2]
    scale = min(_SIDES * resolution / np.sqrt(height * width), MAX_DPCI_RESOLUTION / max(height, width))
    if scale >= 1:
        return texture
    rows, columns = (max(int(size * scale), 1) for size in (height, width))
    bands = (texture[first : first + _BAND] for first in range(0, height, _BAND))
    narrow = np.concatenate([averaged(linear_from_srgb8(band), 1, columns) for band in bands])
    return srgb8_from_linear(averaged(narrow, 0, rows))


def averaged(values: NDArray[np.float32], axis: int, count: int) -> NDArray[np.float32]:
    """Return the means of `values`, (H, W, …) float32, over `count` equal stretches along `axis`."""
    ends = np.linspace(0, values.shape[axis], count + 1)
    whole = np.minimum(ends.astype(int), values.shape[axis] - 1)
    along = np.moveaxis(values, axis, 0)
    sums = np.concatenate([np.zeros((1, *along.shape[1:])), along.cumsum(0, dtype=np.float64)])
    upto = sums[whole] + (ends - whole)[:, None, None] * along[whole]
    return np.moveaxis((np.diff(upto, axis=0) * (count / len(along))).astype(np.float32), 0, axis)
