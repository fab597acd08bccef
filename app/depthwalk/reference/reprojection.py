"""Find where a finished picture shows what another camera sees: the twin of shaders/reprojection."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.reprojection import CELL, FIXED_POINT_STEPS, HIDDEN, REACH, seen_from
from depthwalk.render.view.view import View
from depthwalk.types import Array

_STRIDE = 4  # pixels


def nearest_around(distances: Array) -> NDArray[np.float64]:
    """Return the least distance in and around each cell of a picture, as shaders/reprojection/nearest.frag finds it.

    Parameters
    ----------
    distances
        (h, w) metres, lower row first.

    Returns
    -------
    NDArray[np.float64]
        (⌈h / CELL⌉, ⌈w / CELL⌉) metres.
    """
    rows, columns = (-(-size // CELL) for size in distances.shape)
    steps = np.arange(_STRIDE // 2, CELL + 2 * REACH, _STRIDE) - REACH
    row, column = (
        np.append(np.arange(count)[:, None] * CELL + steps, np.arange(count)[:, None] * CELL, 1).clip(0, size - 1)
        for count, size in zip((rows, columns), distances.shape, strict=True)
    )
    found: NDArray[np.float64] = distances[row[:, None, :-1, None], column[None, :, None, :-1]].min((2, 3))
    return np.asarray(np.minimum(found, distances[row[:, None, -1], column[None, :, -1]]))


def sources(picture: View, distances: Array, view: View) -> NDArray[np.float64]:
    """Return which place of a picture each pixel of another view is filled from.

    The surface on a pixel's ray is found by fixed-point steps, which take turns between how far away it is and where in
    the picture it therefore lies (Bowles et al. 2012, "Iterative Image Warping"). They begin with what is there if
    everything is infinitely far, and once more with the nearest surface around.

    Parameters
    ----------
    picture
        The view of the picture.
    distances
        (h, w) metres along the picture's view axis, lower row first; `render.reprojection.BEYOND` where nothing is.
    view
        The other view, of W × H pixels.

    Returns
    -------
    NDArray[np.float64]
        (H, W, 2) places in the picture, from (0, 0), its lower left corner, to (1, 1); lower row first.
    """
    rays_of, viewer, axis = seen_from(picture, view)
    width, height = view.size
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, (np.arange(height) + 0.5) / height * 2 - 1)
    rays = np.stack([x, y, np.ones_like(x)], -1) @ rays_of.T
    half_extent = np.array(picture.half_extent)

    def place_of(point: Array) -> Array:
        return np.asarray(0.5 + 0.5 * point[..., :2] / (np.maximum(point[..., 2:], 1e-3) * half_extent))

    def search(place: Array, ahead: Array) -> tuple[Array, Array, Array, Array]:
        expected = farthest = ahead
        behind = place
        for _ in range(FIXED_POINT_STEPS):
            surface = np.dstack([(2 * place - 1) * half_extent, np.ones_like(ahead)]) * ahead[..., None]
            point = viewer + np.maximum((surface - viewer) @ axis, 1e-2)[..., None] * rays
            place, expected = place_of(point), point[..., 2]
            ahead = look_up(distances, place)
            behind = np.where((ahead > farthest)[..., None], place, behind)
            farthest = np.maximum(farthest, ahead)
        return place, ahead, expected, behind

    far_place = place_of(rays)
    far_ahead, near = look_up(distances, far_place), look_up(nearest_around(distances), far_place)
    place, ahead, expected, behind = search(far_place, far_ahead)
    other_place, other_ahead, other_expected, other_behind = search(far_place, near)
    better = (near < HIDDEN * np.minimum(ahead, far_ahead)) & (other_ahead < ahead)
    better &= np.abs(other_ahead - other_expected) < (1 - HIDDEN) * other_expected
    place, behind = (np.where(better[..., None], *both) for both in ((other_place, place), (other_behind, behind)))
    ahead, expected = np.where(better, other_ahead, ahead), np.where(better, other_expected, expected)
    found = np.where((ahead < HIDDEN * expected)[..., None], behind, place)
    return np.asarray(1 - np.abs(1 - np.abs(found)))  # mirrored beyond the edges


def look_up(texture: Array, place: Array) -> NDArray[np.float64]:
    """Return the texels (…) of a texture (h, w) at places (…, 2), 0 to 1, without filtering."""
    rows, columns = texture.shape
    texel = np.clip((place * (columns, rows)).astype(int), 0, (columns - 1, rows - 1))
    return np.asarray(texture[texel[..., 1], texel[..., 0]], np.float64)
