"""Bound the reprojection error of cached impostor tiles, and select which to warp again.

A tile warped for a viewer C0 is drawn for the present viewer C as a picture on a plane through the middle of the
object's depth range (shaders/composite/composite.vert has the mathematics). Points off that plane are displaced on the
screen; `parallax` bounds by how much. Everything is in the object's frame, where an object that moves is a viewer that
moves, and a camera that turns changes nothing. Cf. Schaufler 1995.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import matrices
from depthwalk.render.impostors.frustum_crop import GUARD
from depthwalk.render.impostors.tile_cache import CachedTiles
from depthwalk.render.view.view import View
from depthwalk.types import Array, Mask, Rows

HARDEST = 4.0  # times the allowed error: a tile whose error is greater is warped regardless of the budget
MARGIN = 1.25  # cached tiles are cut to a frustum wider than the view's by this factor, so that the camera may turn
COARSER = 1.25  # pixels per texel, or texels per pixel, that count as an error of 1


def parallax(records: NDArray[np.void], viewer: Array, focal_pixels: float) -> Array:
    """Return a bound on the displacement, on the screen, of any point of an object that a cached tile shows.

    Let D and D' be the viewer's distances to the plane when the tile was warped and now, r = D/D', κ = 1 − 1/r, and δ
    how far the viewer moved along the plane. Points of inverse depths λ and λ' that were warped to one place x of the
    plane, relative to the epipole, now belong (λ' − λ)·r·(δ − κ·x) / ((λ + (1 − λ)·r)·(λ' + (1 − λ')·r)) apart. λ' is
    that of the plane on which the tile is drawn, through the middle of the object's depth range.

    Parameters
    ----------
    records : (n,) COMPOSITE_RECORD of the tiles.
    viewer : (n, 3) the present viewer in the objects' frames, metres.
    focal_pixels : pixels per unit of x/z, in the middle of the picture.

    Returns
    -------
    (n,) pixels; inf where the viewer is not in front of the tile's plane.
    """
    distance = records["normal"][:, 3].astype(float)
    moved = viewer - records["origin"][:, :3]
    delta = np.stack([np.einsum("ni,ni->n", moved, records[name][:, :3]) for name in ("right", "up")], -1)
    ahead = np.einsum("ni,ni->n", moved, records["normal"][:, :3])
    distance_now = np.maximum(distance + ahead, 1e-3 * distance)
    ratio = distance / distance_now
    low, high = np.stack([records["right"][:, 3], records["up"][:, 3]], -1), records["high"][:, :2]
    nearest, farthest = records["high"][:, 2:].astype(float).T

    kappa = -(ahead / distance)[:, None]
    across = np.maximum(np.abs(delta - kappa * low), np.abs(delta - kappa * high))
    stretch = np.stack([lam + (1 - lam) * ratio for lam in (nearest, farthest, (nearest + farthest) / 2)])
    apart = (nearest - farthest) / 2 * ratio * np.hypot(*across.T) / (stretch[:2].min(0) * stretch[2])
    # The picture is at least as far away as the nearest point of its rectangle.
    ends = [
        (bound + ((1 - lam) * ratio)[:, None] * delta) / (lam + (1 - lam) * ratio)[:, None] - delta
        for bound in (low, high)
        for lam in (nearest, farthest)
    ]
    gap = np.maximum(np.maximum(np.minimum(*ends[:2]), -np.maximum(*ends[2:])), 0)
    pixels = focal_pixels * apart / np.sqrt(distance_now**2 + (gap**2).sum(1))
    return np.where(distance + ahead > 1e-3 * distance, pixels, np.inf)


def covers_view(tiles: CachedTiles, view: View, rotation: Array, viewer: Array, forward: Array) -> Mask:
    """Return which tiles hold everything that the view sees of their objects.

    Parameters
    ----------
    tiles : the n tiles.
    view : the view of the picture.
    rotation : (n, 4) unit quaternions (x, y, z, w) of the objects.
    viewer : (n, 3) the viewer in the objects' frames, metres.
    forward : (n, 2) least and greatest distance of each object along the view axis, in metres of its frame.

    Returns
    -------
    (n,) whether each tile covers the view.
    """
    corners = np.array([[x, y, 1.0] for x in (-1, 1) for y in (-1, 1)])
    rays = corners @ view.ray_from_screen.T @ matrices(rotation)  # (n, 4, 3)
    corners = np.concatenate([rays * forward[:, :1, None], rays * forward[:, 1:, None]], 1)
    corners += (viewer - tiles.record["origin"][:, :3])[:, None]
    a, b, c = np.moveaxis(corners @ np.swapaxes(tiles.frustum, 1, 2), -1, 0)
    return np.asarray(((np.abs(a) <= c) & (np.abs(b) <= c)).all(1))


def frustum_rows(view: View, rotation: Array) -> Array:
    """Return the frusta of tiles that are cut to `MARGIN` times the view's size, less a border for filtering.

    Parameters
    ----------
    view : the view of the picture.
    rotation : (n, 4) unit quaternions (x, y, z, w) of the objects.

    Returns
    -------
    (n, 3, 3) rows, see `CachedTiles.frustum`.
    """
    axes = view.axes @ matrices(rotation)
    tan_x, tan_y = (t * MARGIN / GUARD for t in view.half_extent)
    return np.asarray(axes / np.array([tan_x, tan_y, 1.0])[:, None])


def coarseness(made: Array, target: Array) -> Array:
    """Return the error in the resolution of n tiles, on a logarithmic scale.

    Parameters
    ----------
    made : (n,) pixels per metre that each tile was made for.
    target : (n,) pixels per metre that each tile should have.

    Returns
    -------
    (n,) 0 where the resolution is right, 1 where the error is as large as allowed.
    """
    return np.asarray(np.abs(np.log(target / made)) / np.log(COARSER))


def due(error: Array, triangles: Rows, area: Array, budget: int) -> Mask:
    """Choose the tiles to warp again.

    Every tile with an error above `HARDEST` is warped again. Of tiles with an error above 1, those come first whose
    turn improves the picture most for what it costs, until `budget` triangles are used up.

    A tile that costs c triangles, covers the area a and whose error grows by v in a frame has, if it is warped every p
    frames, the mean error p·v/2. It shows along the tile's outline, whose length grows with √a. The sum of √a·p·v/2
    over all tiles is least, for a given sum of c/p, if p is proportional to √(c/(√a·v)). So with equal v the tile whose
    e·√(√a/c) is greatest is the most overdue. If errors alone decided, or the whole area, a few trees would use up the
    budget, while the flags of a path, of a few triangles each, drift apart.

    Parameters
    ----------
    error : (n,) reprojection error of each tile, 1 where as large as allowed.
    triangles : (n,) how many triangles warping each tile takes.
    area : (n,) how much of the picture each tile covers, in any unit.
    budget : how many triangles may be warped in a frame.

    Returns
    -------
    (n,) which tiles to warp again.
    """
    chosen = error > HARDEST
    late = ((error > 1) & ~chosen).nonzero()[0]
    if len(late):
        overdue = error[late] * np.sqrt(np.sqrt(area[late]) / np.maximum(triangles[late], 1))
        worst = late[np.argsort(-overdue, kind="stable")]
        left = budget - int(triangles[chosen].sum())
        chosen[worst[np.cumsum(triangles[worst]) <= left]] = True
    return chosen
