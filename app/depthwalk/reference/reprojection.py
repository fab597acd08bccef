"""Find where a finished picture shows what another camera sees: the twin of shaders/reprojection."""

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.reprojection import (
    BEYOND,
    CELL,
    FIXED_POINT_STEPS,
    HIDDEN,
    LEAST_AHEAD,
    REFLECTED,
    STRIDE,
    seen_from,
)
from depthwalk.render.view.view import View
from depthwalk.types import Array, Mask

_CORNERS = np.array([[0, 1, 0, 1], [0, 0, 1, 1]])  # of a cell: to the right and up


def nearest_in_cells(distances: Array) -> NDArray[np.float64]:
    """Return the least distance in each cell of a picture, as shaders/reprojection/nearest.frag finds it.

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
    steps = np.append(np.arange(STRIDE // 2, CELL, STRIDE), 0)
    row, column = (
        (np.arange(count)[:, None] * CELL + steps).clip(0, size - 1)
        for count, size in zip((rows, columns), distances.shape, strict=True)
    )
    return np.asarray(distances[row[:, None, :, None], column[None, :, None, :]].min((2, 3)), np.float64)


def nearest_seen(picture: View, distances: Array, view: View) -> NDArray[np.float64]:
    """Return how far ahead of another camera the nearest surface of a picture is, by cells of that camera's view.

    Each cell of the picture goes where its nearest surface appears, with a border of half a cell
    (shaders/reprojection/moved_cell.vert).

    Parameters
    ----------
    picture
        The view of the picture.
    distances
        (h, w) metres along the picture's view axis, lower row first.
    view
        The other view, of W × H pixels.

    Returns
    -------
    NDArray[np.float64]
        (⌈H / CELL⌉, ⌈W / CELL⌉) metres; `BEYOND` where nothing comes.
    """
    rays, viewer, _ = seen_from(picture, view)
    nearest = nearest_in_cells(distances)
    row, column = np.indices(nearest.shape).reshape(2, -1, 1)
    place = np.dstack([column + _CORNERS[0], row + _CORNERS[1]]) * CELL / np.array(picture.size)
    direction = np.dstack([(2 * place - 1) * np.array(picture.half_extent), np.ones(place.shape[:2])])
    seen = (direction * nearest.reshape(-1, 1, 1) - viewer) @ np.linalg.inv(rays).T
    ahead, cells = seen[..., 2].min(1), np.array(view.size) / CELL
    found = np.full(np.ceil(cells).astype(int)[::-1], float(BEYOND))
    drawn = np.flatnonzero((nearest.ravel() < BEYOND) & (ahead >= LEAST_AHEAD))
    at = (0.5 + 0.5 * seen[drawn, :, :2] / seen[drawn, :, 2:]) * cells
    low, high = np.ceil(at.min(1) - 1), np.floor(at.max(1))  # of the cells whose middles are within
    first, last = (edge.clip(0, np.array(found.shape)[::-1]).astype(int) for edge in (low, high + 1))
    for k, (x, y), (right, top) in zip(drawn, first, last, strict=True):
        found[y:top, x:right] = np.minimum(found[y:top, x:right], ahead[k])
    return found


def beside_nearer(distances: Array) -> Mask:
    """Return at which pixels of a picture a nearer surface begins beside, as shaders/reprojection/distance.frag does.

    Parameters
    ----------
    distances
        (h, w) metres.

    Returns
    -------
    Mask
        (h, w).
    """
    padded = np.pad(distances, 1, mode="edge")
    beside = np.min([padded[1:-1, 2:], padded[1:-1, :-2], padded[2:, 1:-1], padded[:-2, 1:-1]], axis=0)
    return np.asarray(beside < HIDDEN * distances)


def sources(picture: View, distances: Array, view: View) -> NDArray[np.float64]:
    """Return which place of a picture each pixel of another view is filled from.

    The surface on a pixel's ray is found by fixed-point steps, which take turns between how far away it is and where in
    the picture it therefore lies (Bowles et al. 2012, "Iterative Image Warping"). They begin with the nearest surface
    that has come there. Beside nearer surfaces a pixel of the picture keeps to itself, so that its middle is the place.

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

    def search(place: Array) -> tuple[Array, Array, Array, Array]:
        ahead = look_up(distances, place)
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

    cell = np.indices((height, width)) // CELL
    near = nearest_seen(picture, distances, view)[cell[0], cell[1]]
    place, ahead, expected, behind = search(place_of(viewer + near[..., None] * rays))
    hidden = ahead < HIDDEN * expected
    alone = hidden | (look_up(beside_nearer(distances).astype(float), place) > 0)
    found = np.where(hidden[..., None], behind, place)
    inside = found.clip(0, 1)
    beyond = np.abs(found - inside) % (2 * REFLECTED)  # mirrored to and fro
    found = np.abs(inside - np.minimum(beyond, 2 * REFLECTED - beyond))
    size = np.array(picture.size)
    return np.asarray(np.where(alone[..., None], (np.floor(found * size) + 0.5) / size, found))


def look_up(texture: Array, place: Array) -> NDArray[np.float64]:
    """Return the texels (…) of a texture (h, w) at places (…, 2), 0 to 1, without filtering."""
    rows, columns = texture.shape
    texel = np.clip((place * (columns, rows)).astype(int), 0, (columns - 1, rows - 1))
    return np.asarray(texture[texel[..., 1], texel[..., 0]], np.float64)
