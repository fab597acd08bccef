"""Which face samples a piece of surface best, so that it is drawn once, by that one, where several faces are drawn.

A sample's footprint is the distance on the surface to its neighbour sample: the spacing of the rays there over the
cosine between ray and surface.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import Cylinder, DepthImage, Face, image_points, layer_triangles, surface_rays, texel_size

Array = NDArray[np.floating]
_GRAZING = 1e-3  # cosine below which a face is taken to see nothing
_CORNERS = 6  # triangles around a texel that is inside its surface, not at a border


def assign_owners(cylinder: Cylinder, images: list[DepthImage]) -> list[NDArray[np.uint8]]:
    """For each image the Face (H, W) that samples the surface at a texel with the smallest footprint."""
    inner = {id(image): _inner_texels(image, images) for image in images}
    owners = []
    for image in images:
        owner = np.full(image.depth.shape, image.face, np.uint8)
        solid = np.isfinite(image.depth)
        point, normal = image_points(cylinder, image)[solid], image.normal[solid]
        best = footprints(cylinder, image.face, image.depth.shape, point, normal)
        winner = owner[solid]
        for face in Face:
            if face is image.face:
                continue
            rivals = [other for other in images if other.face is face]
            if rivals:
                size = footprints(cylinder, face, rivals[0].depth.shape, point, normal)
                better = np.flatnonzero(size < best)
                seen = _seen_by(cylinder, rivals, inner, point[better], normal[better], size[better])
                winner[better[seen]], best[better[seen]] = face, size[better[seen]]
        owner[solid] = winner
        owners.append(owner)
    return owners


def footprints(
    cylinder: Cylinder, face: Face, shape: tuple[int, ...], point: Array, normal: Array
) -> NDArray[np.float64]:
    """Footprint (n,) in metres of surface points (n, 3) with normals (n, 3); +inf where `face` sees their back."""
    u, v = _image_position(cylinder, face, point)
    _, direction = surface_rays(cylinder, face, u, v)
    width, height = texel_size(cylinder, face, (shape[0], shape[1]))
    spacing = np.full(len(point), max(width, height))
    if face is Face.SIDE:
        spacing = np.maximum(height, width * np.hypot(point[:, 0], point[:, 2]) / cylinder.radius)
    cosine = -np.einsum("ni,ni->n", direction, normal)
    return np.where(cosine > _GRAZING, spacing / np.maximum(cosine, _GRAZING), np.inf)


def _image_position(cylinder: Cylinder, face: Face, point: Array) -> tuple[Array, Array]:
    x, y, z = point.T
    if face is Face.SIDE:
        return np.arctan2(z, x) / (2 * np.pi) % 1.0, (y - cylinder.bottom) / cylinder.height
    return x / (2 * cylinder.half_width) + 0.5, z / (2 * cylinder.half_depth) + 0.5


def _seen_by(
    cylinder: Cylinder,
    rivals: list[DepthImage],
    inner: dict[int, NDArray[np.bool_]],
    point: Array,
    normal: Array,
    footprint: Array,
) -> NDArray[np.bool_]:
    """Which points (n, 3) one of the layers `rivals` of a face holds, well inside a connected piece of surface."""
    face = rivals[0].face
    height, width = rivals[0].depth.shape
    u, v = _image_position(cylinder, face, point)
    i = np.clip((u * width).astype(int), 0, width - 1)
    j = np.clip((v * height).astype(int), 0, height - 1)
    origin, _ = surface_rays(cylinder, face, u, v)
    depth = np.linalg.norm(point - origin, axis=1)
    seen = np.zeros(len(point), bool)
    for rival in rivals:
        with np.errstate(invalid="ignore"):
            same = np.abs(rival.depth[j, i] - depth) < 1.5 * footprint
        facing = np.einsum("ni,ni->n", rival.normal[j, i], normal) > 0.5
        seen |= same & facing & inner[id(rival)][j, i]
    return seen


def _inner_texels(image: DepthImage, images: list[DepthImage]) -> NDArray[np.bool_]:
    """Texels (H, W) of `image` that the finest grid surrounds with triangles on all sides."""
    layers = [other for other in images if other.face is image.face]
    count = np.zeros((len(layers), image.depth.size), np.uint8)
    for anchor in layers:
        layer, texel = layer_triangles(anchor, 0)
        np.add.at(count, (layer.ravel(), texel.ravel()), 1)
    return (count[image.layer] >= _CORNERS).reshape(image.depth.shape)
