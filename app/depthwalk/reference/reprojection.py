"""Find where a finished picture shows what another camera sees: the twin of shaders/reprojection."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthwalk.reference.finished_picture import beside_nearer, nearest_in_cells, nearest_moving, roughness
from depthwalk.render.reprojection.nearest_cells import CELL
from depthwalk.render.reprojection.reprojection import (
    BEYOND,
    DAMPING,
    EDGE,
    EDGE_STEPS,
    FIXED_POINT_STEPS,
    HIDDEN,
    LEAST_AHEAD,
    REFLECTED,
    elapsed,
    seen_from,
)
from depthwalk.render.reprojection.smooth_tiles import MOST_CELLS, MOVES, ROUGHNESS_CELL, TILE, TOLERANCE, TileClass
from depthwalk.render.view.view import View
from depthwalk.types import Array, Mask

_CORNERS = np.array([[0, 1, 0, 1], [0, 0, 1, 1]])  # of a cell: to the right and up


def nearest_seen(picture: View, distances: Array, view: View) -> NDArray[np.float64]:
    """Return the distance along another camera's axis to the nearest surface of a picture, by cells of that view.

    Each cell of the picture is moved to where its nearest surface appears, with a border of half a cell
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
        (⌈H / CELL⌉, ⌈W / CELL⌉) metres; `BEYOND` where no surface appears.
    """
    nearest = nearest_in_cells(distances)
    return _seen_by_cells(picture, np.dstack([np.zeros((*nearest.shape, 3)), nearest]), view)[..., 0]


def nearest_moved(picture: View, distances: Array, view: View, velocities: Array) -> NDArray[np.float64]:
    """Return the same as `nearest_seen` for surfaces that move by themselves, and by how much they have moved.

    Parameters
    ----------
    picture, distances, view
        See `nearest_seen`.
    velocities
        (h, w, 4), see `finished_picture.velocities_in`.

    Returns
    -------
    NDArray[np.float64]
        (⌈H / CELL⌉, ⌈W / CELL⌉, 4) metres ahead, `BEYOND` where no surface appears; and by how much that surface has
        moved by itself, metres, in the axes of the picture's camera.
    """
    return _seen_by_cells(picture, nearest_moving(distances, velocities), view)


def _seen_by_cells(picture: View, surfaces: Array, view: View) -> NDArray[np.float64]:
    """Return what `nearest_moved` does, of surfaces (rows, columns, 4): velocities, and metres ahead."""
    rays, viewer, _ = seen_from(picture, view)
    row, column = np.indices(surfaces.shape[:2]).reshape(2, -1, 1)
    place = np.dstack([column + _CORNERS[0], row + _CORNERS[1]]) * CELL / np.array(picture.size)
    direction = np.dstack([(2 * place - 1) * np.array(picture.half_extent), np.ones(place.shape[:2])])
    cells, flat = np.array(view.size) / CELL, surfaces.reshape(-1, 4)
    found = np.zeros((*np.ceil(cells).astype(int)[::-1], 4))
    found[..., 0] = BEYOND
    shift = elapsed(picture, view) * flat[:, :3]
    seen = (direction * flat[:, 3:, None] + shift[:, None] - viewer) @ np.linalg.inv(rays).T
    _draw_cells(found, cells, seen, flat[:, 3] < BEYOND, shift)
    return found


def _draw_cells(found: Array, cells: Array, seen: Array, is_surface: Mask, shift: Array) -> None:
    """Draw the rectangles around corners (n, 4, 3), metres right, up and ahead of the new camera, into `found`."""
    ahead = seen[..., 2].min(1)
    drawn = np.flatnonzero(is_surface & (ahead >= LEAST_AHEAD))
    at = (0.5 + 0.5 * seen[drawn, :, :2] / seen[drawn, :, 2:]) * cells
    low, high = np.ceil(at.min(1) - 1), np.floor(at.max(1))  # of the cells whose centres are inside
    first, last = (edge.clip(0, np.array(found.shape[:2])[::-1]).astype(int) for edge in (low, high + 1))
    for k, (x, y), (right, top) in zip(drawn, first, last, strict=True):
        part = found[y:top, x:right]
        part[part[..., 0] > ahead[k]] = ahead[k], *shift[k]


class _Found(NamedTuple):
    """Hold the result of the search of shaders/reprojection/search.glsl for n rays.

    Attributes
    ----------
    place
        (n, 2) position in the picture, 0 to 1, of what is shown.
    hidden
        (n,) whether what should be visible is hidden in the picture, or has left.
    along
        (n,) metres along the ray, at which it should be.
    is_there
        (n,) whether it moves by itself, and is found where it should be.
    is_lost
        (n,) whether the search has ended at no surface.
    uncovered
        (n, 2) what is shown instead of `place` where the picture may lack what is asked for.
    """

    place: NDArray[np.float64]
    hidden: Mask
    along: NDArray[np.float64]
    is_there: Mask
    is_lost: Mask
    uncovered: NDArray[np.float64]


def _place_of(picture: View, points: Array) -> NDArray[np.float64]:
    """Return the positions in a picture of points (…, 3), right, up and ahead of its camera."""
    half_extent = np.array(picture.half_extent)
    return np.asarray(0.5 + 0.5 * points[..., :2] / (np.maximum(points[..., 2:], 1e-3) * half_extent))


def _near_points(picture: View, view: View, nearest: Array, at: Array) -> tuple[Array, Array]:
    """Return the rays through positions (n, 2) of a screen, and the points on them at the distance `nearest`.

    Arguments: see `sources`; `nearest`, (n,), is the distance along the viewer's axis.
    """
    rays_of, viewer, _ = seen_from(picture, view)
    rays = np.column_stack([2 * at - 1, np.ones(len(at))]) @ rays_of.T
    return rays, viewer + nearest[:, None] * rays


def _search(
    picture: View,
    distances: Array,
    view: View,
    nearest: Array,
    at: Array,
    velocities: Array | None,
    *,
    midway: bool,
    start_shift: Array | None = None,
) -> _Found:
    """Find what positions (n, 2) of another camera's screen show. Other arguments: see `_near_points`, `sources`.

    midway: whether the first step, where it is long, goes half as far, in inverse distance, and another one follows.
    start_shift: by how much (n, 3) the surface has moved by itself that is looked for; None: it stays.
    """
    viewer = seen_from(picture, view)[1]
    moves = np.full(len(at), start_shift is not None)
    shift = np.zeros((len(at), 3)) if start_shift is None else start_shift
    rays, points = _near_points(picture, view, nearest, at)
    points = points - shift
    place = behind = _place_of(picture, points)
    ahead = look_up(distances, place)
    along, expected = nearest, points[:, 2]
    passed = np.column_stack([ahead, expected, along])
    for k in range(-midway, FIXED_POINT_STEPS):
        if velocities is not None:
            moves, shift = _shift_at(picture, view, velocities, place)
        step = _next_along(picture, view, along, expected, ahead, place, shift)
        along = np.where((k < 0) & (step > EDGE * along), 2 / (1 / along + 1 / step), step)
        points = viewer + along[:, None] * rays - shift
        place, expected = _place_of(picture, points), points[:, 2]
        ahead = look_up(distances, place)
        behind = np.where((ahead > passed[:, 0])[:, None], place, behind)
        passed = np.where((ahead > passed[:, 0])[:, None], np.column_stack([ahead, expected, along]), passed)
    does_move = np.zeros(len(at), bool) if velocities is None else look_up(velocities[..., 3], place) > 0
    hidden = np.asarray(ahead < HIDDEN * expected) | (does_move & ~moves)
    is_there = moves & does_move & (np.abs(ahead - expected) < (1 - HIDDEN) * expected)
    place, is_lost = np.where(hidden[:, None], behind, place), hidden | (ahead * HIDDEN > expected)
    uncovered = np.where(is_lost[:, None], _beside(picture, distances, view, rays, behind, passed, velocities), place)
    return _Found(place, hidden, along.astype(float), is_there, is_lost, uncovered)


def _shift_at(picture: View, view: View, velocities: Array, place: Array) -> tuple[Mask, NDArray[np.float64]]:
    """Return whether surfaces at positions (n, 2) of a picture move by themselves, and by how many metres."""
    speed = np.stack([look_up(velocities[..., k], place) for k in range(3)], -1)
    return np.asarray(look_up(velocities[..., 3], place) > 0), elapsed(picture, view) * speed


def _next_along(
    picture: View, view: View, along: Array, expected: Array, ahead: Array, place: Array, shift: Array
) -> NDArray[np.float64]:
    """Return how far along rays to look next, metres, as `next_along` of shaders/reprojection/search.glsl does."""
    _, viewer, axis = seen_from(picture, view)
    direction = np.column_stack([(2 * place - 1) * np.array(picture.half_extent), np.ones_like(ahead)])
    seen = (direction * ahead[:, None] + shift - viewer) @ axis
    if axis @ viewer > 0:
        scaled = along * ahead / np.where(expected > 0, expected, np.nan)
        seen = np.where(expected > 0, np.sqrt(np.maximum(seen, DAMPING * scaled) * scaled), seen)
    return np.asarray(np.maximum(seen, 1e-2))


def _beside(
    picture: View,
    distances: Array,
    view: View,
    rays: Array,
    behind: Array,
    passed: Array,
    velocities: Array | None,
) -> NDArray[np.float64]:
    """Return what to show where searches are lost: `place_shown` of shaders/reprojection/search.glsl.

    Parameters
    ----------
    picture, distances, view, velocities
        See `sources`.
    rays
        (n, 3), see `_near_points`.
    behind, passed
        (n, 2) positions of the farthest surfaces that were passed, and (n, 3) how far they are, should be, and are
        along the ray, metres.
    """
    viewer = seen_from(picture, view)[1]

    def follow(place: Array, along: Array, expected: Array, ahead: Array) -> tuple[Array, Array, Array]:
        shift = np.zeros_like(rays) if velocities is None else _shift_at(picture, view, velocities, place)[1]
        along = _next_along(picture, view, along, expected, ahead, place, shift)
        point = viewer + along[:, None] * rays - shift
        return _place_of(picture, point), along, point[:, 2]

    ahead, expected, along = passed.T
    goes_on, along, expected = follow(behind, along, expected, ahead)
    nearer = look_up(distances, goes_on)
    edge = np.minimum(np.sqrt(nearer * ahead), EDGE * nearer)
    nearest = follow(goes_on, along, expected, nearer)[0]
    low, high = behind, goes_on
    for _ in range(EDGE_STEPS):
        between = (low + high) / 2
        is_farther = (look_up(distances, between) > edge)[:, None]
        low, high = np.where(is_farther, between, low), np.where(is_farther, high, between)
    is_visible, is_beyond = nearer >= HIDDEN * expected, (goes_on != goes_on.clip(0, 1)).any(-1)
    found = np.where((look_up(distances, nearest) < edge)[:, None], nearest, low)
    return np.where((is_visible | is_beyond)[:, None], goes_on, found)


def _surfaces_on(
    picture: View, distances: Array, view: View, at: Array, velocities: Array | None, *, midway: bool = True
) -> _Found:
    """Find what positions (n, 2) of another camera's screen show, where anything may have come that moves by itself.

    Other arguments: see `sources` and `_search`.
    """
    cell = at * np.array(view.size) / CELL
    nearest = nearest_seen(picture, distances, view)
    stays = _search(picture, distances, view, _of_cell(nearest, cell), at, velocities, midway=midway)
    if velocities is None:
        return stays
    moved = nearest_moved(picture, distances, view, velocities)
    start = np.stack([_of_cell(moved[..., k], cell) for k in range(4)], -1)
    came = _search(picture, distances, view, start[:, 0], at, velocities, midway=False, start_shift=start[:, 1:])
    better = (start[:, 0] < BEYOND) & came.is_there & (stays.hidden | (came.along < stays.along))
    return _Found(
        np.where(better[:, None], came.place, stays.place),
        np.where(better, came.hidden, stays.hidden),
        np.where(better, came.along, stays.along),
        better,
        np.where(better, came.is_lost, stays.is_lost),
        np.where(better[:, None], came.uncovered, stays.uncovered),
    )


def _of_cell(cells: Array, cell: Array) -> NDArray[np.float64]:
    """Return the values of `cells` (rows, columns) at positions (n, 2), in cells."""
    return look_up(cells, cell / cells.shape[::-1])


def tiles(
    picture: View, distances: Array, view: View, velocities: Array | None = None
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return how the tiles of a screen are drawn, and the sources of their corners (shaders/reprojection/classes.frag).

    Parameters
    ----------
    picture, distances, view, velocities
        See `sources`.

    Returns
    -------
    classes : NDArray[np.int64]
        (rows, columns) of `TileClass`.
    corners : NDArray[np.float64]
        (rows + 1, columns + 1, 2) positions in the picture that the corners of tiles show.
    """
    size, viewer = np.array(view.size), seen_from(picture, view)[1]
    columns, rows = -(-size // TILE)
    nearest = nearest_seen(picture, distances, view)
    moved = None if velocities is None else nearest_moved(picture, distances, view, velocities)[..., 0]
    lattice = np.indices((2 * rows + 1, 2 * columns + 1))[::-1].reshape(2, -1).T * TILE / 2
    start = _of_cell(nearest, lattice / CELL)
    found, passing = (
        _search(picture, distances, view, start, lattice / size, None, midway=midway) for midway in (True, False)
    )
    place, seen = found.place.reshape(2 * rows + 1, -1, 2), ~found.hidden.reshape(2 * rows + 1, -1)
    differs = np.abs(passing.along - found.along) >= (1 - HIDDEN) * found.along
    lost = (found.is_lost | differs).reshape(seen.shape)
    corners, pixels, rough = place[::2, ::2], np.array(picture.size), roughness(distances, velocities)
    classes = np.full((rows, columns), int(TileClass.SEARCHED))
    for row, column in np.ndindex(rows, columns):
        at = np.array([(column + x, row + y) for y in (0, 1) for x in (0, 1)]) * TILE / size
        middle = (np.array([[column, row]]) + 0.5) * TILE / CELL
        near = _place_of(picture, _near_points(picture, view, _of_cell(nearest, middle).repeat(4), at)[1])
        nine = np.s_[2 * row : 2 * row + 3, 2 * column : 2 * column + 3]
        low, high = place[nine].min((0, 1)), place[nine].max((0, 1))
        if (low < 0).any() or (high > 1).any():
            classes[row, column] = TileClass.AROUND
            continue
        off = np.linalg.norm((place[nine] - _between(corners[row : row + 2, column : column + 2], 3)) * pixels, axis=-1)
        parallax = view.focal_pixels * np.linalg.norm(
            (low + high - 1) * np.array(picture.half_extent) * viewer[2] - viewer[:2]
        )
        first = (np.minimum(low, near.min(0)).clip(0, 1) * pixels).astype(int) // ROUGHNESS_CELL
        last = np.minimum((np.maximum(high, near.max(0)).clip(0, 1) * pixels).astype(int), pixels - 1) // ROUGHNESS_CELL
        is_small = bool((last - first < MOST_CELLS).all())
        most = rough[first[1] : last[1] + 1, first[0] : last[0] + 1].max() if is_small else 0.0
        if moved is not None and (_of_cell(moved, middle)[0] < BEYOND or most >= MOVES or not is_small):
            classes[row, column] = TileClass.MOVED
        elif is_small and seen[nine].all() and off.max() < TOLERANCE and most * parallax < TOLERANCE:
            classes[row, column] = TileClass.SMOOTH
        elif lost[nine].any():
            classes[row, column] = TileClass.UNCOVERED
    return classes, corners


def _between(corners: Array, count: int, at: Array | None = None) -> NDArray[np.float64]:
    """Return `count` × `count` positions between corners (2, 2, 2), at parts (count,) of the edges; None: evenly."""
    part = (np.linspace(0, 1, count) if at is None else at)[:, None]
    lower, upper = (row[0] + part * (row[1] - row[0]) for row in corners)
    return np.asarray(lower + part[..., None] * (upper - lower))


def sources(picture: View, distances: Array, view: View, velocities: Array | None = None) -> NDArray[np.float64]:
    """Return the position in a picture from which each pixel of another view is filled.

    The surface on a pixel's ray is found by fixed-point iteration, which alternates between its distance and its
    position in the picture (Bowles et al. 2012, "Iterative Image Warping"). It begins with the nearest surface that has
    moved there. Beside nearer surfaces, pixels of the picture are not interpolated, so the position is a pixel's
    centre. In smooth tiles, positions are interpolated between the corners.

    Parameters
    ----------
    picture
        The view of the picture.
    distances
        (h, w) metres along the picture's view axis, lower row first; `BEYOND` where nothing is.
    view
        The other view, of W × H pixels, of another moment where surfaces move by themselves.
    velocities
        (h, w, 4) of these, see `finished_picture.velocities_in`; None: nothing moves by itself.

    Returns
    -------
    NDArray[np.float64]
        (H, W, 2) positions in the picture, from (0, 0), its lower left corner, to (1, 1); lower row first.
    """
    width, height = view.size
    pixel = np.indices((height, width))[::-1].reshape(2, -1).T
    classes, corners = tiles(picture, distances, view, velocities)
    at = (pixel + 0.5) / view.size
    tile_classes = classes[pixel[:, 1] // TILE, pixel[:, 0] // TILE]
    found = _surfaces_on(picture, distances, view, at, None)
    covered = _surfaces_on(picture, distances, view, at, None, midway=False)
    is_covered = tile_classes == TileClass.SEARCHED
    exact = np.where(is_covered[:, None], covered.place, found.place)
    place = np.where(is_covered[:, None], exact, found.uncovered)
    found = found._replace(hidden=np.where(is_covered, covered.hidden, found.hidden))
    if velocities is not None:
        moving = _surfaces_on(picture, distances, view, at, velocities)
        may_move = np.isin(tile_classes, (TileClass.MOVED, TileClass.AROUND))[:, None]
        exact, place = np.where(may_move, moving.place, exact), np.where(may_move, moving.uncovered, place)
        found = found._replace(hidden=np.where(may_move[:, 0], moving.hidden, found.hidden))
    alone = found.hidden | (place != exact).any(-1) | (look_up(beside_nearer(distances).astype(float), exact) > 0)
    inside = place.clip(0, 1)
    beyond = np.abs(place - inside) % (2 * REFLECTED)  # mirrored back and forth
    place = np.abs(inside - np.minimum(beyond, 2 * REFLECTED - beyond))
    size = np.array(picture.size)
    shown: NDArray[np.float64] = np.where(alone[:, None], (np.floor(place * size) + 0.5) / size, place)
    shown = shown.reshape(height, width, 2)
    at = (np.arange(TILE) + 0.5) / TILE
    for row, column in np.argwhere(classes == TileClass.SMOOTH):
        tile = shown[row * TILE : (row + 1) * TILE, column * TILE : (column + 1) * TILE]
        tile[:] = _between(corners[row : row + 2, column : column + 2], TILE, at)[: len(tile), : tile.shape[1]]
    return shown


def look_up(texture: Array, place: Array) -> NDArray[np.float64]:
    """Return the texels (…) of a texture (h, w) at positions (…, 2), 0 to 1, without filtering."""
    rows, columns = texture.shape
    texel = np.clip((place * (columns, rows)).astype(int), 0, (columns - 1, rows - 1))
    return np.asarray(texture[texel[..., 1], texel[..., 0]], np.float64)
