"""Draw captured views ray by ray in NumPy: the twin of shaders/octahedral and shaders/billboard.

Octahedral impostors blend three views (Brucks 2018, "Octahedral impostors"); billboards show the nearest of those taken
all around (Rohlf and Helman 1994), with the depth of each pixel (Schaufler 1997, "Nailboards"). Views are looked up in
the finest mip-map.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.captured_views import CapturedViews, CaptureParams
from depthwalk.geometry.view_directions import square_from_direction, view_axes
from depthwalk.types import Array


def blended_views(direction: Array, params: CaptureParams) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return which views are blended for a viewer, and their weights.

    Parameters
    ----------
    direction
        (3,) from the object's centre to the viewer, asset frame, of any length.
    params
        The views, of a sphere or hemisphere.

    Returns
    -------
    tuple
        Numbers (3,) of views, and barycentric weights (3,), which add up to 1.
    """
    last = params.count - 1
    square = square_from_direction(direction[None] / np.linalg.norm(direction), params.directions == "hemisphere")[0]
    grid = (square * 0.5 + 0.5) * last
    cell = np.clip(np.floor(grid).astype(int), 0, last - 1)
    x, y = grid - cell
    opposite = np.array([1, 1])
    if params.directions == "sphere" and np.prod(2 * cell + 1 - last) > 0:  # along the fold, see the shader
        x, cell, opposite = 1 - x, cell + np.array([1, 0]), np.array([-1, 1])
    side = opposite * ((1, 0) if x > y else (0, 1))
    corners = np.stack([cell, cell + side, cell + opposite])
    return corners @ [1, params.count], np.array([1 - max(x, y), abs(x - y), min(x, y)])


def octahedral_hits(
    views: CapturedViews, params: CaptureParams, viewer: Array, rays: Array, steps: int = 1
) -> NDArray[np.float64]:
    """Return where an octahedral impostor shows a surface along each ray.

    Parameters
    ----------
    views
        The captured views.
    params
        How they were captured.
    viewer
        (3,) metres, asset frame.
    rays
        (n, 3) directions from the viewer, asset frame, of any length above 0.
    steps
        How often each view is shifted by its depth.

    Returns
    -------
    numpy.ndarray
        (n,) multiples of the rays' lengths; NaN where the impostor shows nothing.
    """
    from_middle = viewer - views.centre
    numbers, weights = blended_views(from_middle, params)
    coverage, part = np.zeros((2, len(rays)))
    for number, weight, axes in zip(numbers, weights, view_axes(params.unit_vectors()[numbers]), strict=True):
        eye, ray = from_middle @ axes.T / views.radius, rays @ axes.T / views.radius
        height: Array = np.zeros(len(rays))
        for _ in range(steps):
            height = _height(views, number, _place(eye, ray, height))
        at = _place(eye, ray, height)
        share = weight * _bilinear(views.colour[number, ..., 3], at) * (np.abs(at).max(1) < 1)
        coverage += share
        part += share * (_height(views, number, at) - eye[2]) / ray[:, 2]
    return np.where(coverage >= 0.5, part / np.maximum(coverage, 1e-9), np.nan)


def billboard_hits(views: CapturedViews, viewer: Array, rays: Array) -> NDArray[np.float64]:
    """Return where a billboard shows a surface along each ray.

    Its plane is upright, through the middle of the object, and turned to the viewer. Seen from above, its surface may
    lie before the object's box; it is then shown where rays enter the rectangle through which the box is seen.

    Parameters
    ----------
    views
        The captured views, `azimuths`.
    viewer, rays
        See `octahedral_hits`.

    Returns
    -------
    numpy.ndarray
        (n,) multiples of the rays' lengths; NaN where the billboard shows nothing.
    """
    count, from_middle = len(views.colour), viewer - views.centre
    number = round(np.arctan2(from_middle[0], from_middle[2]) / (2 * np.pi) * count) % count
    right, _, toward = view_axes(from_middle[None] / np.linalg.norm(from_middle))[0]
    up = np.array([0.0, 1, 0])
    axes = np.stack([right, up, np.cross(right, up)])
    before_box = from_middle @ toward - np.abs(toward) @ views.half_size
    eye, ray = from_middle @ axes.T / views.radius, rays @ axes.T / views.radius
    at = _place(eye, ray, np.zeros(len(rays)))
    shown = (_bilinear(views.colour[number, ..., 3], at) >= 0.5) & (np.abs(at).max(1) < 1) & (ray[:, 2] < 0)
    hits = np.maximum((_height(views, number, at) - eye[2]) / ray[:, 2], before_box / -(rays @ toward))
    return np.where(shown, hits, np.nan)


def _place(eye: Array, ray: Array, height: Array) -> Array:
    """Return the positions (n, 2) of rays in a view at a given height (n,) above its centre."""
    return np.asarray(eye[:2] + ((height - eye[2]) / ray[:, 2])[:, None] * ray[:, :2])


def _height(views: CapturedViews, number: int, at: Array) -> Array:
    """Return the height (n,) of the surface above a view's centre at positions (n, 2), −1 to 1."""
    return 1 - 2 * _bilinear(views.surface[number, ..., 3], at)


def _bilinear(texels: NDArray[np.uint8], at: Array) -> Array:
    """Return values (n,) from 0 to 1 of texels (H, H) at positions (n, 2), −1 to 1, clamped at the edges."""
    last = len(texels) - 1
    place = np.clip((at * 0.5 + 0.5) * len(texels) - 0.5, 0, last)
    low = np.minimum(np.floor(place).astype(int), last - 1)
    (x, y), (column, row) = (place - low).T, low.T
    lower = texels[row, column] * (1 - x) + texels[row, column + 1] * x
    upper = texels[row + 1, column] * (1 - x) + texels[row + 1, column + 1] * x
    return np.asarray((lower * (1 - y) + upper * y) / 255)
